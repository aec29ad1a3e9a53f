"""Draws the entries of a scene with Foxglove's well-known schemas. Topics have the paths of the entries.

The frame is "map": x east, y north, z up, metres from the scene's origin. Each vehicle has a frame of its
own, x forward, y left, z up ("vehicles/1/estimate"), and each camera an optical one.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, Final

import cv2
import foxglove
import numpy as np
from foxglove import channels as ch
from foxglove import messages as msg
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
    Placed,
    PointSet,
    Pose,
    Text,
    Value,
)
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.vectors import Quaternion, Vector, product
from missions.view.colours import colour_of, colour_scale
from missions.view.words import field_label, gaussian_label

__all__ = ["FoxgloveDrawer"]

_FRAME: Final = "map"
_ENU_FROM_NED: Final = (0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0)
_FRD_FROM_FLU: Final = (0.0, 1.0, 0.0, 0.0)
_THIN_PX: Final = 2.0
_TEXT_PX: Final = 14.0
_JPEG_QUALITY: Final = 80
_TRAIL_STEP_S: Final = 0.5
_KEPT: Final = msg.Duration(0)  # until it is replaced
_VALUE: Final = {
    "title": "flightstack.Value",
    "type": "object",
    "properties": {
        "value": {"type": "number"},
        "sigma": {"type": "number"},
        "lower": {"type": "number"},
        "upper": {"type": "number"},
        "unit": {"type": "string"},
    },
}


class FoxgloveDrawer:
    """Draws entries on the channels of a context.

    Args:
        context: with the sinks.
        offset_us: what is added to times of the scene; Unix microseconds of its time 0, or 0.
    """

    def __init__(self, context: foxglove.Context, offset_us: int = 0) -> None:
        self._context = context
        self._offset_us = offset_us
        self._channels: dict[str, Any] = {}
        self._local: LocalFrame | None = None
        self._trails: dict[str, tuple[int, Vector, int]] = {}
        self._entities: dict[str, Any] = {}
        self._draws: dict[type[Any], Callable[[str, Any, int], None]] = {
            Pose: self._pose,
            Line: self._line,
            PointSet: self._points,
            Gaussian: self._gaussian,
            Field: self._field,
            Camera: self._camera,
            Picture: self._picture,
            Value: self._value,
            Text: self._text,
            Cleared: self._cleared,
            Origin: self._origin,
        }

    def draw(self, entries: Sequence[Entry]) -> None:
        """Draw entries."""
        for entry in entries:
            self._draws[type(entry.item)](entry.path, entry.item, 1000 * (entry.time_us + self._offset_us))

    def _channel(self, topic: str, kind: Any) -> Any:
        found = self._channels.get(topic)
        if found is None:
            found = self._channels[topic] = kind(topic, context=self._context)
        return found

    # places

    def _pose(self, path: str, item: Pose, time_ns: int) -> None:
        stamp, place = _stamp(time_ns), _enu(item.pos_ned_m)
        q = _xyzw(_enu_from_flu(item.q_ned_from_frd or (1.0, 0.0, 0.0, 0.0)))
        pose = msg.Pose(position=msg.Vector3(x=place[0], y=place[1], z=place[2]), orientation=q)
        found = msg.PoseInFrame(timestamp=stamp, frame_id=_FRAME, pose=pose)
        self._channel(f"/{path}/pose", ch.PoseInFrameChannel).log(found, log_time=time_ns)
        transform = msg.FrameTransform(
            timestamp=stamp,
            parent_frame_id=_FRAME,
            child_frame_id=path,
            translation=msg.Vector3(x=place[0], y=place[1], z=place[2]),
            rotation=q,
        )
        self._channel("/tf", ch.FrameTransformChannel).log(transform, log_time=time_ns)
        if self._local is not None:
            lat_deg, lon_deg, alt_m = self._local.geodetic_from_ned(*item.pos_ned_m)
            fix = msg.LocationFix(
                timestamp=stamp, frame_id=path, latitude=lat_deg, longitude=lon_deg, altitude=alt_m,
                color=_colour(path, item),
            )  # fmt: skip
            self._channel(f"/{path}/location", ch.LocationFixChannel).log(fix, log_time=time_ns)
        self._trail(path, item, time_ns)

    def _trail(self, path: str, item: Pose, time_ns: int) -> None:
        """A leg of the trail; legs are entities of their own, which stay."""
        before = self._trails.get(path)
        step_s = math.inf if before is None else (time_ns - before[0]) * 1e-9
        if 0.0 <= step_s < _TRAIL_STEP_S:
            return
        number = 0 if before is None else before[2] + 1
        self._trails[path] = time_ns, item.pos_ned_m, number
        if before is None or not 0.0 <= step_s <= GAP_S:
            return
        legs = np.array([before[1], item.pos_ned_m])
        self._entity(f"{path}/trail", time_ns, lines=[_strip(legs, _colour(path, item))], number=number)

    def _line(self, path: str, item: Line, time_ns: int) -> None:
        colour = _colour(path, item)
        texts = [_label(item.label, item.points_ned_m[0], colour)] if item.label else []
        self._entity(path, time_ns, lines=[_strip(item.drawn_ned_m, colour)], texts=texts)

    def _gaussian(self, path: str, item: Gaussian, time_ns: int) -> None:
        colour, outline = _colour(path, item), item.outline_ned_m()
        closed = np.concatenate([outline, outline[:1]])
        text = _label(gaussian_label(item), item.mean_ned_m, colour)
        self._entity(path, time_ns, lines=[_strip(closed, colour)], texts=[text])

    def _entity(
        self, path: str, time_ns: int, *, lines: Sequence[Any], texts: Sequence[Any] = (), number: int = 0
    ) -> None:
        entity = msg.SceneEntity(
            timestamp=_stamp(time_ns),
            frame_id=_FRAME,
            id=f"{path}/{number}",
            lifetime=_KEPT,
            lines=list(lines),
            texts=list(texts),
        )
        update = msg.SceneUpdate(entities=[entity])
        self._channel(f"/{path}", ch.SceneUpdateChannel).log(update, log_time=time_ns)

    def _points(self, path: str, item: PointSet, time_ns: int) -> None:
        places = np.array([_enu(point) for point in item.points_ned_m.tolist()]).reshape(-1, 3)
        weights = item.weights if len(item.weights) == len(places) else np.ones(len(places))
        data = np.column_stack([places, weights]).astype("<f4")
        names = ("x", "y", "z", "weight")
        found = msg.PointCloud(
            timestamp=_stamp(time_ns),
            frame_id=_FRAME,
            pose=_at((0.0, 0.0, 0.0)),
            point_stride=4 * len(names),
            fields=[_float32(name, 4 * k) for k, name in enumerate(names)],
            data=data.tobytes(),
        )
        self._channel(f"/{path}", ch.PointCloudChannel).log(found, log_time=time_ns)
        if item.labels:
            colour = _colour(path, item)
            labelled = zip(item.labels, item.points_ned_m.tolist(), strict=True)
            texts = [_label(label, place, colour) for label, place in labelled]
            self._entity(f"{path}/labels", time_ns, lines=[], texts=texts)

    def _field(self, path: str, item: Field, time_ns: int) -> None:
        """The first row is the southern one, as in the schema: x (east) along a row, y (north) over the
        rows.
        """
        rows, columns = item.values.shape
        cell = np.dtype([("value", "<f4"), ("rgba", "u1", 4)])
        data = np.zeros((rows, columns), dtype=cell)
        data["value"] = item.values
        data["rgba"] = colour_scale(item.values, *item.scale)
        fields = [_float32("value", 0)]
        for k, name in enumerate(("red", "green", "blue", "alpha")):
            kind = msg.PackedElementFieldNumericType.Uint8
            fields.append(msg.PackedElementField(name=name, offset=4 + k, type=kind))
        found = msg.Grid(
            timestamp=_stamp(time_ns),
            frame_id=_FRAME,
            pose=_at((item.west_m, item.south_m, -item.down_m)),
            column_count=columns,
            cell_size=msg.Vector2(x=item.cell_m, y=item.cell_m),
            row_stride=cell.itemsize * columns,
            cell_stride=cell.itemsize,
            fields=fields,
            data=data.tobytes(),
        )
        self._channel(f"/{path}", ch.GridChannel).log(found, log_time=time_ns)
        corner = (item.south_m + rows * item.cell_m, item.west_m, item.down_m)
        text = _label(field_label(path, item), corner, msg.Color(r=1.0, g=1.0, b=1.0, a=1.0))
        self._entity(f"{path}/label", time_ns, lines=[], texts=[text])

    def _camera(self, path: str, item: Camera, time_ns: int) -> None:
        stamp, place = _stamp(time_ns), _enu(item.pos_ned_m)
        transform = msg.FrameTransform(
            timestamp=stamp,
            parent_frame_id=_FRAME,
            child_frame_id=path,
            translation=msg.Vector3(x=place[0], y=place[1], z=place[2]),
            rotation=_xyzw(product(_ENU_FROM_NED, item.q_ned_from_camera)),
        )
        self._channel("/tf", ch.FrameTransformChannel).log(transform, log_time=time_ns)
        (fx, fy), (cx, cy) = item.focal_px, item.centre_px
        calibration = msg.CameraCalibration(
            timestamp=stamp,
            frame_id=path,
            width=item.width_px,
            height=item.height_px,
            distortion_model="plumb_bob" if item.distortion else "",
            D=list(item.distortion),
            K=[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
            R=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            P=[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        )
        self._channel(f"/{path}/calibration", ch.CameraCalibrationChannel).log(calibration, log_time=time_ns)

    def _picture(self, path: str, item: Picture, time_ns: int) -> None:
        done, encoded = cv2.imencode(".jpg", item.pixels, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
        if not done:
            return
        stamp = _stamp(time_ns)
        image = msg.CompressedImage(
            timestamp=stamp, frame_id=path.rpartition("/")[0], data=encoded.tobytes(), format="jpeg"
        )
        self._channel(f"/{path}", ch.CompressedImageChannel).log(image, log_time=time_ns)
        marks = msg.PointsAnnotation(
            timestamp=stamp,
            type=msg.PointsAnnotationType.Points,
            points=[msg.Point2(x=x, y=y) for x, y in item.marks_px.tolist()],
            outline_color=_colour(path, item),
            thickness=6.0,
        )
        found = msg.ImageAnnotations(timestamp=stamp, points=[marks])
        self._channel(f"/{path}/marks", ch.ImageAnnotationsChannel).log(found, log_time=time_ns)

    def _cleared(self, path: str, _item: Cleared, time_ns: int) -> None:
        for topic, channel in self._channels.items():
            if topic == f"/{path}" or topic.startswith(f"/{path}/"):
                self._clear(channel, time_ns)

    def _clear(self, channel: Any, time_ns: int) -> None:
        if isinstance(channel, ch.SceneUpdateChannel):
            deletion = msg.SceneEntityDeletion(
                timestamp=_stamp(time_ns), type=msg.SceneEntityDeletionType.All, id=""
            )
            channel.log(msg.SceneUpdate(deletions=[deletion]), log_time=time_ns)
        elif isinstance(channel, ch.PointCloudChannel):
            empty = msg.PointCloud(timestamp=_stamp(time_ns), frame_id=_FRAME, point_stride=16)
            channel.log(empty, log_time=time_ns)

    def _origin(self, _path: str, item: Origin, _time_ns: int) -> None:
        self._local = LocalFrame(item.place)

    # over time

    def _value(self, path: str, item: Value, time_ns: int) -> None:
        channel = self._channels.get(path)
        if channel is None:
            channel = self._channels[path] = foxglove.Channel(
                f"/{path}", schema=_VALUE, context=self._context
            )
        found: dict[str, Any] = {
            "value": item.value if math.isfinite(item.value) else None,
            "unit": item.unit,
        }
        if math.isfinite(item.sigma):
            middle = 0.0 if item.error else item.value
            band = 3.0 * item.sigma
            found |= {"sigma": item.sigma, "lower": middle - band, "upper": middle + band}
        channel.log(found, log_time=time_ns)

    def _text(self, path: str, item: Text, time_ns: int) -> None:
        level = msg.LogLevel.Warning if item.warning else msg.LogLevel.Info
        found = msg.Log(timestamp=_stamp(time_ns), level=level, message=item.text, name=path)
        self._channel("/events", ch.LogChannel).log(found, log_time=time_ns)


def _enu(ned_m: Sequence[float]) -> Vector:
    return ned_m[1], ned_m[0], -ned_m[2]


def _enu_from_flu(q_ned_from_frd: Quaternion) -> Quaternion:
    return product(product(_ENU_FROM_NED, q_ned_from_frd), _FRD_FROM_FLU)


def _xyzw(q: Quaternion) -> Any:
    return msg.Quaternion(x=q[1], y=q[2], z=q[3], w=q[0])


def _at(place_enu_m: Vector) -> Any:
    x, y, z = place_enu_m
    return msg.Pose(
        position=msg.Vector3(x=x, y=y, z=z), orientation=msg.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    )


def _stamp(time_ns: int) -> Any:
    return msg.Timestamp(sec=time_ns // 1_000_000_000, nsec=time_ns % 1_000_000_000)


def _float32(name: str, offset: int) -> Any:
    return msg.PackedElementField(name=name, offset=offset, type=msg.PackedElementFieldNumericType.Float32)


def _colour(path: str, item: Placed) -> Any:
    red, green, blue = (channel / 255.0 for channel in colour_of(path, item))
    return msg.Color(r=red, g=green, b=blue, a=1.0)


def _strip(points_ned_m: NDArray[np.float64], colour: Any) -> Any:
    return msg.LinePrimitive(
        type=msg.LinePrimitiveLineType.LineStrip,
        pose=_at((0.0, 0.0, 0.0)),
        thickness=_THIN_PX,
        scale_invariant=True,
        points=[msg.Point3(x=x, y=y, z=z) for x, y, z in map(_enu, points_ned_m.tolist())],
        color=colour,
    )


def _label(text: str, place_ned_m: Sequence[float], colour: Any) -> Any:
    return msg.TextPrimitive(
        pose=_at(_enu(place_ned_m)),
        billboard=True,
        font_size=_TEXT_PX,
        scale_invariant=True,
        color=colour,
        text=text,
    )
