"""Rotary gusts on a wing: the rotation of the air that its turbulence makes over span and length.

MIL-F-8785C, paragraph 3.7.5.3 (spectra over the spatial frequency W, one-sided, b the wing span):

    p_g: sigma_w^2 / L_w  0.8 (pi L_w / 4 b)^(1/3) / (1 + (4 b W / pi)^2), independent of the velocities
    q_g: W^2 / (1 + (4 b W / pi)^2) of the spectrum of w_g
    r_g: W^2 / (1 + (3 b W / pi)^2) of the spectrum of v_g

p_g is made from unit white noise by an exactly discretised first-order filter. Its variance is the integral
of its spectrum, 0.8 (pi / 4 b)^(1/3) pi^2 sigma_w^2 / (8 b L_w^(2/3)). q_g and r_g are the slopes of the
vertical and the lateral turbulence along the path, which a first-order filter of length 4 b / pi or 3 b /
pi smooths: (w - its low pass) / length. Air that turns with q nose-up moves by w = -q x at the distance x
ahead, so q_g = -dw/dx, and r_g = dv/dx in the same way.

The standard's rates are about body axes of level flight. Here they belong to the horizontal axes along and
across the heading, and are turned into the body's, so that a bank of any size gets the same field of air.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel
from flightsim.foundation.rotations import rotate_inverse, yaw_of
from flightsim.turbulence import BLOCK_STEPS

Array = NDArray[np.float64]

_LEAST_AIRSPEED_M_S: Final = 1.0  # as for the turbulence that it goes with
_STILL_AIR_M_S: Final = 1e-3
"""Slower air makes no moments. In the step in which gusts begin around a vehicle that stands in calm air,
JSBSim multiplies the new dynamic pressure by rates over the airspeed of the step before, which is near zero.
"""
_ROTARY: Final = 1  # added to the spawn key of the turbulence's stream


@kernel
def roll_gust_sigma_rad_s(sigma_w_m_s: float, length_w_m: float, span_m: float) -> float:
    """Standard deviation of p_g."""
    shape = 0.8 * (math.pi / (4.0 * span_m)) ** (1.0 / 3.0) * math.pi**2 / (8.0 * span_m)
    return sigma_w_m_s * math.sqrt(shape) / length_w_m ** (1.0 / 3.0)


@kernel
def advance_rotary(
    constants: Array,
    state: Array,
    normal: float,
    airspeed_m_s: float,
    scales: Array,
    gust_ned_m_s: Array,
    q_ned_from_frd: Array,
    work: Array,
    out: Array,
) -> None:
    """Advance one step.

    Args:
        constants: (2,) wing span in m, step in s.
        state: (4,) p_g / sigma, low-passed north, east, down.
        normal: unit white noise.
        airspeed_m_s: true airspeed.
        scales: (4,) of the turbulence in this step, as of `turbulence.low_altitude_scales`.
        gust_ned_m_s: (3,) its velocity.
        q_ned_from_frd: (4,) attitude.
        work: (3,), written.
        out: (3,) rotation of the air over ground, body axes, rad/s, written; zero around a vehicle in still
            air.
    """
    span_m, dt_s = constants[0], constants[1]
    travelled_m = max(airspeed_m_s, _LEAST_AIRSPEED_M_S) * dt_s
    vertical_m, lateral_m = 4.0 * span_m / math.pi, 3.0 * span_m / math.pi
    d = travelled_m / vertical_m
    state[0] = math.exp(-d) * state[0] + math.sqrt(-math.expm1(-2.0 * d)) * normal
    gain_v, gain_w = -math.expm1(-travelled_m / lateral_m), -math.expm1(-d)
    state[1] += gain_v * (gust_ned_m_s[0] - state[1])
    state[2] += gain_v * (gust_ned_m_s[1] - state[2])
    state[3] += gain_w * (gust_ned_m_s[2] - state[3])
    heading = yaw_of(q_ned_from_frd)
    c, s = math.cos(heading), math.sin(heading)
    p = state[0] * roll_gust_sigma_rad_s(scales[3], scales[1], span_m)
    q = -(gust_ned_m_s[2] - state[3]) / vertical_m
    right_m_s = c * (gust_ned_m_s[1] - state[2]) - s * (gust_ned_m_s[0] - state[1])
    work[0] = c * p - s * q
    work[1] = s * p + c * q
    work[2] = right_m_s / lateral_m
    rotate_inverse(q_ned_from_frd, work, out)
    if airspeed_m_s < _STILL_AIR_M_S:
        out[:] = 0.0


class RotaryGusts:
    """State and noise of the rotation of the air around one aircraft with wings, in addition to its
    `DrydenTurbulence`; `advance_rotary` advances it.

    Args:
        span_m: wing span.
        dt_s: step.
        seed_sequence: the vehicle's stream for turbulence; p_g draws from a separate child stream of it.

    Attributes:
        constants, state, work: of `advance_rotary`; the state is the stationary one of p_g, with no slopes.
        normals: (BLOCK_STEPS,) its noise, drawn by `draw`.
        rates_frd_rad_s: (3,) present rotation of the air over ground, body axes.
    """

    def __init__(self, *, span_m: float, dt_s: float, seed_sequence: np.random.SeedSequence) -> None:
        self.constants = np.array([span_m, dt_s])
        own = np.random.SeedSequence(
            entropy=seed_sequence.entropy, spawn_key=(*seed_sequence.spawn_key, _ROTARY)
        )
        self._generator = np.random.Generator(np.random.PCG64(own))
        self.normals = np.empty(BLOCK_STEPS)
        self.state = np.array([self._generator.standard_normal(), 0.0, 0.0, 0.0])
        self.work = np.zeros(3)
        self.rates_frd_rad_s = np.zeros(3)

    def draw(self) -> None:
        """Draw the noise of the next `BLOCK_STEPS` steps."""
        self._generator.standard_normal(out=self.normals)
