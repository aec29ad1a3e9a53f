"""Frames of cameras from their messages: placed by the vehicle's own pose, thinned, and known by their
numbers.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from autopilot_bridge.mavlink.camera_scan import CameraScan
from autopilot_bridge.mavlink.search_likelihood import MOST_IMAGE, SearchLikelihood
from estimators import wire
from estimators.tracking.camera_sight import MAX_DETECTIONS, CameraSight, Detection, PoseErrors
from estimators.tracking.shared_errors import SharedErrors, View
from estimators.vision.vehicle_track import VehiclePose, VehicleTrack, ground_place
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.vectors import Vector, from_euler, product, rotate

__all__ = ["Camera", "likelihood_of", "sight_of"]

_KEPT: Final = 8  # exposures with detections whose frame has not ended
_STEP_US: Final = 500_000  # over which velocities are taken
_MOST_M_S: Final = 100.0  # of a position that jumps
_REMEMBERED: Final = 20_000  # frames by number


@dataclass(slots=True)
class Camera:
    """One vehicle and its camera.

    Attributes:
        track: its pose over time, in the area's frame.
        home: its home.
        position: its newest position.
        offset_us: from its vehicle time to the time common to all.
        counts: frames by what became of them.
        last_used_us: exposure of the last frame that was used.
        shared: the errors of its detections; None: there was none yet.
        component: of the camera: the first one that has ended a frame.
    """

    track: VehicleTrack = field(default_factory=VehicleTrack)
    home: GeodeticPosition | None = None
    position: wire.GLOBAL_POSITION_INT | None = None
    attitude_us: int = -1
    offset_us: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    last_used_us: int | None = None
    shared: SharedErrors | None = None
    component: int | None = None
    _pending: dict[tuple[int, int], list[tuple[float, float]]] = field(default_factory=dict)
    _counted: dict[tuple[int, int], int] = field(default_factory=dict)
    _known: dict[tuple[int, int], None] = field(default_factory=dict)

    def looks(self, component: int) -> bool:
        """Whether a component that ends a frame is the vehicle's searching camera."""
        if self.component is None:
            self.component = component
        return component == self.component

    def take_detection(self, component: int, exposed_us: int, angle_x_rad: float, angle_y_rad: float) -> None:
        """Keep a detection until the frame's end is received; one that is received twice counts once."""
        pairs = self._pending.setdefault((component, exposed_us), [])
        pair = (math.tan(angle_x_rad), math.tan(angle_y_rad))
        if pair not in pairs:
            pairs.append(pair)
        while len(self._pending) > _KEPT:
            del self._pending[min(self._pending, key=lambda key: key[1])]

    def count_detection(self, component: int, exposed_us: int) -> None:
        """Count a detection of whatever kind, to know whether all of a frame were received."""
        key = (component, exposed_us)
        self._counted[key] = self._counted.pop(key, 0) + 1
        while len(self._counted) > _KEPT:
            del self._counted[next(iter(self._counted))]

    def is_complete(self, exposed_us: int, expected: int) -> bool:
        """Whether as many detections were received as the end of a frame reports."""
        return self._counted.pop((self.component or 0, exposed_us), 0) >= expected

    def detections(self, exposed_us: int) -> tuple[tuple[float, float], ...]:
        """The detections of a frame that has ended."""
        found = self._pending.pop((self.component or 0, exposed_us), [])
        for older in [key for key in self._pending if key[1] < exposed_us]:
            del self._pending[older]
        return tuple(found[:MAX_DETECTIONS])

    def knows(self, number: int, exposed_us: int) -> bool:
        """Whether a frame was received before, by whatever message."""
        return (number, exposed_us) in self._known

    def is_new(self, number: int, exposed_us: int) -> bool:
        """Whether a frame was not received before, by whatever message; it is remembered."""
        key = (number, exposed_us)
        if key in self._known:
            return False
        self._known[key] = None
        if len(self._known) > _REMEMBERED:
            del self._known[next(iter(self._known))]
        return True

    def is_due(self, exposed_us: int, period_s: float) -> bool:
        """Whether enough time has passed since the last used frame; after a reboot it has."""
        last_us = self.last_used_us
        return last_us is None or exposed_us < last_us or (exposed_us - last_us) >= 1e6 * period_s - 1e3


def likelihood_of(
    camera: Camera,
    scan: CameraScan,
    detections: tuple[tuple[float, float], ...],
    errors: PoseErrors,
    frame: LocalFrame,
    *,
    tag_id: int,
    pixel_sigma_px: float,
    walk_m_sqrt_s: float,
) -> SearchLikelihood | None:
    """The parameters of a frame's likelihood; None: no pose near its time is known, or the camera is on a
    gimbal.
    """
    pose = camera.track.at(scan.time_us)
    if pose is None or scan.mount_rad is None:
        return None
    q_frd_from_mount = from_euler(*scan.mount_rad)
    north_m, east_m, down_m = _camera_place(pose, scan)
    before = camera.track.at(scan.time_us - _STEP_US)
    lat_deg, lon_deg, _ = frame.geodetic_from_ned(north_m, east_m, 0.0)
    velocity_m_s = (0.0, 0.0) if before is None else _rate(pose.pos_ned_m, before.pos_ned_m)
    place, rotation = errors.covariances(pose.q_ned_from_frd, q_frd_from_mount, velocity_m_s)
    found: list[Detection] = []
    for ray in detections:
        if camera.shared is None:
            camera.shared = SharedErrors(errors, pixel_sigma_px / scan.focal_px, walk_m_sqrt_s=walk_m_sqrt_s)
        view = View(
            time_us=scan.time_us,
            place_ne_m=(north_m, east_m),
            height_m=-down_m,
            q_ned_from_frd=pose.q_ned_from_frd,
            q_frd_from_mount=q_frd_from_mount,
            ray=ray,
            rate_m_s=_rate_on_ground(pose, before, scan, ray),
        )
        found.append(camera.shared.take(view))
    return SearchLikelihood(
        tag_id=tag_id,
        number=scan.number,
        time_us=scan.time_us,
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        height_m=-down_m,
        q_ned_from_mount=product(pose.q_ned_from_frd, q_frd_from_mount),
        place_m2=(place[0, 0], place[0, 1], place[1, 1], place[2, 2]),
        rotation_rad2=(*rotation[0], rotation[1, 1], rotation[1, 2], rotation[2, 2]),
        width_px=scan.width_px,
        height_px=scan.height_px,
        focal_px=scan.focal_px,
        distortion=scan.distortion,
        roots=(_root_of(found, 0), _root_of(found, 1)),
        detections=tuple((_in_picture(item.a), _in_picture(item.b)) for item in found),
    )


def _root_of(found: Sequence[Detection], index: int) -> tuple[float, float, float]:
    """Zeros: there is no such detection."""
    return found[index][2:] if index < len(found) else (0.0, 0.0, 0.0)


def _camera_place(pose: VehiclePose, scan: CameraScan) -> Vector:
    arm = rotate(pose.q_ned_from_frd, scan.position_frd_m)
    n, e, d = (p + a for p, a in zip(pose.pos_ned_m, arm, strict=True))
    return n, e, d


def _rate(now: Sequence[float], before: Sequence[float]) -> tuple[float, float]:
    """Velocity, north and east, between two places."""
    step_s = 1e-6 * _STEP_US
    north, east = (
        min(max((a - b) / step_s, -_MOST_M_S), _MOST_M_S) for a, b in zip(now[:2], before[:2], strict=True)
    )
    return north, east


def _rate_on_ground(
    pose: VehiclePose, before: VehiclePose | None, scan: CameraScan, ray: tuple[float, float]
) -> tuple[float, float]:
    """Velocity at which the vehicle moves a ray over the ground; zeros: it is not known."""
    angles = math.atan(ray[0]), math.atan(ray[1])
    now = ground_place(pose, scan, *angles)
    then = None if before is None else ground_place(before, scan, *angles)
    return (0.0, 0.0) if now is None or then is None else _rate(now, then)


def _in_picture(coordinate: float) -> float:
    return min(max(coordinate, -MOST_IMAGE), MOST_IMAGE)


def sight_of(likelihood: SearchLikelihood, frame: LocalFrame) -> CameraSight:
    """A frame in the area's own coordinates."""
    m = likelihood
    north_m, east_m, _ = frame.ned_from_geodetic(m.lat_deg, m.lon_deg, frame.origin.alt_m)
    nn, ne, ee, dd = m.place_m2
    xx, xy, xz, yy, yz, zz = m.rotation_rad2
    return CameraSight(
        place_ned_m=(north_m, east_m, -m.height_m),
        q_ned_from_mount=m.q_ned_from_mount,
        place_m2=np.array([[nn, ne, 0.0], [ne, ee, 0.0], [0.0, 0.0, dd]]),
        rotation_rad2=np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]),
        width_px=m.width_px,
        height_px=m.height_px,
        focal_px=m.focal_px,
        distortion=m.distortion,
        detections=np.array(m.detections, dtype=np.float64).reshape(-1, 2),
        roots=np.array(m.roots[: len(m.detections)], dtype=np.float64).reshape(-1, 3),
    )
