"""The estimator `vision-search`: a belief about the place of one tagged target, from the frames of a team's
cameras.

Source: Tisdale et al. 2008; docs/vision_search.md. Its inputs are attitude and position of the vehicles, what
their cameras detect, the ends of the frames, and the likelihoods that other vehicles send.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Final

import numpy as np

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.camera_scan import CameraScan, read_camera_scan
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT, CAMERA_COMPONENTS
from autopilot_bridge.mavlink.search_likelihood import (
    SearchLikelihood,
    read_search_likelihood,
    search_likelihood_message,
)
from autopilot_bridge.mavlink.wire_units import e7, home_of, metres, place_of
from estimators import wire
from estimators.interface import Estimator, Need, Outcome
from estimators.messages import Message, on
from estimators.scene_items import Field, Item
from estimators.tracking.area_belief import AreaBelief
from estimators.tracking.camera_sight import CameraSight
from estimators.tracking.grid import GridLayout
from estimators.vision_search.estimate import AreaEstimate
from estimators.vision_search.frames import Camera, likelihood_of, sight_of
from estimators.vision_search.models import new_belief, pose_errors_of
from estimators.vision_search.parameters import VisionSearchParameters
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

__all__ = ["VisionSearchEstimator"]

_FIDUCIAL: Final = int(dialect.LANDING_TARGET_TYPE_VISION_FIDUCIAL)
_MOST_TAG: Final = 255
_POSITION_KNOWN: Final = 1  # FOLLOW_TARGET.est_capabilities, bit 0
_CLOCKS_APART_S: Final = 0.25  # from exposure to the newest attitude, beyond what a detector takes
_AHEAD_S: Final = 5.0  # a likelihood whose exposure is farther in the future, or ...
_OLD_S: Final = 600.0  # ... older, is not possible
_SHOWN_CELLS: Final = 100  # of the longer side, for viewers
_CLOCK_FRAMES: Final = 20  # of which the median is taken


class VisionSearchEstimator(Estimator[VisionSearchParameters]):
    """Fuses the frames of one or more vehicles into one belief about the target's place.

    Attributes:
        belief: the belief, for the planner and the picture of a search.
        detections, frames: numbers of frames with a detection, and of all frames, that were used.
        newest: the newest used frame of each vehicle, by system id.
    """

    NAME: ClassVar[str] = "vision-search"
    PARAMETERS = VisionSearchParameters
    TEAM: ClassVar[bool] = True

    def __init__(self, parameters: VisionSearchParameters | None = None) -> None:
        super().__init__(parameters)
        self._handlers: dict[str, Callable[[int, Camera, Message], Outcome]] = {
            **on(wire.ATTITUDE, self._on_attitude),
            **on(wire.GLOBAL_POSITION_INT, self._on_position),
            **on(wire.HOME_POSITION, self._on_home),
            **on(wire.LANDING_TARGET, self._on_detection),
            **on(wire.TUNNEL, self._on_tunnel),
        }
        self._errors = pose_errors_of(self.parameters)
        self.reset()

    @property
    def needs(self) -> tuple[Need, ...]:
        """The messages that every vehicle must send."""
        return (
            Need(messages=("TUNNEL",), rate_hz=0.0, purpose="ends of the camera's frames"),
            Need(messages=("LANDING_TARGET",), rate_hz=0.0, purpose="detections", optional=True),
            Need(messages=("ATTITUDE",), rate_hz=5.0, wanted_rate_hz=25.0, purpose="attitude of the camera"),
            Need(
                messages=("GLOBAL_POSITION_INT",),
                rate_hz=4.0,
                wanted_rate_hz=10.0,
                purpose="place of the camera",
            ),
            Need(messages=("HOME_POSITION",), rate_hz=0.0, purpose="home, the origin of the area"),
        )

    def reset(self) -> None:
        """Discard everything except the parameters."""
        self.belief: AreaBelief = new_belief(self.parameters)
        self.detections = self.frames = 0
        self.newest: dict[int, CameraSight] = {}
        self._cameras: dict[int, Camera] = {}
        self._frame: LocalFrame | None = None
        self._estimates: tuple[AreaEstimate, ...] = ()
        self._time_us: int | None = None  # of the belief
        self._estimated_us: int | None = None
        self._outbox: list[SearchLikelihood] = []
        self._unpublished: AreaEstimate | None = None
        self._delays_s: dict[int, list[float]] = {}
        self._other_tags: Counter[int] = Counter()

    def handle(self, time_us: int, message: Message) -> Outcome:
        """Process one message of any vehicle."""
        name = type(message).name
        handler = self._handlers.get(name)
        if handler is None:
            return Outcome.IGNORED
        if name not in ("TUNNEL", "LANDING_TARGET") and message.src_component != AUTOPILOT_COMPONENT:
            return Outcome.IGNORED
        camera = self._cameras.get(message.src_system)
        if camera is None:
            camera = self._cameras[message.src_system] = Camera()
        return handler(time_us, camera, message)

    # the pose

    def _on_attitude(self, _time_us: int, camera: Camera, message: wire.ATTITUDE) -> Outcome:
        if not all(map(math.isfinite, (message.roll, message.pitch, message.yaw))):
            return Outcome.NOT_FINITE
        camera.attitude_us = message.time_boot_ms * 1000
        camera.track.handle(message)
        return Outcome.USED

    def _on_position(self, time_us: int, camera: Camera, message: wire.GLOBAL_POSITION_INT) -> Outcome:
        place = place_of(message)
        if place is None:
            return Outcome.IMPLAUSIBLE
        camera.position = message
        camera.offset_us = time_us - message.time_boot_ms * 1000
        frame = self._origin()
        if frame is None:
            return Outcome.WAITING
        north_m, east_m, _ = frame.ned_from_geodetic(place.lat_deg, place.lon_deg, frame.origin.alt_m)
        camera.track.place(message.time_boot_ms * 1000, (north_m, east_m, -metres(message.relative_alt)))
        return Outcome.USED

    def _on_home(self, _time_us: int, camera: Camera, message: wire.HOME_POSITION) -> Outcome:
        home = home_of(message)
        if home is None:
            return Outcome.IMPLAUSIBLE
        camera.home = home
        return Outcome.USED

    def _origin(self) -> LocalFrame | None:
        """The frame of the area. It is fixed when a vehicle is in the air, whose home is that of this flight:
        arming sets it.
        """
        if self._frame is None:
            wanted = self.parameters.centre_vehicle
            for system_id, camera in self._cameras.items():
                if wanted in (0, system_id) and camera.home is not None and self._in_the_air(camera):
                    self._frame = LocalFrame(camera.home)
                    break
        return self._frame

    def _in_the_air(self, camera: Camera) -> bool:
        position = camera.position
        return position is not None and metres(position.relative_alt) >= self.parameters.least_height_m

    # the camera

    def _on_detection(self, _time_us: int, camera: Camera, message: wire.LANDING_TARGET) -> Outcome:
        if message.src_component not in CAMERA_COMPONENTS:
            return Outcome.IGNORED
        camera.count_detection(message.src_component, int(message.time_usec))
        if message.type != _FIDUCIAL:
            return Outcome.IGNORED
        angles = (message.angle_x, message.angle_y)
        if not all(map(math.isfinite, angles)):
            return Outcome.NOT_FINITE
        if max(map(abs, angles)) >= 0.49 * math.pi:
            return Outcome.IMPLAUSIBLE
        if message.target_num != self.parameters.tag_id:
            self._other_tags[min(int(message.target_num), _MOST_TAG)] += 1
            return Outcome.IGNORED
        camera.take_detection(message.src_component, int(message.time_usec), *angles)
        return Outcome.USED

    def _on_tunnel(self, time_us: int, camera: Camera, message: wire.TUNNEL) -> Outcome:
        content = (message.payload_type, message.payload_length, message.payload)
        scan = read_camera_scan(*content)
        if scan is not None and message.src_component in CAMERA_COMPONENTS:
            if not camera.looks(message.src_component):
                return Outcome.IGNORED
            return self._on_scan(camera, message.src_system, scan)
        likelihood = read_search_likelihood(*content)
        if likelihood is None or likelihood.tag_id != self.parameters.tag_id:
            return Outcome.IGNORED
        if self.parameters.own_vehicle and message.target_system not in (0, self.parameters.own_vehicle):
            return Outcome.IGNORED
        if self._origin() is None:
            return Outcome.WAITING
        age_s = (time_us - likelihood.time_us - camera.offset_us) * 1e-6
        if camera.position is not None and not -_AHEAD_S <= age_s <= _OLD_S:
            camera.counts["impossible"] += 1
            return Outcome.IMPLAUSIBLE
        if not camera.is_new(likelihood.number, likelihood.time_us):
            camera.counts["repeated"] += 1
            return Outcome.REPEATED
        camera.counts["received"] += 1
        return self._observe(time_us, camera, message.src_system, likelihood)

    def _on_scan(self, camera: Camera, system_id: int, scan: CameraScan) -> Outcome:
        p = self.parameters
        complete = camera.is_complete(scan.time_us, scan.detections)
        detections = camera.detections(scan.time_us)
        if p.own_vehicle not in (0, system_id):
            return Outcome.IGNORED
        frame = self._origin()
        if frame is None or not self._in_the_air(camera):
            camera.counts["too_low"] += 1
            return Outcome.WAITING
        self._note_clock(camera, system_id, scan)
        if not camera.is_due(scan.time_us, p.frame_period_s):
            camera.counts["too_soon"] += 1
            return Outcome.IGNORED
        if not complete and not detections:  # what was detected is lost: it may have been the target
            camera.counts["incomplete"] += 1
            return Outcome.IGNORED
        if camera.knows(scan.number, scan.time_us):
            camera.counts["repeated"] += 1
            return Outcome.REPEATED
        likelihood = likelihood_of(
            camera,
            scan,
            detections,
            self._errors,
            frame,
            tag_id=p.tag_id,
            pixel_sigma_px=p.pixel_sigma_px,
            walk_m_sqrt_s=p.walk_m_sqrt_s,
        )
        if likelihood is None:
            camera.counts["without_pose"] += 1
            return Outcome.WAITING
        camera.is_new(scan.number, scan.time_us)
        camera.last_used_us = scan.time_us
        message = search_likelihood_message(likelihood)
        sent = read_search_likelihood(message.payload_type, message.payload_length, message.payload)
        if sent is None:
            camera.counts["impossible"] += 1
            return Outcome.IMPLAUSIBLE
        if p.own_vehicle:
            self._outbox.append(sent)
        camera.counts["used"] += 1
        # what is sent, with its rounding, so that every member of the team uses the same
        return self._observe(scan.time_us + camera.offset_us, camera, system_id, sent)

    def _note_clock(self, camera: Camera, system_id: int, scan: CameraScan) -> None:
        if camera.attitude_us >= 0:
            delays = self._delays_s.setdefault(system_id, [])
            delays.append((camera.attitude_us - scan.time_us) * 1e-6)
            if len(delays) > _CLOCK_FRAMES:
                del delays[0]

    # the belief

    def _observe(self, now_us: int, camera: Camera, system_id: int, likelihood: SearchLikelihood) -> Outcome:
        """Use a frame. The time is that of its exposure, so that an estimate has one time on every link."""
        frame = self._frame
        assert frame is not None
        time_us = likelihood.time_us + camera.offset_us if camera.position is not None else now_us
        sight = self.newest[system_id] = sight_of(likelihood, frame)
        if self._time_us is None:
            self._time_us = time_us
        if time_us >= self._time_us:
            self.belief.predict((time_us - self._time_us) * 1e-6)
            self._time_us = time_us
        else:  # late: the target has walked on since
            camera.counts["late"] += 1
            walk = self.parameters.walk_m_sqrt_s
            sight = sight.blurred(walk * walk * (self._time_us - time_us) * 1e-6)
        self.belief.update(sight)
        self.frames += 1
        detected = bool(likelihood.detections)
        self.detections += detected
        due_us = round(self.parameters.estimate_period_s * 1e6)
        if not detected and self._estimated_us is not None and self._time_us - self._estimated_us < due_us:
            return Outcome.USED
        self._estimated_us = self._time_us
        self._estimates = (self._estimate(self._time_us),)
        if self.detections:
            self._unpublished = self._estimates[0]
        return Outcome.UPDATED

    def _estimate(self, time_us: int) -> AreaEstimate:
        belief = self.belief
        mean, covariance = belief.moments()
        mode = belief.mode_ne_m
        return AreaEstimate(
            time_us=time_us,
            north_m=float(mean[0]),
            east_m=float(mean[1]),
            north_variance_m2=float(covariance[0, 0]),
            north_east_covariance_m2=float(covariance[0, 1]),
            east_variance_m2=float(covariance[1, 1]),
            mode_north_m=mode[0],
            mode_east_m=mode[1],
            entropy_nats=belief.entropy_nats,
            probability_of_detection=belief.probability_of_detection,
            detections=self.detections,
            frames=self.frames,
        )

    @property
    def estimates(self) -> Sequence[Any]:
        """The state of the belief, once a period and after each detection."""
        return self._estimates

    @property
    def origin(self) -> GeodeticPosition | None:
        """The home of the centre vehicle."""
        return None if self._frame is None else self._frame.origin

    def shown(self) -> Mapping[str, Item]:
        """The probability of the target's place, in at most some thousand cells."""
        p = self.parameters
        layout = GridLayout.over(
            width_m=p.east_m - p.west_m,
            height_m=p.north_m - p.south_m,
            cell_m=max(p.east_m - p.west_m, p.north_m - p.south_m) / _SHOWN_CELLS,
            centre_ne_m=(0.5 * (p.south_m + p.north_m), 0.5 * (p.west_m + p.east_m)),
        )
        return {"probability": Field.on(layout, self.belief.shares(layout), unit="probability", low=0.0)}

    def take_likelihoods(self) -> list[SearchLikelihood]:
        """The likelihoods of the own vehicle's frames since the last call, for the other vehicles."""
        outbox, self._outbox = self._outbox, []
        return outbox

    def publish(self) -> Sequence[MAVLinkMessage]:
        """The likelihoods of the own vehicle's frames since the last call, and, after a detection,
        FOLLOW_TARGET with the mean and its standard deviations.
        """
        messages: list[MAVLinkMessage] = [search_likelihood_message(item) for item in self.take_likelihoods()]
        estimate, frame = self._unpublished, self._frame
        self._unpublished = None
        if estimate is None or frame is None:
            return messages
        lat_deg, lon_deg, _ = frame.geodetic_from_ned(estimate.north_m, estimate.east_m, 0.0)
        messages.append(
            dialect.MAVLink_follow_target_message(
                estimate.time_us // 1000,
                _POSITION_KNOWN,
                e7(lat_deg),
                e7(lon_deg),
                frame.origin.alt_m,
                [0.0] * 3,
                [0.0] * 3,
                [1.0, 0.0, 0.0, 0.0],
                [0.0] * 3,
                [math.sqrt(estimate.north_variance_m2), math.sqrt(estimate.east_variance_m2), 0.0],
                0,
            )
        )
        return messages

    def remarks(self) -> Mapping[str, float | str]:
        """Frames by what became of them, other tags, and clocks that are apart."""
        counts: Counter[str] = Counter()
        for camera in self._cameras.values():
            counts.update(camera.counts)
        names = (
            *("used", "received", "repeated", "late", "too_soon", "too_low", "without_pose", "incomplete"),
            "impossible",
        )
        found: dict[str, float | str] = {f"frames_{name}": float(counts[name]) for name in names}
        found["detections"] = float(self.detections)
        found["detections_of_other_tags"] = float(sum(self._other_tags.values()))
        delays = {system_id: float(np.median(values)) for system_id, values in self._delays_s.items()}
        if delays:
            found["exposure_to_attitude_s"] = max(delays.values(), key=abs)
        apart = [
            f"the clocks of camera and autopilot of vehicle {system_id} are {abs(delay_s):.2f} s apart: "
            f"exposures are {'after' if delay_s < 0.0 else 'long before'} the newest attitude"
            for system_id, delay_s in sorted(delays.items())
            if delay_s < -0.5 * _CLOCKS_APART_S or delay_s > _CLOCKS_APART_S
        ]
        if apart:
            found["warning"] = "; ".join(apart)
        return found
