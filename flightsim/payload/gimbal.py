"""Gimbal: turns a camera, steadies it, within its limits.

Joints from the vehicle outwards: yaw, roll, pitch. A gimbal of two axes has no roll joint: its picture leans
with the vehicle, and its angles are azimuth and elevation of the line of sight (Tolman et al. 2021, section
V-C). Angles are positive to the right, up, and rolling right. Commands and flags mean what MAVLink's gimbal
protocol v2 means by them.
"""

import math
from dataclasses import dataclass
from enum import IntFlag
from typing import Any, ClassVar, Final, Literal

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import NotNegative, Positive, Rate, require_finite
from flightsim.foundation.kernels import bound
from flightsim.foundation.records import packed, record_array, the_record
from flightsim.payload import gimbal_kernel as k
from flightsim.payload.device import Carrier, Device, DeviceParameters
from flightsim.sensors.sensor import gauss_markov
from flightsim.sensors.suite import steps_per_sample

Array = NDArray[np.float64]

_DEG: Final = math.pi / 180.0
_NOISE_ROWS: Final = 256


class GimbalFlags(IntFlag):
    """The flags of MAVLink's GIMBAL_DEVICE_FLAGS that this gimbal supports.

    Roll and pitch are steadied together, by PITCH_LOCK; ROLL_LOCK alone does nothing.
    """

    NONE = 0
    RETRACT = 1
    NEUTRAL = 2
    ROLL_LOCK = 4
    PITCH_LOCK = 8
    YAW_LOCK = 16
    YAW_IN_VEHICLE_FRAME = 32
    YAW_IN_EARTH_FRAME = 64


LEVEL: Final = GimbalFlags.ROLL_LOCK | GimbalFlags.PITCH_LOCK
"""Horizon held, yaw follows the vehicle: what most gimbals do by default."""

_KNOWN: Final = sum(GimbalFlags)


@dataclass(frozen=True, slots=True, kw_only=True)
class GimbalParameters(DeviceParameters):
    """A small brushless three-axis gimbal; `GimbalParameters.two_axis()` is a pan-tilt turret.

    Attributes:
        axes: 3 (yaw, roll, pitch) or 2 (yaw, pitch).
        rate_hz: control steps per second.
        time_constant_s: of the approach to a new command.
        max_rate_rad_s: of each joint.
        roll_limit_rad: either way.
        pitch_min_rad, pitch_max_rad: of the pitch joint; -pi/2 is straight down.
        yaw_limit_rad: either way; pi: turns without end.
        jitter_rad: one sigma per joint of what steadying leaves.
        encoder_noise_rad: one sigma per joint of the angles it reports.
        attitude_noise_rad: white, one sigma per axis of the attitude it reports.
        tilt_error_rad, heading_error_rad: stationary one sigma of the Gauss-Markov error of its own attitude
            reference. It steadies by it, so it points wrong by as much without noticing.
        error_time_constant_s: of that error.
        gyro_noise_rad_s: white, per sample.
    """

    can_fail: ClassVar[bool] = False

    axes: int = 3
    rate_hz: Rate = 50
    time_constant_s: Positive = 0.08
    max_rate_rad_s: Positive = 120.0 * _DEG
    roll_limit_rad: NotNegative = 45.0 * _DEG
    pitch_min_rad: float = -110.0 * _DEG
    pitch_max_rad: float = 30.0 * _DEG
    yaw_limit_rad: Positive = math.pi
    jitter_rad: NotNegative = 0.02 * _DEG
    encoder_noise_rad: NotNegative = 0.05 * _DEG
    attitude_noise_rad: NotNegative = 0.03 * _DEG
    tilt_error_rad: NotNegative = 0.15 * _DEG
    heading_error_rad: NotNegative = 1.0 * _DEG
    error_time_constant_s: Positive = 60.0
    gyro_noise_rad_s: NotNegative = 0.1 * _DEG

    def check_together(self) -> None:
        if self.axes not in (2, 3):
            raise ValueError(f"axes = {self.axes!r} is not accepted: 2 or 3 is")
        if not self.roll_limit_rad < 0.5 * math.pi:
            raise ValueError(f"roll_limit_rad = {self.roll_limit_rad} is not accepted: less than pi/2 is")
        lowest = -0.5 * math.pi if self.axes == 2 else -math.pi
        if not lowest - 1e-9 <= self.pitch_min_rad < self.pitch_max_rad <= 0.5 * math.pi + 1e-9:
            raise ValueError(
                f"pitch_min_rad, pitch_max_rad = {self.pitch_min_rad}, {self.pitch_max_rad} "
                f"are not accepted: rising, from {lowest:.4f} to pi/2, is"
            )

    def build(self, carrier: Carrier) -> "Gimbal":
        return Gimbal(
            self, truth=carrier.truth, physics_rate_hz=carrier.physics_rate_hz, seed=carrier.seeds("gimbal")
        )

    @classmethod
    def two_axis(cls, **overrides: Any) -> "GimbalParameters":
        """A belly turret: all round, from a little over the horizon to straight down."""
        numbers: dict[str, Any] = {"axes": 2, "pitch_min_rad": -0.5 * math.pi, "pitch_max_rad": 10.0 * _DEG}
        return cls(**(numbers | overrides))


class Gimbal(Device[Literal[True]]):
    """One gimbal on one vehicle.

    Attributes (arrays, written in place by every control step):
        parameters: as given.
        joints_rad: (3,) true joint angles roll, pitch, yaw.
        q_frd_from_gimbal, q_ned_from_gimbal: (4,) true attitude in the body and in the local frame.
        rates_gimbal_rad_s: (3,) true angular velocity against inertial space, gimbal frame.
        measured_joints_rad: (3,) roll, pitch, yaw by the encoders.
        measured_q_ned_from_gimbal: (4,) by its own attitude reference, yaw from north.
        measured_q_heading_from_gimbal: (4,) the same with yaw from the vehicle's nose: roll and pitch against
            the horizon (GIMBAL_DEVICE_ATTITUDE_STATUS with YAW_IN_VEHICLE_FRAME).
        measured_rates_rad_s: (3,) by its gyros, gimbal frame.
        time_us: of the last control step; -1 before the first.
        flags: of the command in force.
    """

    def __init__(
        self,
        parameters: GimbalParameters | None = None,
        *,
        truth: Array,
        physics_rate_hz: int,
        seed: np.random.SeedSequence,
    ) -> None:
        """A gimbal at rest with its joints at zero, holding the horizon, looking forward.

        Args:
            parameters: the gimbal.
            truth: the vehicle's truth vector, read on each control step.
            physics_rate_hz: calls of `step` per second.
            seed: its random stream.

        Raises:
            ValueError: the rate doesn't divide the physics rate.
        """
        p = self.parameters = parameters or GimbalParameters()
        self._interval_steps = steps_per_sample(p.rate_hz, physics_rate_hz)
        self._countdown = 0
        self._truth = truth
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._block: Array = np.empty((_NOISE_ROWS, k.NORMALS))
        self._row = _NOISE_ROWS
        self._euler: Array = np.zeros(3)
        interval_s = 1.0 / p.rate_hz
        decay, unit_drive = gauss_markov(1.0, p.error_time_constant_s, interval_s)
        sigma = np.array([p.tilt_error_rad, p.tilt_error_rad, p.heading_error_rad])
        constants = k.GimbalConstants(
            interval_s=interval_s,
            gain=1.0 - math.exp(-interval_s / p.time_constant_s),
            axes=p.axes,
            low=np.array([-p.roll_limit_rad, p.pitch_min_rad, -p.yaw_limit_rad]),
            high=np.array([p.roll_limit_rad, p.pitch_max_rad, p.yaw_limit_rad]),
            endless=p.yaw_limit_rad >= math.pi,
            max_step=p.max_rate_rad_s * interval_s,
            jitter=p.jitter_rad,
            encoder=p.encoder_noise_rad,
            attitude_noise=p.attitude_noise_rad,
            gyro_noise=p.gyro_noise_rad_s,
            decay=decay,
            drive=unit_drive * sigma,
        )
        states, outputs = record_array(k.GimbalState), record_array(k.GimbalOutput)
        state = self._state = the_record(states, k.GimbalState)
        state.error[:] = sigma * self._rng.standard_normal(3)
        state.body[0] = 1.0
        out = self._out = the_record(outputs, k.GimbalOutput)
        self.joints_rad: Array = out.joints
        self.q_frd_from_gimbal: Array = out.q_frd_from_gimbal
        self.q_ned_from_gimbal: Array = out.q_ned_from_gimbal
        self.rates_gimbal_rad_s: Array = out.rates
        self.measured_joints_rad: Array = out.measured_joints
        self.measured_q_ned_from_gimbal: Array = out.measured_q_ned
        self.measured_q_heading_from_gimbal: Array = out.measured_q_heading
        self.measured_rates_rad_s: Array = out.measured_rates
        for q in (out.q_frd_from_gimbal, out.q_ned_from_gimbal, out.measured_q_ned, out.measured_q_heading):
            q[0] = 1.0
        self._advance = bound(k.advance, truth, packed(constants), states, self._block, outputs, then=(0,))
        self.time_us = -1
        self.flags = LEVEL
        self.command(LEVEL)

    @property
    def retracted(self) -> bool:
        """Put away by RETRACT: a camera on it sees nothing."""
        return bool(self.flags & GimbalFlags.RETRACT)

    @property
    def limits_reached(self) -> tuple[bool, bool, bool]:
        """Whether the command in force lies beyond the limits: roll, pitch, yaw."""
        roll, pitch, yaw = self._out.at_limit.tolist()
        return bool(roll), bool(pitch), bool(yaw)

    def command(
        self,
        flags: GimbalFlags | int = LEVEL,
        *,
        roll_rad: float = 0.0,
        pitch_rad: float = 0.0,
        yaw_rad: float = 0.0,
        pitch_rate_rad_s: float = math.nan,
        yaw_rate_rad_s: float = math.nan,
    ) -> None:
        """Point the camera; acts from the next control step on.

        With PITCH_LOCK roll and pitch are held against the horizon, else against the vehicle. With YAW_LOCK
        yaw is held against north, else against the vehicle's nose. YAW_IN_VEHICLE_FRAME and
        YAW_IN_EARTH_FRAME select the frame of `yaw_rad`; without them YAW_LOCK selects it. NEUTRAL moves to
        the middle of all joints, RETRACT retracts the camera; the other arguments are then ignored.

        Args:
            flags: `GimbalFlags`.
            roll_rad: of the horizon in the picture.
            pitch_rad, yaw_rad: direction; NaN: that of the active command.
            pitch_rate_rad_s, yaw_rate_rad_s: keep turning at this rate; NaN: no rate.

        Raises:
            ValueError: unknown or contradictory flags, or numbers out of range.
        """
        value = int(flags)
        if value & ~_KNOWN:
            raise ValueError(
                f"gimbal flags {value} are not accepted: sums of {[f.value for f in GimbalFlags]} are"
            )
        flags = GimbalFlags(value)
        both = GimbalFlags.YAW_IN_VEHICLE_FRAME | GimbalFlags.YAW_IN_EARTH_FRAME
        if flags & both == both:
            raise ValueError("gimbal yaw is in the vehicle's frame or in the earth's, not in both")
        require_finite(roll_rad=roll_rad)
        for name, angle in (("pitch_rad", pitch_rad), ("yaw_rad", yaw_rad)):
            if math.isinf(angle):
                raise ValueError(f"{name} = {angle} is not accepted: a finite angle or NaN is")
        limit = self.parameters.max_rate_rad_s
        rates = []
        for name, rate in (("pitch_rate_rad_s", pitch_rate_rad_s), ("yaw_rate_rad_s", yaw_rate_rad_s)):
            if math.isinf(rate):
                raise ValueError(f"{name} = {rate} is not accepted: a finite rate or NaN is")
            rates.append(0.0 if math.isnan(rate) else min(limit, max(-limit, rate)))

        state = self._state
        locked = bool(flags & GimbalFlags.YAW_LOCK)
        given_in_earth = bool(flags & GimbalFlags.YAW_IN_EARTH_FRAME) or (
            locked and not flags & GimbalFlags.YAW_IN_VEHICLE_FRAME
        )
        # By its own reference, as it can only know that one.
        k.body_euler(self._truth, state.error, self._euler)
        heading_rad = float(self._euler[2])
        if math.isnan(yaw_rad):
            yaw_rad = float(state.commanded[2])
            given_in_earth = bool(state.yaw_locked)
        if math.isnan(pitch_rad):
            pitch_rad = float(state.commanded[1])
        if given_in_earth and not locked:
            yaw_rad -= heading_rad
        elif locked and not given_in_earth:
            yaw_rad += heading_rad
        state.commanded[:] = (roll_rad, pitch_rad, yaw_rad)
        state.pitch_rate, state.yaw_rate = rates
        state.levelled = float(bool(flags & GimbalFlags.PITCH_LOCK))
        state.yaw_locked = float(locked)
        state.parked = float(bool(flags & (GimbalFlags.NEUTRAL | GimbalFlags.RETRACT)))
        self.flags = flags

    def step(self, time_us: int) -> Literal[True] | None:
        """One physics step; True when it was a control step and the arrays are new."""
        if self._countdown:
            self._countdown -= 1
            return None
        self._countdown = self._interval_steps - 1
        if self._row == _NOISE_ROWS:
            self._rng.standard_normal(out=self._block)
            self._row = 0
        self._advance(self._row)
        self._row += 1
        self.time_us = time_us
        return True
