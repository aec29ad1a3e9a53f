"""Swept area and cumulative probability of detection of flown tracks on a grid."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.coverage.lateral_range import add_exposure, sweep
from estimators.coverage.parameters import CoverageParameters, LateralRange, Looks
from estimators.errors import EstimatorError
from estimators.flown_track import FlownTrack
from estimators.received import GAP_US, interpolated
from estimators.tracking.camera_likelihood import FrameLikelihood
from estimators.tracking.camera_sight import CameraSight, DetectionRate, PoseErrors, SightModel
from estimators.tracking.grid import GridLayout
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.vectors import from_euler, product, rotate

if TYPE_CHECKING:
    from estimators.vision.camera_file import CameraDescription

__all__ = ["Area", "Coverage", "coverage_of"]

Array = NDArray[np.float64]

_CELLS: Final = 200
_MOST_CELLS: Final = 4_000_000
_SEEN: Final = 1e-3
"""Probability of detection from which on a cell counts as swept: the edges of pictures fade."""
_SIGHTS: Final = 200  # frames from which the searched area is found where none is given


@dataclass(frozen=True, slots=True, kw_only=True)
class Area:
    """The searched area: a rectangle with the cells, and which of them belong to it.

    Attributes:
        layout: the cells, north and east of the origin.
        inside: (rows, columns).
    """

    layout: GridLayout
    inside: NDArray[np.bool_]

    @classmethod
    def of_corners(cls, corners_ne_m: Array, cell_m: float | None) -> "Area":
        """The cells whose centres are in a polygon.

        Args:
            corners_ne_m: (n, 2) north and east.
            cell_m: side of a cell; None: 1/200 of the longer side.
        """
        low, high = corners_ne_m.min(axis=0), corners_ne_m.max(axis=0)
        height_m, width_m = (float(side) for side in high - low)
        side_m = cell_m or max(0.1, max(width_m, height_m) / _CELLS)
        layout = GridLayout.over(
            width_m=width_m + 0.999 * side_m,  # whole cells over all of it
            height_m=height_m + 0.999 * side_m,
            cell_m=side_m,
            centre_ne_m=(float(low[0] + high[0]) / 2.0, float(low[1] + high[1]) / 2.0),
            most_cells=_MOST_CELLS,
        )
        return cls(layout=layout, inside=_inside(corners_ne_m, *layout.centres()))

    @property
    def area_m2(self) -> float:
        """Its size."""
        return float(np.count_nonzero(self.inside)) * self.layout.cell_m**2


def _inside(corners: Array, north: Array, east: Array) -> NDArray[np.bool_]:
    """Whether places are in a polygon, by the number of edges to the east of them."""
    within = np.zeros(np.broadcast_shapes(north.shape, east.shape), dtype=np.bool_)
    for (n0, e0), (n1, e1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if n0 == n1:
            continue
        crossed = (n0 <= north) != (n1 <= north)
        within ^= crossed & (east < e0 + (north - n0) / (n1 - n0) * (e1 - e0))
    return within


@dataclass(frozen=True, slots=True, kw_only=True)
class Coverage:
    """What was searched.

    Attributes:
        area: the searched area.
        pod: (rows, columns) probability that a target in a cell has been detected.
        swept: (rows, columns) of the cells that were seen.
        track_m: length of the track over the area, m.
        sweep_width_m: of the sensor; None: a camera.
        origin: of the area.
        source: of the tracks: "truth" or "autopilot".
    """

    area: Area
    pod: Array
    swept: NDArray[np.bool_]
    track_m: float
    sweep_width_m: float | None
    origin: GeodeticPosition
    source: str

    @property
    def figures(self) -> dict[str, Any]:
        """The numbers: `pod` is that of a target that may be anywhere in the area, with equal probability."""
        inside, area_m2 = self.area.inside, self.area.area_m2
        cell_m2 = self.area.layout.cell_m**2
        pod = self.pod[inside]
        width_m = self.sweep_width_m
        return {
            "area_m2": area_m2,
            "swept_m2": float(np.count_nonzero(self.swept & inside)) * cell_m2,
            "swept_share": float(np.mean(self.swept[inside])),
            "pod": float(pod.mean()),
            "track_m": self.track_m,
            "sweep_width_m": width_m,
            "coverage": None if width_m is None else width_m * self.track_m / area_m2,
            "cell_m": self.area.layout.cell_m,
            "track_by": self.source,
        }


def coverage_of(
    tracks: Sequence[FlownTrack],
    parameters: CoverageParameters,
    camera: "CameraDescription | None" = None,
    corners_ne_m: Array | None = None,
) -> Coverage:
    """The coverage of all tracks together.

    Args:
        tracks: of one or several vehicles and flights.
        parameters: of the sensor and the grid.
        camera: that all carry; None: a sensor with a sweep width.
        corners_ne_m: (n, 2) polygon of the searched area, north and east of the first track's home; None: the
            rectangle that was seen.

    Raises:
        EstimatorError: there is neither a camera nor a sweep width or both, nothing was seen, or the grid
            has too many cells or too few.
    """
    if (camera is None) == (parameters.sweep_width_m is None):
        raise EstimatorError("give a camera or `sweep_width_m`, and not both")
    origin = tracks[0].home
    if camera is None:
        search: _Search = _SweepWidth(tracks, parameters, origin)
    else:
        search = _Camera(tracks, parameters, origin, camera)
    corners = search.seen_corners() if corners_ne_m is None else corners_ne_m
    area = Area.of_corners(corners, parameters.cell_m)
    pod, swept = search.over(area.layout)
    return Coverage(
        area=area,
        pod=pod,
        swept=swept,
        track_m=_length_over(area, search.parts),
        sweep_width_m=parameters.sweep_width_m,
        origin=origin,
        source=tracks[0].source,
    )


def _length_over(area: Area, parts: Sequence[Array]) -> float:
    """Length of the parts of tracks that are over the area."""
    layout, total_m = area.layout, 0.0
    for places in parts:
        steps = np.diff(places[:, :2], axis=0)
        middles = places[:-1, :2] + 0.5 * steps
        cells = np.floor((middles - (layout.south_m, layout.west_m)) / layout.cell_m).astype(np.int64)
        on_map = ((cells >= 0) & (cells < (layout.rows, layout.columns))).all(axis=1)
        over = area.inside[tuple(cells[on_map].T)]
        total_m += float(np.linalg.norm(steps[on_map][over], axis=1).sum())
    return total_m


class _Search(ABC):
    """Tracks with a sensor.

    Attributes:
        parts: (n, 3) places of each part of a track in flight, north, east and height above the ground.
    """

    parts: list[Array]

    @abstractmethod
    def seen_corners(self) -> Array:
        """A rectangle around all that was seen."""

    @abstractmethod
    def over(self, layout: GridLayout) -> tuple[Array, NDArray[np.bool_]]:
        """Probability of detection of each cell, and whether it was seen."""


def _in_flight(
    track: FlownTrack, parameters: CoverageParameters, origin: GeodeticPosition
) -> tuple[Array, list[NDArray[np.int64]]]:
    """Places (n, 3), north, east and height above the ground, and the rows of each part in flight."""
    ned_m = track.pos_ned_m(origin)
    places = np.column_stack([ned_m[:, :2], -ned_m[:, 2] - parameters.ground_m])
    high = np.asarray(np.isfinite(places).all(axis=1))
    high &= places[:, 2] >= parameters.least_height_m
    parts = []
    for part in track.parts:
        cuts = np.flatnonzero(np.diff(high[part].astype(np.int8))) + 1
        parts += [rows for rows in np.split(part, cuts) if len(rows) and high[rows[0]]]
    return places, parts


class _SweepWidth(_Search):
    """A sensor that is known by its sweep width."""

    def __init__(
        self, tracks: Sequence[FlownTrack], parameters: CoverageParameters, origin: GeodeticPosition
    ) -> None:
        self._parameters = parameters
        self.parts = []
        for track in tracks:
            places, parts = _in_flight(track, parameters, origin)
            self.parts += [places[rows] for rows in parts if len(rows) > 1]
        if not self.parts:
            raise EstimatorError(_nothing(parameters))

    def seen_corners(self) -> Array:
        places = np.vstack(self.parts)[:, :2]
        half_m = 0.5 * (self._parameters.sweep_width_m or 0.0)
        return _rectangle(places.min(axis=0) - half_m, places.max(axis=0) + half_m)

    def over(self, layout: GridLayout) -> tuple[Array, NDArray[np.bool_]]:
        width_m = self._parameters.sweep_width_m or 0.0
        north, east = (np.ascontiguousarray(axis.ravel()) for axis in layout.centres())
        swept = np.zeros((layout.rows, layout.columns), dtype=np.bool_)
        exposure = np.zeros((layout.rows, layout.columns))
        for part in self.parts:
            places = np.ascontiguousarray(part[:, :2])
            sweep(places, north, east, 0.5 * width_m, swept)
            if self._parameters.lateral_range is LateralRange.INVERSE_CUBE:
                reach_m = self._parameters.reach_m
                add_exposure(places, north, east, self._parameters.inverse_cube_m, reach_m, exposure)
        if self._parameters.lateral_range is LateralRange.INVERSE_CUBE:
            return -np.expm1(-exposure), swept
        return swept.astype(np.float64), swept


class _Camera(_Search):
    """A camera that is fixed to the vehicle."""

    def __init__(
        self,
        tracks: Sequence[FlownTrack],
        parameters: CoverageParameters,
        origin: GeodeticPosition,
        camera: "CameraDescription",
    ) -> None:
        p = self._parameters = parameters
        self._camera = camera
        self._mount = from_euler(*camera.mount_rad)
        rate = DetectionRate.rising(half_px=p.detect_half_px, width_px=p.detect_width_px, peak=p.detect_peak)
        self._model = SightModel(rate=rate, target_size_m=p.target_size_m)
        self._errors = PoseErrors(
            forward_m=p.place_sigma_m, right_m=p.place_sigma_m, height_m=p.place_sigma_m,
            yaw_rad=p.attitude_sigma_rad, pitch_rad=p.attitude_sigma_rad, roll_rad=p.attitude_sigma_rad,
        )  # fmt: skip
        self.parts = []
        self._looks: list[tuple[Array, Array, Array]] = []  # times s, places and attitudes of each part
        begin_s = 0.0  # another flight is another pass
        for track in tracks:
            places, parts = _in_flight(track, p, origin)
            attitudes = np.column_stack([track.roll_rad, track.pitch_rad, np.unwrap(track.yaw_rad)])
            known = np.asarray(np.isfinite(attitudes).all(axis=1))
            for rows in parts:
                rows = rows[known[rows]]
                if not len(rows):
                    continue
                times_us = track.time_us[rows].astype(np.float64)
                at_us = np.arange(times_us[0], times_us[-1] + 1.0, p.look_s * 1e6)
                both = interpolated(
                    at_us, times_us, np.column_stack([places[rows], attitudes[rows]]), gap=GAP_US
                )
                made = np.isfinite(both).all(axis=1)
                self.parts.append(places[rows])
                time_s = begin_s + 1e-6 * (at_us[made] - float(track.time_us[0]))
                self._looks.append((time_s, both[made, :3], both[made, 3:]))
            begin_s += 1e-6 * float(track.time_us[-1] - track.time_us[0]) + 2.0 * p.pass_gap_s
        if not self._looks:
            raise EstimatorError(f"{_nothing(p)} with an attitude")

    def _sights(self, stride: int = 1) -> Iterator[tuple[float, CameraSight]]:
        """Time, s, and camera of each look, or of some of them."""
        for time_s, places, attitudes in self._looks:
            some = slice(None, None, stride)
            for at_s, place, attitude in zip(time_s[some], places[some], attitudes[some], strict=True):
                yield float(at_s), self._sight(place, attitude)

    def _sight(self, place: Array, attitude_rad: Array) -> CameraSight:
        g, q_ned_from_frd = self._camera.geometry, from_euler(*attitude_rad.tolist())
        north_m, east_m, height_m = place.tolist()
        arm = rotate(q_ned_from_frd, self._camera.position_frd_m)
        place_m2, rotation_rad2 = self._errors.covariances(q_ned_from_frd, self._mount)
        return CameraSight(
            place_ned_m=(north_m + arm[0], east_m + arm[1], -height_m + arm[2]),
            q_ned_from_mount=product(q_ned_from_frd, self._mount),
            place_m2=place_m2,
            rotation_rad2=rotation_rad2,
            width_px=g.width_px,
            height_px=g.height_px,
            focal_px=0.5 * (g.focal_px[0] + g.focal_px[1]),
            distortion=g.distortion or (0.0,) * 5,
        )

    def _frame(self, sight: CameraSight) -> FrameLikelihood:
        return FrameLikelihood.of(sight, self._model, self._parameters.reach_m)

    def seen_corners(self) -> Array:
        count = sum(len(time_s) for time_s, _, _ in self._looks)
        boxes = [self._frame(sight).box for _, sight in self._sights(max(1, count // _SIGHTS))]
        found = np.array([box for box in boxes if box is not None])
        if not len(found):
            raise EstimatorError("the camera never looks at the ground; check its mount_rad")
        return _rectangle(found[:, :2].min(axis=0), found[:, 2:].max(axis=0))

    def over(self, layout: GridLayout) -> tuple[Array, NDArray[np.bool_]]:
        shape = layout.rows, layout.columns
        north, east = (np.ascontiguousarray(np.broadcast_to(axis, shape)) for axis in layout.centres())
        missed, best = np.ones(shape), np.zeros(shape)
        newest_s = np.full(shape, -math.inf)  # time of the look that saw a cell last
        swept = np.zeros(shape, dtype=np.bool_)
        each, gap_s = self._parameters.looks is Looks.EACH, self._parameters.pass_gap_s
        for at_s, sight in self._sights():
            frame = self._frame(sight)
            if frame.box is None:
                continue
            rows, columns = _cells_of(frame.box, layout)
            window = (rows, columns)
            if rows.start >= rows.stop or columns.start >= columns.stop:
                continue
            seen = 1.0 - frame.at(north[window].ravel(), east[window].ravel()).reshape(north[window].shape)
            in_view = seen > _SEEN
            swept[window] |= in_view
            if each:
                missed[window] *= 1.0 - seen
                continue
            begun = in_view & (at_s - newest_s[window] > gap_s)  # a new pass: the one before it counts
            missed[window] *= np.where(begun, 1.0 - best[window], 1.0)
            nearer = np.where(in_view, np.maximum(best[window], seen), best[window])
            best[window] = np.where(begun, seen, nearer)
            newest_s[window] = np.where(in_view, at_s, newest_s[window])
        return 1.0 - missed * (1.0 - best), swept


def _cells_of(box: tuple[float, float, float, float], layout: GridLayout) -> tuple[slice, slice]:
    """Rows and columns of the cells whose centres are in a box: south, west, north, east."""
    found = []
    for low_m, high_m, first_m, count in (
        (box[0], box[2], layout.south_m, layout.rows),
        (box[1], box[3], layout.west_m, layout.columns),
    ):
        first = math.ceil((low_m - first_m) / layout.cell_m - 0.5)
        last = math.floor((high_m - first_m) / layout.cell_m - 0.5)
        found.append(slice(max(0, first), min(count, last + 1)))
    return found[0], found[1]


def _rectangle(low: Array, high: Array) -> Array:
    return np.array([[low[0], low[1]], [low[0], high[1]], [high[0], high[1]], [high[0], low[1]]])


def _nothing(parameters: CoverageParameters) -> str:
    least_m = parameters.least_height_m
    return f"no flight above {least_m:g} m over the ground is in it (`least_height_m`, `ground_m`)"
