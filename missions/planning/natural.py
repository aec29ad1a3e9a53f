"""A Lissajous curve in its own time law: harmonic motion on both axes.

Source: Steckenrider et al. 2020, equation 11.
"""

import math
from typing import Final

import numpy as np

from missions.errors import PlanError
from missions.patterns.curve import Array, Curve
from missions.patterns.lissajous import Lissajous
from missions.planning.profile import STEP_S
from missions.planning.trajectory import Trajectory
from missions.vehicle.limits import MulticopterLimits

_SHARE_OF_LIMIT: Final = 0.5  # of the acceleration, for the smooth start and stop


def natural_trajectory(
    curve: Curve,
    *,
    fundamental_period_s: float,
    altitude_m: float,
    limits: MulticopterLimits,
    duration_s: float | None = None,
) -> Trajectory:
    """Fly a Lissajous curve (or laps of one) so that x and y are harmonic, with a smooth start and stop.

    Args:
        curve: a `Lissajous`, or `Lap` of one; its parameter is the phase of the fundamental.
        fundamental_period_s: time for 2 pi of the parameter: one lap of a closed curve.
        altitude_m: height above the origin.
        limits: limits of the vehicle.
        duration_s: end at rest after this time, if the curve is not finished before.

    Raises:
        PlanError: the period needs more speed or acceleration than the limits allow; the message names the
            shortest possible period.
    """
    limits.check_altitude(altitude_m)
    if not (math.isfinite(fundamental_period_s) and fundamental_period_s > 0.0):
        raise PlanError(f"period {fundamental_period_s:g} s is not possible; ask for more than 0 s")
    rate = math.tau / fundamental_period_s
    probe = np.linspace(0.0, min(curve.end, 4.0 * math.tau), 4000)
    first, second = curve.derivatives(probe)
    speed = float(np.hypot(*first.T).max()) * rate
    turning = float(np.hypot(*second.T).max()) * rate**2
    shortest = fundamental_period_s * max(
        speed / limits.speed_m_s, math.sqrt(turning / limits.acceleration_m_s2), 1e-9
    )
    if shortest > fundamental_period_s * (1.0 + 1e-9):
        raise PlanError(
            f"period {fundamental_period_s:g} s needs {speed:.1f} m/s and {turning:.1f} m/s^2; "
            f"the vehicle has {limits.speed_m_s:g} m/s and {limits.acceleration_m_s2:g} m/s^2: "
            f"ask for `period_s` {math.ceil(shortest)} or more, or a smaller pattern"
        )
    ramp_s = max(2.0, 1.5 * speed / (_SHARE_OF_LIMIT * limits.acceleration_m_s2))
    whole_s = curve.end / rate + ramp_s
    if duration_s is not None:
        if duration_s < 2.0 * ramp_s:
            raise PlanError(
                f"a search time of {duration_s:g} s is too short; ask for at least {math.ceil(2 * ramp_s)} s"
            )
        whole_s = min(whole_s, duration_s)
    if whole_s < 2.0 * ramp_s:  # a short arc: ramp up, and immediately down again
        ramp_s = 0.5 * whole_s
    t = np.arange(math.ceil(whole_s / STEP_S) + 1) * STEP_S
    u, pace, change = _phase(np.minimum(t, whole_s), whole_s, ramp_s, rate)
    u = np.minimum(u, curve.end)
    return _trajectory(curve, u, pace, change, altitude_m, limits)


def _phase(t: Array, whole_s: float, ramp_s: float, rate: float) -> tuple[Array, Array, Array]:
    """Phase, its rate and its acceleration: the rate rises and falls as a cubic smoothstep over `ramp_s`."""
    up = np.clip(t / ramp_s, 0.0, 1.0)
    down = np.clip((t - (whole_s - ramp_s)) / ramp_s, 0.0, 1.0)

    def step(f: Array) -> Array:
        return f * f * (3.0 - 2.0 * f)

    def integral(f: Array) -> Array:
        return f**3 - 0.5 * f**4

    pace = rate * (step(up) - step(down))
    change = rate / ramp_s * 6.0 * (up * (1.0 - up) - down * (1.0 - down))
    u = rate * (ramp_s * integral(up) + np.maximum(t - ramp_s, 0.0) - ramp_s * integral(down))
    return u, pace, change


def _trajectory(
    curve: Curve, u: Array, pace: Array, change: Array, altitude_m: float, limits: MulticopterLimits
) -> Trajectory:
    points = curve.points(u)
    first, second = curve.derivatives(u)
    velocity = first * pace[:, None]
    acceleration = second * (pace**2)[:, None] + first * change[:, None]
    course = np.unwrap(np.arctan2(first[:, 1], first[:, 0]))
    yaw = _rate_limited(course, limits.yaw_rate_rad_s * STEP_S)
    zeros = np.zeros(len(u))
    return Trajectory(
        step_s=STEP_S,
        position_ned_m=np.column_stack((points, np.full(len(u), -altitude_m))),
        velocity_ned_m_s=np.column_stack((velocity, zeros)),
        acceleration_ned_m_s2=np.column_stack((acceleration, zeros)),
        yaw_rad=yaw,
        yaw_rate_rad_s=np.gradient(yaw, STEP_S),
    )


def _rate_limited(course: Array, largest_step: float) -> Array:
    """The course with limited changes; at a cusp the yaw lags behind and then catches up."""
    if np.abs(np.diff(course)).max() <= largest_step:
        return course
    out = course.tolist()
    for k in range(1, len(out)):
        out[k] = min(max(out[k], out[k - 1] - largest_step), out[k - 1] + largest_step)
    return np.array(out)


def natural_frequencies(curve: Curve, fundamental_period_s: float) -> tuple[float, float]:
    """Frequencies east and north, rad/s, of a curve for which `is_lissajous` is true, in its own time law."""
    inner = getattr(curve, "curve", curve)
    assert isinstance(inner, Lissajous)
    rate = math.tau / fundamental_period_s
    return inner.ratio_x * rate, inner.ratio_y * rate


def is_lissajous(curve: Curve) -> bool:
    """Whether a curve has its own time law."""
    inner = getattr(curve, "curve", curve)
    return isinstance(inner, Lissajous)
