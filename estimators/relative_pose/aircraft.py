"""One aircraft from its sensors, without GPS: attitude by our own filter, magnetic heading, pressure, motion.

Nothing that an autopilot has estimated is used: its attitude, heading and rate of climb depend on its GPS.
"""

import math
from collections.abc import Callable
from typing import Final

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.vehicle_motion import VehicleMotion
from estimators import wire
from estimators.attitude import AttitudeEstimate, AttitudeEstimator, AttitudeParameters, VehicleKind
from estimators.attitude.air import pressure_pa
from estimators.attitude.parameters import AirspeedSource
from estimators.attitude.samples import SAMPLES
from estimators.interface import Need, Outcome
from estimators.messages import Message, is_a
from estimators.relative_pose.belief import LevelMotion
from flightsim.foundation.atmosphere import pressure_altitude_m

_LEFT_OUT: Final = ("VFR_HUD",)  # its rate of climb is the autopilot's, and on some vehicles its airspeed
_SMOOTHING_S: Final = 0.3  # of height and heading: the messages are faster than the ranges
_FIELD_GAUSS: Final = (0.1, 1.0)  # of a plausible magnetic field


class AircraftState:
    """What is known about one aircraft.

    Attributes:
        on_motion: called with the time of each inertial sample, the time since the one before, and the motion
            in it; None: not called.
        filter: roll, pitch, biases and angle of attack.
        height_m: pressure altitude; NaN: not known.
        heading_rad: magnetic heading; NaN: not known.
        newest_us: time of the newest inertial sample; None: none yet.
        OLD_US: a newest sample that is older is not used.
    """

    OLD_US: Final = 500_000

    def __init__(self) -> None:
        self.on_motion: Callable[[int, float, LevelMotion], None] | None = None
        self.filter = AttitudeEstimator(
            AttitudeParameters(vehicle=VehicleKind.FIXED_WING, airspeed=AirspeedSource.PRESSURE)
        )
        self.reset()

    @property
    def needs(self) -> tuple[Need, ...]:
        """Messages of an aircraft."""
        return (
            Need(
                messages=("HIGHRES_IMU", "RAW_IMU", "SCALED_IMU"),
                rate_hz=20.0,
                wanted_rate_hz=50.0,
                purpose="angular rate, specific force and magnetic field",
            ),
            Need(
                messages=("SCALED_PRESSURE", "HIGHRES_IMU"),
                rate_hz=2.0,
                wanted_rate_hz=20.0,
                purpose="pressure altitude and airspeed",
            ),
            Need(messages=("HEARTBEAT",), rate_hz=0.0, purpose="whether it is armed"),
            Need(
                messages=("PARAM_VALUE",),
                rate_hz=0.0,
                purpose="the trim of the board (AHRS_TRIM_X, AHRS_TRIM_Y)",
                optional=True,
            ),
        )

    def reset(self) -> None:
        """Discard everything."""
        self.filter.reset()
        self.height_m = self.heading_rad = math.nan
        self.newest_us: int | None = None
        self._height_us = self._heading_us = 0
        self._restart()

    def _restart(self) -> None:
        self._sums, self._rates = [0.0] * 4, [0.0] * 4  # of forward, right, down and turn
        self._start_motion()

    def _start_motion(self) -> None:
        self._path_m = [0.0, 0.0, 0.0]
        self._turned_rad = self._span_s = 0.0
        self._compass_turned_rad = 0.0  # of `_turned_rad`, at the newest heading

    def take(self, time_us: int, message: Message) -> Outcome:
        """Process a message of the aircraft's autopilot."""
        name = message.name
        if message.src_component != AUTOPILOT_COMPONENT or name in _LEFT_OUT:
            return Outcome.IGNORED
        outcome = self.filter.handle(time_us, message)
        if is_a(message, wire.SCALED_PRESSURE):
            self._pressure(time_us, message.press_abs)
        elif is_a(message, wire.HIGHRES_IMU) and message.abs_pressure > 0.0:
            self._pressure(time_us, message.abs_pressure)
        if outcome is Outcome.TIME_JUMP:
            self.height_m = self.heading_rad = math.nan
            self.newest_us = None
            self._restart()
        elif outcome is Outcome.UPDATED:
            (estimate,) = self.filter.estimates
            self._integrate(time_us, message, estimate)
            self._compass(time_us, message, estimate)
            return Outcome.USED
        return outcome

    def _pressure(self, time_us: int, value: float) -> None:
        pascal = pressure_pa(value) if math.isfinite(value) else None
        if pascal is not None:
            share = _share(time_us - self._height_us, self.height_m)
            measured = pressure_altitude_m(pascal)
            self.height_m = measured if share >= 1.0 else self.height_m + share * (measured - self.height_m)
            self._height_us = time_us

    def _integrate(self, time_us: int, message: Message, e: AttitudeEstimate) -> None:
        """Add the motion since the last sample to that since the last `motion`."""
        before_us, self.newest_us = self.newest_us, time_us
        if before_us is None or not math.isfinite(e.airspeed_m_s):
            return
        dt_s = (time_us - before_us) * 1e-6
        sample = SAMPLES[message.name](message)
        q, r = sample[4] - e.gyro_bias_y_rad_s, sample[5] - e.gyro_bias_z_rad_s
        alpha = e.alpha_rad if math.isfinite(e.alpha_rad) else 0.0
        beta = e.beta_rad if math.isfinite(e.beta_rad) else 0.0
        x = e.airspeed_m_s * math.cos(alpha) * math.cos(beta)
        y = e.airspeed_m_s * math.sin(beta)
        z = e.airspeed_m_s * math.sin(alpha) * math.cos(beta)
        cr, sr = math.cos(e.roll_rad), math.sin(e.roll_rad)
        cp, sp = math.cos(e.pitch_rad), math.sin(e.pitch_rad)
        lower = sr * y + cr * z
        # the rate of the Euler yaw: e_3' R omega of equation 2 leaves out phi_dot sin(theta)
        yaw_rate = (sr * q + cr * r) / max(0.1, cp)
        motion = LevelMotion(
            forward_m_s=cp * x + sp * lower,
            right_m_s=cr * y - sr * z,
            down_m_s=-sp * x + cp * lower,
            yaw_rate_rad_s=yaw_rate,
        )
        self._rates = [motion.forward_m_s, motion.right_m_s, motion.down_m_s, yaw_rate]
        for axis, rate in enumerate(self._rates):
            self._sums[axis] += dt_s * rate
        for axis in range(3):
            self._path_m[axis] += dt_s * self._rates[axis]
        self._turned_rad += dt_s * yaw_rate
        self._span_s += dt_s
        if self.on_motion is not None:
            self.on_motion(time_us, dt_s, motion)

    def _compass(self, time_us: int, message: Message, e: AttitudeEstimate) -> None:
        if is_a(message, wire.HIGHRES_IMU):
            x, y, z = message.xmag, message.ymag, message.zmag
        elif (
            is_a(message, wire.RAW_IMU)
            or is_a(message, wire.SCALED_IMU)
            or is_a(message, wire.SCALED_IMU2)
            or is_a(message, wire.SCALED_IMU3)
        ):
            x, y, z = 1e-3 * message.xmag, 1e-3 * message.ymag, 1e-3 * message.zmag
        else:
            return
        if not _FIELD_GAUSS[0] < math.sqrt(x * x + y * y + z * z) < _FIELD_GAUSS[1]:
            return
        cr, sr = math.cos(e.roll_rad), math.sin(e.roll_rad)
        lower = sr * y + cr * z
        north = math.cos(e.pitch_rad) * x + math.sin(e.pitch_rad) * lower
        measured = math.atan2(-(cr * y - sr * z), north)
        share = _share(time_us - self._heading_us, self.heading_rad)
        # between the samples the gyro has turned it
        ahead = self.heading_rad + self._yaw_since_rad()
        self.heading_rad = (
            measured if share >= 1.0 else ahead + share * math.remainder(measured - ahead, math.tau)
        )
        self._heading_us, self._compass_turned_rad = time_us, self._turned_rad

    def _yaw_since_rad(self) -> float:
        return self._turned_rad - self._compass_turned_rad

    @property
    def moved(self) -> bool:
        """Whether there is a motion since the last call of `motion`."""
        return self._span_s > 0.0

    def report(self, *, system: int, number: int, time_us: int) -> VehicleMotion:
        """The motion so far, for another aircraft.

        Args:
            system: system id of this aircraft.
            number: of the report.
            time_us: of the newest inertial sample, by the clock of this aircraft.
        """
        forward, right, down, turn = self._sums
        return VehicleMotion(
            system=system,
            number=number,
            time_us=time_us,
            sums=(forward, right, down, turn),
            rates=(self._rates[0], self._rates[1], self._rates[2], self._rates[3]),
            heading_rad=self.heading_rad,
            height_m=self.height_m,
        )

    def motion(self, _until_us: int = 0) -> LevelMotion:
        """Mean motion since the last call, up to the newest sample, of an aircraft that has `moved`."""
        span_s, path_m, turned_rad = self._span_s, self._path_m, self._turned_rad
        since_rad = self._yaw_since_rad()
        self._start_motion()
        self._compass_turned_rad = -since_rad
        return LevelMotion(
            forward_m_s=path_m[0] / span_s,
            right_m_s=path_m[1] / span_s,
            down_m_s=path_m[2] / span_s,
            yaw_rate_rad_s=turned_rad / span_s,
        )


def _share(elapsed_us: int, known: float) -> float:
    """Weight of a new value in an average of `_SMOOTHING_S`; 1: the average starts."""
    elapsed_s = elapsed_us * 1e-6
    if not (math.isfinite(known) and 0.0 <= elapsed_s < 1.0):
        return 1.0
    return elapsed_s / (_SMOOTHING_S + elapsed_s)
