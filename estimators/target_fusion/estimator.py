"""The estimator `target-fusion`: a target's place from the detections of all drones of a team.

Source: Steckenrider, Leamy, Furukawa 2020 (SSRR), section III-C; docs/lissajous_estimation.md.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar, Final

import numpy as np

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import e7
from estimators import wire
from estimators.interface import Estimator, Need, Outcome
from estimators.lissajous.model import Array
from estimators.lissajous.motion_filter import off_pattern_remarks
from estimators.lissajous.pattern_frame import MESSAGES, PatternFrame
from estimators.messages import Message, on
from estimators.target_fusion.belief import TargetBelief
from estimators.target_fusion.drone import Drone
from estimators.target_fusion.estimate import TargetEstimate
from estimators.target_fusion.parameters import Heading, Mount, TargetFusionParameters
from flightsim.foundation.geodesy import GeodeticPosition

_ATTITUDE_HZ: Final = 10.0
_GIMBAL_HZ: Final = 5.0
_POSITION_HZ: Final = 2.0
_POSITION_KNOWN: Final = 1  # FOLLOW_TARGET.est_capabilities, bit 0


class TargetFusionEstimator(Estimator[TargetFusionParameters]):
    """The base station: it receives the messages of all drones, tracks the motion of each, and fuses their
    detections.

    Attributes:
        drones: drones by system id.
        beliefs: beliefs by the number of the target's tag; 255: all targets without a tag.
    """

    NAME: ClassVar[str] = "target-fusion"
    PARAMETERS = TargetFusionParameters
    TEAM: ClassVar[bool] = True

    def __init__(self, parameters: TargetFusionParameters | None = None) -> None:
        super().__init__(parameters)
        self._handlers: dict[str, Callable[[int, Drone, Message], Outcome]] = {
            MESSAGES[self.parameters.source]: self._on_position,
            **on(wire.HOME_POSITION, self._on_home),
            **on(wire.ATTITUDE, _on_attitude),
            **on(wire.GIMBAL_DEVICE_ATTITUDE_STATUS, _on_gimbal),
            **on(wire.LANDING_TARGET, _on_detection),
        }
        self.drones: dict[int, Drone] = {}
        self.beliefs: dict[int, TargetBelief] = {}
        self._pattern: PatternFrame | None = None
        self._estimates: tuple[TargetEstimate, ...] = ()
        self._fused = 0
        self._unplaced = 0

    @property
    def needs(self) -> tuple[Need, ...]:
        """The messages that every drone of the team must send."""
        p = self.parameters
        gimbal = p.mount is Mount.GIMBAL
        found = [
            Need(
                messages=(MESSAGES[p.source],),
                rate_hz=_POSITION_HZ,
                wanted_rate_hz=10.0,
                purpose="position and velocity over ground",
            ),
            Need(messages=("HOME_POSITION",), rate_hz=0.0, purpose="home, the centre of the pattern"),
            Need(messages=("LANDING_TARGET",), rate_hz=0.0, purpose="detections of the target"),
        ]
        if gimbal:
            found.append(
                Need(
                    messages=("GIMBAL_DEVICE_ATTITUDE_STATUS",),
                    rate_hz=_GIMBAL_HZ,
                    wanted_rate_hz=20.0,
                    purpose="attitude of the camera",
                )
            )
        if not gimbal or p.heading is Heading.YAW:
            found.append(
                Need(
                    messages=("ATTITUDE",),
                    rate_hz=_ATTITUDE_HZ,
                    wanted_rate_hz=50.0,
                    purpose="yaw of the vehicle" if gimbal else "attitude of the camera",
                )
            )
        return tuple(found)

    def handle(self, time_us: int, message: Message) -> Outcome:
        """Process one message of any drone."""
        name = type(message).name
        handler = self._handlers.get(name)
        if handler is None:
            return Outcome.IGNORED
        from_payload = name in ("LANDING_TARGET", "GIMBAL_DEVICE_ATTITUDE_STATUS")
        if not from_payload and message.src_component != AUTOPILOT_COMPONENT:
            return Outcome.IGNORED
        drone = self.drones.get(message.src_system)
        if drone is None:
            drone = self.drones[message.src_system] = Drone(message.src_system, self.parameters)
            if self._pattern is not None:
                drone.track.place_pattern(self._pattern)
        outcome = handler(time_us, drone, message)
        updated, detected = self._place_pending(drone)
        if updated:
            self._estimates = tuple(updated.values())
            return Outcome.UPDATED
        return detected if name == "LANDING_TARGET" and detected is not None else outcome

    def _on_position(self, time_us: int, drone: Drone, message: Message) -> Outcome:
        return drone.take_position(time_us, message)

    def _on_home(self, time_us: int, drone: Drone, message: wire.HOME_POSITION) -> Outcome:
        home = drone.take_home(message)
        if home is None:
            return Outcome.IMPLAUSIBLE
        p = self.parameters
        if drone.system_id == p.centre_vehicle or (p.has_centre and self._pattern is None):
            self._place_pattern(home)
        return Outcome.USED

    def _place_pattern(self, home: GeodeticPosition) -> None:
        pattern = PatternFrame(self.parameters, home)
        if self._pattern is not None:
            if pattern.frame.origin == self._pattern.frame.origin:
                return
            for belief in self.beliefs.values():
                belief.move_origin(*self._pattern.origin_of(pattern))
        self._pattern = pattern
        for drone in self.drones.values():
            drone.track.place_pattern(pattern)

    def _place_pending(self, drone: Drone) -> tuple[dict[int, TargetEstimate], Outcome | None]:
        """Fuse the detections that are ready; returns estimates by target, and the outcome of the last
        detection.
        """
        updated: dict[int, TargetEstimate] = {}
        last = None
        while drone.pending and drone.ready(drone.pending[0]):
            detection = drone.pending.popleft()
            seen = drone.placed(detection)
            if seen is None:
                self._unplaced += 1
                last = Outcome.WAITING
                continue
            belief = self.beliefs.get(detection.target)
            if belief is None:
                belief = self.beliefs[detection.target] = self._new_belief()
            last = belief.take(detection.time_us, seen)
            if last is Outcome.UPDATED:
                self._fused += 1
                updated[detection.target] = self._estimate_of(belief, detection.target, drone.system_id)
        return updated, last

    def _new_belief(self) -> TargetBelief:
        p = self.parameters
        return TargetBelief(
            walk_m2_s=p.walk_m_sqrt_s**2,
            gate=p.gate,
            confirmations=p.confirmations,
            max_delay_us=round(1e6 * p.max_delay_s),
        )

    def _estimate_of(self, belief: TargetBelief, target: int, vehicle: int) -> TargetEstimate:
        return self._estimate(belief.values, belief.time_us, target, vehicle)

    def _estimate(self, values: Array, time_us: int, target: int, vehicle: int) -> TargetEstimate:
        pattern = self._pattern
        assert pattern is not None  # without a pattern no detection is placed
        x, y, xx, xy, yy = values.tolist()
        north_m, east_m = pattern.north_east(x, y)
        (c, s), (_, _) = pattern.north_east(1.0, 0.0), pattern.north_east(0.0, 1.0)
        place = pattern.geodetic(x, y)
        return TargetEstimate(
            time_us=time_us,
            target=target,
            vehicle=vehicle,
            lat_deg=place.lat_deg,
            lon_deg=place.lon_deg,
            alt_m=place.alt_m,
            north_m=north_m,
            east_m=east_m,
            north_variance_m2=c * c * xx - 2.0 * c * s * xy + s * s * yy,
            north_east_covariance_m2=c * s * (xx - yy) + (c * c - s * s) * xy,
            east_variance_m2=s * s * xx + 2.0 * c * s * xy + c * c * yy,
        )

    def target_at(self, time_us: int, target: int = 255) -> TargetEstimate | None:
        """The estimated place of a target at a time, with the variance that has grown since it was last
        detected; None for a target that was never detected.
        """
        belief = self.beliefs.get(target)
        if belief is None or not belief.confirmed:
            return None
        return self._estimate(belief.at(time_us), max(time_us, belief.time_us), target, 0)

    def reset(self) -> None:
        """Discard everything except parameters and counters."""
        self.drones.clear()
        self.beliefs.clear()
        self._pattern = None
        self._estimates = ()
        self._fused = 0
        self._unplaced = 0

    @property
    def estimates(self) -> Sequence[TargetEstimate]:
        """The estimates of the targets that the newest detections have changed."""
        return self._estimates

    @property
    def origin(self) -> GeodeticPosition | None:
        """The pattern's centre."""
        return None if self._pattern is None else self._pattern.frame.origin

    def publish(self) -> Sequence[MAVLinkMessage]:
        """FOLLOW_TARGET for each target: its position and, in `position_cov`, its horizontal standard
        deviation per axis.
        """
        messages = []
        for e in self._estimates:
            sigma_m = float(np.sqrt(0.5 * (e.north_variance_m2 + e.east_variance_m2)))
            messages.append(
                dialect.MAVLink_follow_target_message(
                    e.time_us // 1000,
                    _POSITION_KNOWN,
                    e7(e.lat_deg),
                    e7(e.lon_deg),
                    e.alt_m,
                    [0.0] * 3,
                    [0.0] * 3,
                    [1.0, 0.0, 0.0, 0.0],
                    [0.0] * 3,
                    [sigma_m, 0.0, 0.0],
                    0,
                )
            )
        return messages

    def remarks(self) -> Mapping[str, float | str]:
        """The numbers of detections that were fused, were outside the gate, or could not be placed, and the
        share of samples off the pattern of the drone with the largest share.
        """
        return {
            "form": self.parameters.form.value + ("+frequency" if self.parameters.frequency else ""),
            "drones": float(len(self.drones)),
            "targets": float(sum(belief.confirmed for belief in self.beliefs.values())),
            **off_pattern_remarks(
                max((drone.track.filter.off_pattern for drone in self.drones.values()), default=0.0)
            ),
            "detections_fused": float(self._fused),
            "detections_outside_the_gate": float(sum(belief.gated for belief in self.beliefs.values())),
            "detections_not_placed": float(self._unplaced),
        }


def _on_attitude(time_us: int, drone: Drone, message: wire.ATTITUDE) -> Outcome:
    return drone.take_attitude(time_us, message)


def _on_gimbal(time_us: int, drone: Drone, message: wire.GIMBAL_DEVICE_ATTITUDE_STATUS) -> Outcome:
    return drone.take_gimbal(time_us, message)


def _on_detection(time_us: int, drone: Drone, message: wire.LANDING_TARGET) -> Outcome:
    return drone.take_detection(time_us, message)
