"""Draws the entries of a scene with Rerun. Entities have the paths of the entries.

The space is that of the scene: x north, y east, z down, metres. The timeline is "time", seconds of the run.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
import rerun as rr
from numpy.typing import NDArray

from estimators.received import GAP_S
from estimators.scene_items import (
    Camera,
    Cleared,
    Entry,
    Field,
    Gaussian,
    Line,
    Origin,
    Picture,
    PointSet,
    Pose,
    Role,
    Text,
    Value,
)
from flightsim.foundation.vectors import Quaternion, Vector
from missions.view.colours import colour_of, colour_scale
from missions.view.rerun_layout import Content, layout
from missions.view.words import field_label, gaussian_label, series_name

__all__ = ["TIMELINE", "RerunDrawer", "field_image"]

TIMELINE: Final = "time"
TRAIL: Final = "trail"
BAND: Final = "3_sigma"
_TRAIL_STEP_S: Final = 0.5
_JPEG_QUALITY: Final = 80
_AXES_SHARE: Final = 0.03  # of the extent of what is shown
_LEAST_AXES_M: Final = 1.0
_GROWN: Final = 2.0
_FRUSTUM_SHARE: Final = 0.08
_GOOD: Final = rr.TextLogLevel.INFO
_BAD: Final = rr.TextLogLevel.WARN


@dataclass(slots=True)
class _Trail:
    """The newest point of a vehicle's trail."""

    time_us: int
    pos_ned_m: Vector


@dataclass(slots=True)
class _Extent:
    """The horizontal extent of what is shown."""

    low: Vector = (math.inf, math.inf, math.inf)
    high: Vector = (-math.inf, -math.inf, -math.inf)
    drawn_m: float = 0.0  # for which the axes were drawn

    def take(self, north_m: float, east_m: float, down_m: float) -> None:
        self.low = min(self.low[0], north_m), min(self.low[1], east_m), min(self.low[2], down_m)
        self.high = max(self.high[0], north_m), max(self.high[1], east_m), max(self.high[2], down_m)

    @property
    def size_m(self) -> float:
        return max(self.high[0] - self.low[0], self.high[1] - self.low[1], 0.0)


class RerunDrawer:
    """Draws entries on a recording.

    Args:
        recording: of Rerun.
    """

    def __init__(self, recording: rr.RecordingStream) -> None:
        self._recording = recording
        self._content = Content()
        self._laid_out: Content | None = None
        self._trails: dict[str, _Trail] = {}
        self._styled: set[str] = set()
        self._states: set[str] = set()
        self._extent = _Extent()
        self._poses: set[str] = set()
        self._draws: dict[type[Any], Callable[[str, Any], None]] = {
            Line: self._line,
            Field: self._field,
            Camera: self._camera,
            Picture: self._picture,
            Text: self._text,
            Cleared: self._cleared,
            Origin: self._origin,
        }
        self._draws_columns: dict[type[Any], Callable[[str, Sequence[Entry]], None]] = {
            Pose: self._draw_poses,
            PointSet: self._draw_points,
            Gaussian: self._draw_gaussians,
            Value: self._draw_values,
        }
        recording.log("/", rr.ViewCoordinates.FRD, static=True)  # north, east, down

    def draw(self, entries: Sequence[Entry]) -> None:
        """Draw entries; many at once cost less."""
        columns: dict[tuple[str, type[Any]], list[Entry]] = {}
        for entry in entries:
            kind = type(entry.item)
            if kind in self._draws_columns:
                columns.setdefault((entry.path, kind), []).append(entry)
            else:
                self._recording.set_time(TIMELINE, duration=entry.time_us * 1e-6)
                self._draws[kind](entry.path, entry.item)
        for (path, kind), own in columns.items():
            self._draws_columns[kind](path, own)
        if entries:
            self._scale_axes(entries[-1].time_us)

    def lay_out(self) -> None:
        """Send the layout of the views that suits what was drawn, if it has changed."""
        if self._laid_out == self._content or not self._content:
            return
        self._laid_out = self._content.copy()
        low, high = self._extent.low, self._extent.high
        found = layout(self._content, TIMELINE, (low, high) if math.isfinite(sum(low)) else None)
        self._recording.send_blueprint(found, make_active=True, make_default=True)

    # places

    def _draw_poses(self, path: str, entries: Sequence[Entry]) -> None:
        items = [entry.item for entry in entries if isinstance(entry.item, Pose)]
        times = self._times(entries)
        places = np.array([item.pos_ned_m for item in items])
        self._take_all(places)
        columns = rr.Transform3D.columns(
            translation=places,
            quaternion=[_xyzw(item.q_ned_from_frd or (1.0, 0.0, 0.0, 0.0)) for item in items],
        )
        self._recording.send_columns(path, [times], columns)
        if path not in self._styled:
            self._styled.add(path)
            item = items[0]
            colour = colour_of(path, item)
            label = item.label or _pose_label(path, item)
            radius = rr.Radius.ui_points(4.0 if item.role is Role.TRUTH else 6.0)
            point = rr.Points3D([(0.0, 0.0, 0.0)], colors=[colour], radii=[radius], labels=[label])
            # Not static, so that it can be cleared.
            self._recording.set_time(TIMELINE, duration=entries[0].time_us * 1e-6)
            self._recording.log(path, point)
            self._content.places.add(path)
            if item.q_ned_from_frd is not None:
                self._poses.add(path)
                self._recording.log(path, rr.TransformAxes3D(self._axes_m))
        self._draw_trail(path, entries)

    def _draw_trail(self, path: str, entries: Sequence[Entry]) -> None:
        """Legs of the trail, each shown from its end on; nothing is drawn over a gap."""
        times_s: list[float] = []
        legs: list[tuple[Vector, Vector]] = []
        for entry in entries:
            assert isinstance(entry.item, Pose)
            place, newest = entry.item.pos_ned_m, self._trails.get(path)
            step_s = math.inf if newest is None else (entry.time_us - newest.time_us) * 1e-6
            if newest is not None and 0.0 <= step_s < _TRAIL_STEP_S:
                continue
            if newest is not None and 0.0 <= step_s <= GAP_S:
                times_s.append(entry.time_us * 1e-6)
                legs.append((newest.pos_ned_m, place))
            self._trails[path] = _Trail(entry.time_us, place)
        if not legs:
            return
        head, _, name = path.rpartition("/")
        trail = f"{head}/{TRAIL}/{name}"
        if trail not in self._styled:
            self._styled.add(trail)
            item = entries[0].item
            assert isinstance(item, Pose)
            colour = colour_of(path, item)
            style = rr.LineStrips3D.from_fields(
                colors=[colour], radii=[rr.Radius.ui_points(0.8 if item.role is Role.TRUTH else 1.6)]
            )
            self._recording.log(trail, style, static=True)
            self._content.trails.add(trail)
        strips = rr.LineStrips3D.columns(strips=[np.array(leg) for leg in legs])
        self._recording.send_columns(trail, [rr.TimeColumn(TIMELINE, duration=times_s)], strips)

    @property
    def _axes_m(self) -> float:
        return max(_LEAST_AXES_M, _AXES_SHARE * self._extent.size_m)

    def _scale_axes(self, time_us: int) -> None:
        """Axes of the vehicles that are seen beside the largest thing that is shown, from a time on."""
        if self._extent.size_m <= _GROWN * self._extent.drawn_m:
            return
        self._extent.drawn_m = self._extent.size_m
        self._recording.set_time(TIMELINE, duration=time_us * 1e-6)
        for path in self._poses:
            self._recording.log(path, rr.TransformAxes3D(self._axes_m))

    def _line(self, path: str, item: Line) -> None:
        self._take_all(item.points_ned_m)
        labels = [item.label] if item.label else None
        radius = rr.Radius.ui_points(1.0 if item.role is Role.COMMANDED else 1.5)
        strip = rr.LineStrips3D(
            [item.drawn_ned_m], colors=[colour_of(path, item)], radii=[radius], labels=labels
        )
        self._recording.log(path, strip)
        self._content.places.add(path)

    def _draw_points(self, path: str, entries: Sequence[Entry]) -> None:
        items = [entry.item for entry in entries if isinstance(entry.item, PointSet)]
        points = np.concatenate([item.points_ned_m for item in items])
        lengths = [len(item.points_ned_m) for item in items]
        self._take_all(points)
        first = items[0]
        if path not in self._styled:
            self._styled.add(path)
            radius = rr.Radius.ui_points(5.0 if first.role is Role.FOUND else 2.5)
            style = rr.Points3D.from_fields(radii=[radius])
            self._recording.log(path, style, static=True)
            self._content.places.add(path)
        colours = np.concatenate([_point_colours(path, item) for item in items])
        labels: list[str] = []
        for item, length in zip(items, lengths, strict=True):
            labels += item.labels if len(item.labels) == length else [""] * length
        found = rr.Points3D.columns(positions=points, colors=colours, labels=labels if any(labels) else None)
        self._recording.send_columns(path, [self._times(entries)], found.partition(lengths))

    def _draw_gaussians(self, path: str, entries: Sequence[Entry]) -> None:
        items = [entry.item for entry in entries if isinstance(entry.item, Gaussian)]
        means = np.array([item.mean_ned_m for item in items])
        self._take_all(means)
        if path not in self._styled:
            self._styled.add(path)
            colour = colour_of(path, items[0])
            line = rr.LineStrips3D.from_fields(colors=[colour], radii=[rr.Radius.ui_points(1.5)])
            self._recording.log(path, line, static=True)
            middle = rr.Points3D.from_fields(colors=[colour], radii=[rr.Radius.ui_points(4.0)])
            self._recording.log(f"{path}/mean", middle, static=True)
            self._content.places.add(path)
        times = [self._times(entries)]
        outlines = [item.outline_ned_m() for item in items]
        strips = [np.concatenate([outline, outline[:1]]) for outline in outlines]
        labels = [gaussian_label(item) for item in items]
        self._recording.send_columns(path, times, rr.LineStrips3D.columns(strips=strips, labels=labels))
        self._recording.send_columns(f"{path}/mean", times, rr.Points3D.columns(positions=means))

    def _field(self, path: str, item: Field) -> None:
        rows, columns = item.values.shape
        corners = [(item.south_m, item.west_m, item.down_m)]
        corners.append((item.south_m + rows * item.cell_m, item.west_m + columns * item.cell_m, item.down_m))
        self._take_all(np.array(corners))
        image = field_image(item)
        self._recording.log(
            path,
            rr.GridMap(
                data=image.tobytes(),
                format=rr.components.ImageFormat(
                    width=rows, height=columns, color_model="RGBA", channel_datatype="U8"
                ),
                cell_size=item.cell_m,
                translation=corners[0],
                opacity=0.8,
            ),
        )
        label = rr.Points3D(
            [corners[1]], radii=[0.0], labels=[field_label(path, item)], colors=[(255, 255, 255)]
        )
        self._recording.log(f"{path}/label", label)
        self._content.places.add(path)

    def _camera(self, path: str, item: Camera) -> None:
        self._recording.log(
            path,
            rr.Transform3D(translation=item.pos_ned_m, quaternion=_xyzw(item.q_ned_from_camera)),
            rr.Pinhole(
                focal_length=item.focal_px,
                principal_point=item.centre_px,
                width=item.width_px,
                height=item.height_px,
                camera_xyz=rr.ViewCoordinates.RDF,
                image_plane_distance=max(1.0, _FRUSTUM_SHARE * self._extent.size_m),
            ),
        )
        self._content.places.add(path)

    def _picture(self, path: str, item: Picture) -> None:
        done, encoded = cv2.imencode(".jpg", item.pixels, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
        if not done:
            return
        self._recording.log(path, rr.EncodedImage(contents=encoded.tobytes(), media_type="image/jpeg"))
        marks = rr.Points2D(
            item.marks_px,
            colors=[(255, 92, 92)],
            radii=[rr.Radius.ui_points(6.0)],
            labels=list(item.labels) or None,
        )
        self._recording.log(f"{path}/marks", marks)
        self._content.pictures.add(path)

    def _cleared(self, path: str, _item: Cleared) -> None:
        self._recording.log(path, rr.Clear(recursive=True))
        self._styled.discard(path)
        self._poses.discard(path)

    def _origin(self, path: str, item: Origin) -> None:
        place = (
            f"origin: latitude {item.lat_deg:.7f}, longitude {item.lon_deg:.7f}, altitude {item.alt_m:.1f} m"
        )
        self._recording.log(path, rr.TextLog(place, level=_GOOD))

    # over time

    def _draw_values(self, path: str, entries: Sequence[Entry]) -> None:
        items = [entry.item for entry in entries if isinstance(entry.item, Value)]
        times, first = self._times(entries), items[0]
        if path not in self._styled:
            self._styled.add(path)
            name = series_name(path, first)
            self._recording.log(
                path, rr.SeriesLines(names=[name], colors=[colour_of(path, first)]), static=True
            )
            self._content.series[path] = first
        self._recording.send_columns(
            path, [times], rr.Scalars.columns(scalars=[item.value for item in items])
        )
        known = [k for k, item in enumerate(items) if math.isfinite(item.sigma)]
        if not known:
            return
        band = f"{path}/{BAND}"
        if band not in self._styled:
            self._styled.add(band)
            colour = (*colour_of(path, first), 110)
            names = ["+3 sigma", "-3 sigma"]
            self._recording.log(band, rr.SeriesLines(names=names, colors=[colour, colour]), static=True)
            self._content.bands.add(path)
        middles = [0.0 if items[k].error else items[k].value for k in known]
        ends = [
            (m + 3.0 * items[k].sigma, m - 3.0 * items[k].sigma) for m, k in zip(middles, known, strict=True)
        ]
        scalars = rr.Scalars.columns(scalars=np.array(ends).reshape(-1)).partition([2] * len(ends))
        self._recording.send_columns(band, [self._times([entries[k] for k in known])], scalars)

    def _text(self, path: str, item: Text) -> None:
        self._recording.log(path, rr.TextLog(item.text, level=_BAD if item.warning else _GOOD))
        if item.state:
            self._recording.log(path, rr.StateChange(state=[item.state]))
            self._content.states.add(path)
        self._content.texts.add(path)

    def _times(self, entries: Sequence[Entry]) -> rr.TimeColumn:
        return rr.TimeColumn(TIMELINE, duration=[entry.time_us * 1e-6 for entry in entries])

    def _take_all(self, points: Any) -> None:
        known = points[np.isfinite(points).all(axis=1)]
        if len(known):
            self._extent.take(*known.min(axis=0).tolist())
            self._extent.take(*known.max(axis=0).tolist())


def field_image(item: Field) -> NDArray[np.uint8]:
    """The image of a field, RGBA, (columns, rows, 4): x (north) is along its rows, y (east) goes up from its
    last row.
    """
    return np.ascontiguousarray(colour_scale(item.values, *item.scale).transpose(1, 0, 2)[::-1])


def _point_colours(path: str, item: PointSet) -> NDArray[np.uint8]:
    """Of each point: by its weight in a belief, else that of the item."""
    if len(item.weights) == len(item.points_ned_m) and len(item.weights) and item.role is Role.BELIEF:
        return colour_scale(item.weights, 0.0, max(float(item.weights.max()), 1e-300))
    return np.tile(np.array([*colour_of(path, item), 255], dtype=np.uint8), (len(item.points_ned_m), 1))


def _xyzw(q: Quaternion) -> rr.Quaternion:
    w, x, y, z = q
    return rr.Quaternion(xyzw=[x, y, z, w])


def _pose_label(path: str, item: Pose) -> str:
    parts = path.split("/")
    if parts[0] == "vehicles":
        return f"vehicle {parts[1]}, true" if item.role is Role.TRUTH else f"vehicle {parts[1]}"
    return parts[-1].replace("_", " ")
