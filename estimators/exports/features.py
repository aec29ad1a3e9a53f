"""What of a log has a place on the Earth: tracks, plans, fences, searched areas, targets."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import NothingThere
from estimators.flown_track import FlownTrack, flown_tracks
from estimators.references import AUTOPILOT, TRUTH
from estimators.scene.scene import Scene
from estimators.scene_items import Gaussian, Line, Placed, PointSet, Pose, Role
from flightsim.foundation.geodesy import LocalFrame

if TYPE_CHECKING:
    from estimators.logs import Log

__all__ = ["FeatureKind", "MapFeature", "features_of", "rows_of"]

Array = NDArray[np.float64]

_POINTS: Final = (Role.COMMANDED, Role.FOUND, Role.TRUTH)
"""Roles of points that are exported: of particles and readings there are too many."""
_PERIOD_US: Final = 200_000
"""Shortest time between two points of a track."""
_WITHOUT: Final = ("setpoint", "camera")
"""Last parts of paths whose items are of one moment only."""


class FeatureKind(StrEnum):
    """The geometry of a place."""

    TRACK = "track"
    LINE = "line"
    AREA = "area"
    POINT = "point"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MapFeature:
    """A named geometry on the Earth.

    Attributes:
        name: such as "vehicle 1", "target 3, true".
        kind: its geometry.
        role: what it is ("truth", "estimate", "commanded", "found", "fence", "area").
        lon_deg, lat_deg: (n,) corners or points.
        alt_m: (n,) height above mean sea level; NaN: not known.
        unix_us: (n,) Unix time of the points of a track; 0: not known. Empty for other kinds.
        starts: rows at which a part of a track begins after a gap, the first included.
    """

    name: str
    kind: FeatureKind
    role: str
    lon_deg: Array
    lat_deg: Array
    alt_m: Array
    unix_us: NDArray[np.int64]
    starts: tuple[int, ...] = (0,)


def features_of(log: "Log") -> list[MapFeature]:
    """The places in a log: the tracks first, then what its scene shows at its end.

    Raises:
        NothingThere: no vehicle in it has a position.
    """
    found = [_of_track(track) for track in flown_tracks(log)]
    with suppress(NothingThere):  # a real flight
        found += [_of_track(track) for track in flown_tracks(log, source=TRUTH)]
    scene = Scene.of_log(log)
    if scene.origin is not None:
        frame = LocalFrame(scene.origin.place)
        for path, item in scene.at(scene.span_us[1]).items():
            found += _of_item(path, item, frame)
    return found


def _of_track(track: FlownTrack) -> MapFeature:
    boot = f", boot {track.boot}" if track.boot else ""
    parts = [part[_thinned(track.time_us[part])] for part in track.parts]
    rows = np.concatenate(parts)
    return MapFeature(
        name=f"vehicle {track.system_id}{boot}" + ("" if track.source == AUTOPILOT else ", true"),
        kind=FeatureKind.TRACK,
        role=str(Role.ESTIMATE if track.source == AUTOPILOT else Role.TRUTH),
        lon_deg=track.lon_deg[rows],
        lat_deg=track.lat_deg[rows],
        alt_m=track.alt_m[rows],
        unix_us=track.unix_us[rows],
        starts=(0, *np.cumsum([len(part) for part in parts])[:-1].tolist()),
    )


def _thinned(time_us: NDArray[np.int64]) -> NDArray[np.int64]:
    """Rows of times, one in each period, and the last one."""
    first = np.unique(time_us // _PERIOD_US, return_index=True)[1]
    return np.unique(np.append(first, len(time_us) - 1))


def _of_item(path: str, item: Placed, frame: LocalFrame) -> Iterator[MapFeature]:
    parts = path.split("/")
    name = getattr(item, "label", "") or " ".join(part.replace("_", " ").replace("-", " ") for part in parts)
    name = name.replace("vehicles ", "vehicle ").replace("targets ", "target ")
    if parts[-1] in _WITHOUT:
        return
    if isinstance(item, Line) and len(item.points_ned_m) > 1:
        kind = FeatureKind.AREA if item.closed else FeatureKind.LINE
        yield _place(name, kind, item.role, item.drawn_ned_m, frame)
    elif isinstance(item, PointSet) and item.role in _POINTS:
        for number, point in enumerate(item.points_ned_m):
            own = item.labels[number] if item.labels else str(number + 1)
            yield _place(f"{name} {own}", FeatureKind.POINT, item.role, point[None, :], frame)
    elif isinstance(item, Gaussian):
        yield _place(name, FeatureKind.POINT, item.role, np.array([item.mean_ned_m]), frame)
        outline = item.outline_ned_m()
        around = np.vstack([outline, outline[:1]])
        yield _place(f"{name}, 3 sigma", FeatureKind.AREA, item.role, around, frame)
    elif isinstance(item, Pose) and parts[0] != "vehicles":
        yield _place(name, FeatureKind.POINT, item.role, np.array([item.pos_ned_m]), frame)


def _place(name: str, kind: FeatureKind, role: str, points_ned_m: Array, frame: LocalFrame) -> MapFeature:
    known = points_ned_m[np.isfinite(points_ned_m).all(axis=1)]
    lat, lon, alt = frame.geodetic_from_ned(*known.T)
    return MapFeature(
        name=name, kind=kind, role=str(role), lon_deg=lon, lat_deg=lat, alt_m=alt,
        unix_us=np.zeros(0, dtype=np.int64),
    )  # fmt: skip


def rows_of(place: MapFeature) -> Sequence[slice]:
    """The rows of each part of a place."""
    ends = (*place.starts[1:], len(place.lon_deg))
    return [slice(start, end) for start, end in zip(place.starts, ends, strict=True)]
