"""External odometry in the filter: start of its use, fusion, refusal, jumps, and end of its use.

The rules follow PX4's EKF2. Without GPS the position is the sender's. While GPS is fused the sender's origin
is followed, and its positions count from it once GPS is lost. In addition to EKF2's rules, odometry whose
motion contradicts the vehicle's motion is not taken into use, and values that repeat exactly in flight are
refused.
"""

import math
from collections import deque
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import external as external
from autopilot_bridge.navigation import external_fusion as e
from autopilot_bridge.navigation.aiding_parts import AidingParts
from autopilot_bridge.navigation.delayed_fusion import body_axis_in_ned
from autopilot_bridge.navigation.external_heading import ExternalHeading
from autopilot_bridge.navigation.external_parameters import ExternalParameters
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.solution import UNKNOWN_VELOCITY_M_S
from autopilot_bridge.navigation.states import GYRO, X_GYRO_BIAS
from flightsim.foundation.vectors import yaw_of

Array = NDArray[np.float64]

_QUEUE: Final = 8  # between two updates at 25 Hz: senders of up to 200 Hz
_GPS_FRESH_US: Final = 1_000_000
_FROZEN_SAMPLES: Final = 10
_COHERENT_SAMPLES: Final = 5
_COHERENT_GAP_US: Final = 500_000
_COHERENT_M: Final = 0.5  # and 4 standard deviations
_MAX_POSITION_M: Final = 1e5
_MAX_SPEED_M_S: Final = 200.0
_OFFSET_SMOOTHING: Final = 0.05


class ExternalAiding:
    """Queues samples and fuses them at the filter's updates.

    Attributes:
        counts: what became of the samples.
        heading: theirs.
    """

    def __init__(self, parameters: ExternalParameters, parts: AidingParts) -> None:
        self._parameters = parameters
        self._solution, self._health, self._clocks = parts.solution, parts.health, parts.clocks
        self._standby = parts.standby
        self._queue: deque[external.ExternalSample] = deque(maxlen=_QUEUE)
        self._obs: Array = np.zeros(e.EXT_SIZE)
        self._offset: Array = np.zeros(3)
        self._mapped: Array = np.zeros(3)
        self._gap: Array = np.zeros(3)
        self.counts = external.ExternalCounts()
        self.heading = ExternalHeading(solution=parts.solution, health=parts.health, obs=self._obs)
        self.restart()

    def restart(self) -> None:
        """The filter aligns again: forget the sender's state."""
        self._queue.clear()
        self._last = b""
        self._equal = self._coherent = 0
        self._gap_us = self._fused_us = self._refused_since_us = self._reset_counter = -1
        self._offset[:] = 0.0
        self._place_known = self._height_known = self._offset_by_gps = False
        self.heading.restart()

    def set_parameters(self, parameters: ExternalParameters) -> None:
        """New tuning for the samples to come."""
        self._parameters = parameters

    def take(self, sample: external.ExternalSample) -> None:
        """A sample for the next update; the oldest waiting one gives way."""
        self.counts.taken += 1
        if len(self._queue) == _QUEUE:
            self.counts.flooded += 1
        self._queue.append(sample)

    @property
    def in_use(self) -> bool:
        """It aids the horizontal position or velocity."""
        return self._fused_us >= 0

    def update(self, time_us: int, *, at_rest: bool) -> bool:
        """Fuse what waits; False when the estimate has become unsound."""
        parameters = self._parameters
        sound = True
        while self._queue:
            sample = self._queue.popleft()
            if parameters.any:
                sound = self._fuse(sample, time_us, at_rest=at_rest) and sound
        if self._fused_us >= 0 and time_us - self._fused_us > parameters.timeout_s * 1e6:
            self._fused_us = -1
        self.heading.watch(parameters, time_us)
        return sound

    def report(self, health: NavigationHealth, *, on_earth: bool) -> None:
        """Write its part of the filter's health.

        Args:
            on_earth: the filter's origin is known.
        """
        health.external_in_use = self.in_use
        health.external_yaw_in_use = self.heading.in_use
        if not self.in_use:
            return
        health.dead_reckoning = False
        if on_earth and health.position_horizontal_relative:
            health.position_horizontal_absolute = True
            health.predicted_position_horizontal_absolute = True
        if not health.gps_in_use:
            health.gps_glitch = False
            health.position_horizontal_test_ratio = float(self._obs[e.EXT_RATIO_POS])
            health.velocity_test_ratio = float(self._obs[e.EXT_RATIO_VEL])

    def _fuse(self, sample: external.ExternalSample, time_us: int, *, at_rest: bool) -> bool:
        p, solution, counts = self._parameters, self._solution, self.counts
        if sample.quality < p.least_quality:
            counts.poor += 1
            return True
        values = sample.values
        has_position, has_velocity, yaw_rad = _usable(values)
        if not (has_position or has_velocity or math.isfinite(yaw_rad)):
            counts.not_finite += 1
            return True
        if self._repeats_itself(values) and not at_rest:
            counts.frozen += 1
            return True
        measured_us = sample.time_us - round(p.delay_s * 1e6)
        row = solution.row_at(measured_us, time_us)
        if row < 0:
            counts.late += 1
            return True
        jumped = has_position and self._reset_counter not in (-1, sample.reset_counter)
        if has_position:  # a sender of speeds only has a separate counter
            self._reset_counter = sample.reset_counter
        has, turned = 0, False
        if p.use_yaw and math.isfinite(yaw_rad):
            placed = has_position and self._coherent >= _COHERENT_SAMPLES
            has, turned = self.heading.take(p, sample, yaw_rad, row, time_us, jumped=jumped, placed=placed)
        turn = self.heading.turn_to_ned(sample, yaw_rad, row)
        if has_position and math.isfinite(turn):
            self._map_position(values, turn, row)
            self._judge_coherence(measured_us, row, restart=jumped or turned)
            has |= self._prepare_position(sample, row, time_us, jumped=jumped or turned)
        if p.use_velocity and has_velocity and (self._begun or not p.use_position):
            has |= self._prepare_velocity(sample, turn, row, time_us)
        if not has:
            counts.incoherent += 1
            return True
        obs = self._obs
        obs[e.EXT_DELAY_S] = max(0, time_us - measured_us) * 1e-6
        obs[e.EXT_GATE_POS : e.EXT_GATE_YAW + 1] = (p.position_gate, p.velocity_gate, p.yaw_gate)
        accepted = e.fuse_external(solution.p, solution.core, solution.history, solution.work, obs, has, row)
        self._note(has, accepted, time_us)
        return not accepted & e.EXT_UNSOUND

    @property
    def _begun(self) -> bool:
        return self.in_use or self._coherent >= _COHERENT_SAMPLES

    def _repeats_itself(self, values: Array) -> bool:
        received = values.tobytes()
        self._equal = self._equal + 1 if received == self._last else 0
        self._last = received
        return self._equal >= _FROZEN_SAMPLES

    # position

    def _map_position(self, values: Array, turn_rad: float, row: int) -> None:
        """The vehicle's position as the sample gives it, in the filter's axes."""
        p = self._parameters
        x, y, z = (p.scale * float(part) for part in values[external.POSITION_M])
        self._mapped[:] = _turned(x, y, z, turn_rad)
        if any(p.offset_frd_m):
            self._mapped -= self._rotation(row) @ np.array(p.offset_frd_m)

    def _judge_coherence(self, measured_us: int, row: int, *, restart: bool) -> None:
        """Count samples whose motion since the sample before agrees with the filter's."""
        gap = self._solution.past_position(row) - self._mapped
        allowed = _COHERENT_M + 4.0 * self._parameters.position_noise_m
        steady = self._gap_us >= 0 and abs(measured_us - self._gap_us) <= _COHERENT_GAP_US
        moved = math.dist(gap.tolist(), self._gap.tolist())
        self._coherent = self._coherent + 1 if steady and not restart and moved <= allowed else 0
        self._gap[:] = gap
        self._gap_us = measured_us

    def _prepare_position(
        self, sample: external.ExternalSample, row: int, time_us: int, *, jumped: bool
    ) -> int:
        """Which parts of the position to fuse, after the jumps that go before it."""
        p, obs, gap = self._parameters, self._obs, self._gap
        coherent = self._coherent >= _COHERENT_SAMPLES or (jumped and self.in_use)
        lost = coherent and self._refused_since_us >= 0
        lost = lost and time_us - self._refused_since_us > p.reset_after_s * 1e6
        has = 0
        if p.use_position:
            has = self._prepare_place(gap, time_us, coherent=coherent, jumped=jumped, lost=lost)
        if p.use_height and (coherent or self.in_use):
            if not self._height_known or jumped or lost:
                self._begin_height(float(gap[2]))
            has |= e.EXT_HAS_HEIGHT
        for i in range(3):
            obs[e.EXT_POS + i] = self._mapped[i] + self._offset[i]
            obs[e.EXT_POS_VAR + i] = external.variance_of(
                sample.position_variance_m2[i], p.position_noise_m, own=p.own_noise
            )
        return has

    def _prepare_place(self, gap: Array, time_us: int, *, coherent: bool, jumped: bool, lost: bool) -> int:
        clocks = self._clocks
        if clocks.gps_us >= 0 and time_us - clocks.gps_us < _GPS_FRESH_US:
            share = _OFFSET_SMOOTHING if self._offset_by_gps and not jumped else 1.0
            self._offset[0:2] += share * (gap[0:2] - self._offset[0:2])
            self._place_known = self._offset_by_gps = True
            return 0
        aided = clocks.horizontal_aid_us >= 0 and not self._standby.held
        if self._place_known and aided and not jumped and not lost:
            return e.EXT_HAS_POS
        if not coherent:
            return e.EXT_HAS_POS if self._place_known and aided else 0
        if jumped and self._offset_by_gps:
            self._offset[0:2] = gap[0:2]  # its origin has moved; where the vehicle is on Earth is known
        self._place_known = True
        self._go_to(float(self._offset[0] - gap[0]), float(self._offset[1] - gap[1]), time_us)
        return e.EXT_HAS_POS

    def _go_to(self, north_m: float, east_m: float, time_us: int) -> None:
        """The horizontal position jumps to the sender's."""
        solution, health = self._solution, self._health
        solution.move_horizontally(north_m, east_m)
        solution.change_velocity(0.0, 0.0, sigma_m_s=UNKNOWN_VELOCITY_M_S)
        self._standby.release()
        self._clocks.horizontal_aid_us = time_us
        self._refused_since_us = -1
        self.counts.resets += 1
        health.position_resets += 1
        health.position_reset_ne_m = (north_m, east_m)

    def _begin_height(self, gap_m: float) -> None:
        """Heights begin, or have jumped: the estimate goes to the sender's, or theirs count from it."""
        self._height_known = True
        if not self._parameters.height_reference:
            self._offset[2] = gap_m
            return
        self._offset[2] = 0.0
        self._solution.move_vertically(-gap_m, with_baro=True)
        self._health.height_resets += 1
        self._health.height_reset_down_m = -gap_m

    # velocity

    def _prepare_velocity(
        self, sample: external.ExternalSample, turn_rad: float, row: int, time_us: int
    ) -> int:
        p, obs, solution = self._parameters, self._obs, self._solution
        velocity: Array = sample.values[external.VELOCITY_M_S] * p.scale
        if sample.velocity_frame is external.ExternalFrame.BODY_FRD:
            velocity = self._rotation(row) @ velocity
        elif sample.velocity_frame is external.ExternalFrame.LOCAL_FRD:
            if not math.isfinite(turn_rad):
                return 0
            x, y, z = velocity.tolist()
            velocity = np.array(_turned(x, y, z, turn_rad))
        if any(p.offset_frd_m):
            core = solution.core
            rates = core[GYRO : GYRO + 3] - core[X_GYRO_BIAS : X_GYRO_BIAS + 3]
            velocity = velocity - self._rotation(row) @ np.cross(rates, p.offset_frd_m)
        obs[e.EXT_VEL : e.EXT_VEL + 3] = velocity
        for i in range(3):
            obs[e.EXT_VEL_VAR + i] = external.variance_of(
                sample.velocity_variance_m2_s2[i], p.velocity_noise_m_s, own=p.own_noise
            )
        if self._clocks.horizontal_aid_us < 0 or self._standby.held:
            change = velocity - solution.past_velocity(row)  # nothing is known of the present one
            north, east = float(change[0]), float(change[1])
            solution.change_velocity(north, east, sigma_m_s=UNKNOWN_VELOCITY_M_S)
            self._standby.release()
            self._clocks.horizontal_aid_us = time_us
        return e.EXT_HAS_VEL

    def _note(self, has: int, accepted: int, time_us: int) -> None:
        """What came of the parts that were to be fused."""
        clocks = self._clocks
        if accepted & ~e.EXT_UNSOUND:
            self.counts.fused += 1
        else:
            self.counts.refused += 1
        if has & e.EXT_HAS_YAW:
            self.heading.note(bool(accepted & e.EXT_HAS_YAW), time_us)
        if accepted & e.EXT_HAS_HEIGHT:
            clocks.height_us = time_us
        if accepted & (e.EXT_HAS_POS | e.EXT_HAS_VEL):
            clocks.horizontal_aid_us = self._fused_us = time_us
        placed = e.EXT_HAS_POS | e.EXT_HAS_HEIGHT
        if accepted & placed == has & placed:
            self._refused_since_us = -1
        elif self._refused_since_us < 0:
            self._refused_since_us = time_us

    def _rotation(self, row: int) -> Array:
        """r_ned_from_frd at a row of the history."""
        return np.column_stack([body_axis_in_ned(self._solution.history, row, axis) for axis in range(3)])


def _turned(x: float, y: float, z: float, angle_rad: float) -> tuple[float, float, float]:
    """A vector turned about down."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return c * x - s * y, s * x + c * y, z


def _usable(values: Array) -> tuple[bool, bool, float]:
    """(there is a position, there is a velocity, heading of the attitude or NaN)."""
    position, velocity, q = (
        values[external.POSITION_M],
        values[external.VELOCITY_M_S],
        values[external.Q_LOCAL_FROM_FRD],
    )
    has_position = bool(np.abs(position).max() <= _MAX_POSITION_M)  # False for NaN
    has_velocity = bool(np.abs(velocity).max() <= _MAX_SPEED_M_S)
    norm = math.sqrt(float(q @ q)) if float(np.abs(q).max()) < 10.0 else math.nan
    return has_position, has_velocity, yaw_of((q / norm).tolist()) if 0.5 < norm < 2.0 else math.nan
