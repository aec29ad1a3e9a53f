"""Roll and pitch from inertial messages and airspeed (Tolman et al. 2021, section II)."""

from collections.abc import Callable, Mapping, Sequence
from math import asin, atan2, nan, sqrt
from struct import Struct
from typing import Any, ClassVar, Final

import numpy as np

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators import wire
from estimators.attitude import layout as at
from estimators.attitude.air import AirData
from estimators.attitude.estimate import AttitudeEstimate
from estimators.attitude.forms import FORM_NAMES, FORM_OF_KIND, FORM_OF_TYPE
from estimators.attitude.parameters import (
    AirspeedSource,
    AttitudeParameters,
    ImuSource,
    VehicleKind,
    coefficients,
)
from estimators.attitude.samples import DIFFERENTIAL_PRESSURE, INERTIAL_FIELDS, SAMPLES, BoardTrim
from estimators.attitude.step import start, step
from estimators.input_guard import InputGuard
from estimators.interface import Estimator, Need, Outcome
from estimators.messages import Message, on

LEAST_RATE_HZ: Final = 20.0
WANTED_RATE_HZ: Final = 50.0
_SLOWEST_US: Final = int(1e6 / (0.9 * LEAST_RATE_HZ))
_GONE_US: Final = 4 * _SLOWEST_US
_write_sample: Final = Struct(at.SAMPLE_FORMAT).pack_into
_IMU_NAMES: Final = tuple(SAMPLES)
_AIRSPEED_NAMES: Final = ("VFR_HUD", "AIRSPEED", "SCALED_PRESSURE")


class AttitudeEstimator(Estimator[AttitudeParameters]):
    """Complementary filter for roll and pitch; docs/attitude.md has its equations.

    If the parameters specify no vehicle kind, it waits for the autopilot's HEARTBEAT. Yaw is not estimated.
    """

    NAME: ClassVar[str] = "attitude"
    PARAMETERS: ClassVar[type[Any]] = AttitudeParameters

    def __init__(self, parameters: AttitudeParameters | None = None) -> None:
        super().__init__(parameters)
        p = self.parameters
        self._coefficients = coefficients(p)
        self._state = np.empty(at.STATE_SIZE)
        self._sample = self._state.data
        self._gap_max_us = round(p.gap_max_s * 1e6)
        self._guard = InputGuard(max_gap_us=self._gap_max_us)
        self._instance = p.imu_instance
        self._trim = BoardTrim(p)  # a vehicle keeps its parameters when it reboots
        self._airspeed_age_us = round(p.airspeed_age_max_s * 1e6)
        self._air = AirData(p.airspeed, self._airspeed_age_us)
        self._handlers: dict[str, Callable[[int, Message], Outcome]] = {
            **on(wire.HEARTBEAT, self._heartbeat),
            **on(wire.VFR_HUD, self._vfr_hud),
            **on(wire.AIRSPEED, self._airspeed),
            **on(wire.SCALED_PRESSURE, self._scaled_pressure),
            **on(wire.PARAM_VALUE, self._param_value),
        }
        wanted = _IMU_NAMES if p.imu is ImuSource.AUTO else (p.imu.value,)
        inertial = {**on(wire.HIGHRES_IMU, self._highres_imu), **on(wire.RAW_IMU, self._raw_imu)}
        for name in wanted:
            self._handlers[name] = inertial.get(name, self._imu)
        self.reset()

    @property
    def needs(self) -> tuple[Need, ...]:
        p = self.parameters
        inertial = Need(
            messages=_IMU_NAMES if p.imu is ImuSource.AUTO else (p.imu.value,),
            rate_hz=LEAST_RATE_HZ,
            wanted_rate_hz=WANTED_RATE_HZ,
            purpose="angular rate and specific force",
        )
        heartbeat = Need(
            messages=("HEARTBEAT",),
            rate_hz=0.0,
            purpose="the kind of vehicle" if p.vehicle is VehicleKind.AUTO else "whether it is armed",
            optional=p.vehicle is not VehicleKind.AUTO,
        )
        air = Need(
            messages=_AIRSPEED_NAMES,
            rate_hz=1.0,
            wanted_rate_hz=10.0,
            purpose="airspeed, rate of climb and throttle of a fixed wing",
            optional=p.vehicle is not VehicleKind.FIXED_WING,
        )
        trim = Need(
            messages=("PARAM_VALUE",),
            rate_hz=0.0,
            purpose="the trim of the board (AHRS_TRIM_X, AHRS_TRIM_Y)",
            optional=True,
        )
        return inertial, heartbeat, air, trim

    def handle(self, time_us: int, message: Message) -> Outcome:
        # Other components may have their own inertial sensors.
        handler = self._handlers.get(message.name) if message.src_component == AUTOPILOT_COMPONENT else None
        return Outcome.IGNORED if handler is None else handler(time_us, message)

    def reset(self) -> None:
        self._guard.reset()
        self._air.reset()
        kind = self.parameters.vehicle
        self._form: int | None = FORM_OF_KIND.get(kind)
        self._disarmed = False  # assumed until a message reports disarmed
        self._subject = 0
        self._restart()
        self._imu_name = ""
        self._imu_received_us: dict[str, int] = {}

    def _restart(self) -> None:
        """Restart the filter; the knowledge of the vehicle and the air is kept."""
        start(self._state, self._coefficients)
        self._time_us: int | None = None
        self._airspeed_until_us = -1

    @property
    def estimates(self) -> Sequence[AttitudeEstimate]:
        if self._time_us is None:
            return ()
        x = self._state.tolist()
        down_x, down_y, down_z = x[at.DOWN], x[at.DOWN + 1], x[at.DOWN + 2]
        winged = self._form == at.WING and x[at.AIRSPEED] >= self.parameters.airspeed_min_m_s
        vx, vy, vz = x[at.VELOCITY], x[at.VELOCITY + 1], x[at.VELOCITY + 2]
        speed = sqrt(vx * vx + vy * vy + vz * vz)
        return (
            AttitudeEstimate(
                time_us=self._time_us,
                subject=self._subject,
                roll_rad=atan2(down_y, down_z),
                pitch_rad=-asin(max(-1.0, min(1.0, down_x))),
                roll_variance_rad2=x[at.ROLL_COVARIANCE],
                pitch_variance_rad2=x[at.PITCH_COVARIANCE],
                gyro_bias_x_rad_s=x[at.GYRO_BIAS],
                gyro_bias_y_rad_s=x[at.GYRO_BIAS + 1],
                gyro_bias_z_rad_s=x[at.GYRO_BIAS + 2],
                alpha_rad=x[at.ALPHA] if winged else nan,
                beta_rad=x[at.BETA] if winged else nan,
                airspeed_m_s=speed if speed > 0.0 else nan,
                weight=x[at.WEIGHT],
            ),
        )

    def publish(self) -> Sequence[MAVLinkMessage]:
        """ATTITUDE, with NaN as yaw, because yaw is not estimated."""
        if self._time_us is None:
            return ()
        (estimate,) = self.estimates
        x = self._state.tolist()
        message = dialect.MAVLink_attitude_message(
            self._time_us // 1000 % (1 << 32),
            estimate.roll_rad,
            estimate.pitch_rad,
            nan,
            x[at.RATE] - x[at.GYRO_BIAS],
            x[at.RATE + 1] - x[at.GYRO_BIAS + 1],
            x[at.RATE + 2] - x[at.GYRO_BIAS + 2],
        )
        return (message,)

    def remarks(self) -> Mapping[str, float | str]:
        x = self._state
        remarks: dict[str, float | str] = {
            "form": "unknown" if self._form is None else FORM_NAMES[self._form],
            "imu": self._imu_name or "none",
            "gyro_bias_rad_s": float(np.linalg.norm(x[at.GYRO_BIAS : at.GYRO_BIAS + 3])),
        }
        if self._trim.active:
            remarks["note"] = self._trim.text
        if self._form == at.ROTOR:
            remarks["drag_1_s"] = float(x[at.DRAG])
        elif self._form == at.WING and x[at.LIFT] > 0.0:
            remarks["lift_1_m"] = float(x[at.LIFT])
            remarks["alpha_mean_rad"] = float(x[at.ALPHA_MEAN])
        return remarks

    # Slow messages

    def _heartbeat(self, time_us: int, message: wire.HEARTBEAT) -> Outcome:
        form = FORM_OF_TYPE.get(message.type)
        if form is None:
            return Outcome.IGNORED
        if self.parameters.vehicle is VehicleKind.AUTO:
            self._form = form
        self._disarmed = not message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED
        return Outcome.USED

    def _param_value(self, time_us: int, message: wire.PARAM_VALUE) -> Outcome:
        return Outcome.USED if self._trim.learn(message.param_id, message.param_value) else Outcome.IGNORED

    def _vfr_hud(self, time_us: int, message: wire.VFR_HUD) -> Outcome:
        refused = self._guard.check(
            time_us, "VFR_HUD", (message.airspeed, message.climb, message.throttle), leads=False
        )
        if refused is Outcome.TIME_JUMP:
            self._forget()
        elif refused is not None:
            return refused
        self._state[at.CLIMB] = message.climb
        self._state[at.THROTTLE] = 0.01 * min(100, message.throttle)
        self._use_airspeed(time_us, self._air.airspeed(time_us, AirspeedSource.VFR_HUD, message.airspeed))
        return Outcome.USED if refused is None else refused

    def _airspeed(self, time_us: int, message: wire.AIRSPEED) -> Outcome:
        if message.id != 0:
            return Outcome.IGNORED
        refused = self._guard.check(time_us, "AIRSPEED", (message.airspeed,), leads=False)
        if refused is Outcome.TIME_JUMP:
            self._forget()
        elif refused is not None:
            return refused
        self._use_airspeed(time_us, self._air.airspeed(time_us, AirspeedSource.AIRSPEED, message.airspeed))
        return Outcome.USED if refused is None else refused

    def _scaled_pressure(self, time_us: int, message: wire.SCALED_PRESSURE) -> Outcome:
        refused = self._guard.check(
            time_us, "SCALED_PRESSURE", (message.press_abs, message.press_diff), leads=False
        )
        if refused is Outcome.TIME_JUMP:
            self._forget()
        elif refused is not None:
            return refused
        self._air.static_pressure(message.press_abs)
        self._use_airspeed(time_us, self._air.by_pressure(time_us, message.press_abs, message.press_diff))
        return Outcome.USED if refused is None else refused

    def _use_airspeed(self, time_us: int, airspeed_m_s: float | None) -> None:
        if airspeed_m_s is not None:
            self._state[at.AIRSPEED] = airspeed_m_s
            self._state[at.AIRSPEED_FRESH] = 1.0
            self._airspeed_until_us = time_us + self._airspeed_age_us

    def _forget(self) -> None:
        """Time went back: the vehicle has rebooted. The guard has already accepted the current message."""
        self._air.reset()
        self._restart()

    # Inertial messages

    def _highres_imu(self, time_us: int, message: wire.HIGHRES_IMU) -> Outcome:
        updated = message.fields_updated  # a sender that marks no field as updated is assumed to update all
        if message.id != self._instance or (updated & INERTIAL_FIELDS != INERTIAL_FIELDS and updated):
            return Outcome.IGNORED
        if updated & DIFFERENTIAL_PRESSURE and message.diff_pressure > 0.0:
            airspeed_m_s = self._air.by_pressure(time_us, message.abs_pressure, message.diff_pressure)
            self._use_airspeed(time_us, airspeed_m_s)
        return self._imu(time_us, message)

    def _raw_imu(self, time_us: int, message: wire.RAW_IMU) -> Outcome:
        if message.id != self._instance:
            return Outcome.IGNORED
        return self._imu(time_us, message)

    def _imu(self, time_us: int, message: Message) -> Outcome:
        name = message.name
        if name != self._imu_name and not self._chosen(time_us, name):
            return Outcome.IGNORED
        sample = SAMPLES[name](message)
        if self._trim.active:
            sample = self._trim.turned(sample)
        refused = self._guard.check(time_us, name, sample)
        if refused is not None:
            if refused is not Outcome.TIME_JUMP:
                return refused
            self._restart()
        if self._form is None:
            return Outcome.WAITING
        before_us = self._time_us
        if before_us is None:
            elapsed_s = 0.0
            self._subject = message.src_system
        elif time_us <= before_us:
            return Outcome.LATE if time_us < before_us else Outcome.REPEATED
        elif time_us - before_us > self._gap_max_us:  # samples received since were not usable
            self._restart()
            refused, elapsed_s = Outcome.TIME_JUMP, 0.0
        else:
            elapsed_s = (time_us - before_us) * 1e-6
        state = self._state
        if time_us > self._airspeed_until_us:
            state[at.AIRSPEED] = nan
        _write_sample(self._sample, 0, self._form, self._disarmed, elapsed_s, *sample)
        if not step(state, self._coefficients):
            return Outcome.IMPLAUSIBLE
        self._time_us = time_us
        return Outcome.UPDATED if refused is None else refused

    def _chosen(self, time_us: int, name: str) -> bool:
        """Whether to change to this message: it is better and fast enough, or the one in use has stopped."""
        last_us = self._imu_received_us.get(name)
        self._imu_received_us[name] = time_us
        if self._imu_name and self._time_us is not None:
            gone = time_us - self._time_us > _GONE_US
            better = _IMU_NAMES.index(name) < _IMU_NAMES.index(self._imu_name)
            fast = last_us is not None and 0 < time_us - last_us <= _SLOWEST_US
            if not (gone or (better and fast)):
                return False
        self._imu_name = name
        return True
