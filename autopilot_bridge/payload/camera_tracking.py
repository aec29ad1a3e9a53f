"""Tracking of a detection in the picture (CAMERA_TRACK_POINT, CAMERA_TRACK_RECTANGLE).

Positions in the picture are fractions of its width and height from the upper left corner, as in the protocol.
"""

import math
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from flightsim.payload import CameraFrame, Detection, PinholeModel

_COASTING_US: Final = 2_000_000
_REACH: Final = 0.05  # distance around a requested point
_GATE: Final = 0.12  # from frame to frame
_LEAST_SIDE: Final = 0.01


@dataclass(frozen=True, slots=True)
class TrackedThing:
    """The tracked target, with its last position in the picture."""

    x: float
    y: float
    size: float
    tag_id: int
    time_us: int
    detection: Detection


class CameraTracker:
    """Tracks one detection from frame to frame.

    Attributes:
        mode: CAMERA_TRACKING_MODE.
        thing: the tracked target; None: none.
    """

    def __init__(self, model: PinholeModel) -> None:
        self._model = model
        self.mode = int(dialect.CAMERA_TRACKING_MODE_NONE)
        self.thing: TrackedThing | None = None
        self._frame: CameraFrame | None = None
        self._lost = False

    def follow_point(self, x: float, y: float, radius: float) -> bool:
        """Track the detection at a point; False: there is none."""
        reach = radius if 0.0 < radius <= 1.0 else _REACH
        return self._begin(dialect.CAMERA_TRACKING_MODE_POINT, x, y, max(reach, _REACH))

    def follow_rectangle(self, left: float, top: float, right: float, bottom: float) -> bool:
        """Track the detection in a rectangle; False: there is none."""
        if not (left < right and top < bottom):
            return False
        half = 0.5 * max(right - left, bottom - top, 2.0 * _LEAST_SIDE)
        middle = 0.5 * (left + right), 0.5 * (top + bottom)
        return self._begin(dialect.CAMERA_TRACKING_MODE_RECTANGLE, *middle, half)

    def stop(self) -> None:
        """Stop tracking."""
        self.mode = int(dialect.CAMERA_TRACKING_MODE_NONE)
        self.thing = None
        self._lost = False

    def update(self, frame: CameraFrame) -> None:
        """Update from a new frame."""
        self._frame = frame
        thing = self.thing
        if thing is None:
            return
        found = self._nearest(frame, thing.x, thing.y, _GATE, thing.tag_id)
        if found is not None:
            self.thing = found
        elif frame.time_us - thing.time_us > _COASTING_US:
            self.stop()
            self._lost = True

    def status(self) -> int:
        """CAMERA_TRACKING_STATUS_FLAGS."""
        if self.thing is None:
            lost = dialect.CAMERA_TRACKING_STATUS_FLAGS_ERROR
            return int(lost if self._lost else dialect.CAMERA_TRACKING_STATUS_FLAGS_IDLE)
        fresh = self._frame is not None and self.thing.time_us == self._frame.time_us
        active = int(dialect.CAMERA_TRACKING_STATUS_FLAGS_ACTIVE)
        return active if fresh else active | int(dialect.CAMERA_TRACKING_STATUS_FLAGS_COASTING)

    def message(self) -> MAVLinkMessage:
        """CAMERA_TRACKING_IMAGE_STATUS."""
        message = dialect.MAVLink_camera_tracking_image_status_message(
            tracking_status=self.status(),
            tracking_mode=self.mode,
            target_data=0,
            point_x=math.nan,
            point_y=math.nan,
            radius=math.nan,
            rec_top_x=math.nan,
            rec_top_y=math.nan,
            rec_bottom_x=math.nan,
            rec_bottom_y=math.nan,
        )
        thing = self.thing
        if thing is None:
            return message
        message.target_data = dialect.CAMERA_TRACKING_TARGET_DATA_IN_STATUS
        half = max(0.5 * thing.size, 0.5 * _LEAST_SIDE)
        if self.mode == dialect.CAMERA_TRACKING_MODE_POINT:
            message.point_x, message.point_y, message.radius = thing.x, thing.y, half
        elif self.mode == dialect.CAMERA_TRACKING_MODE_RECTANGLE:
            half_height = half * self._model.width_px / self._model.height_px
            message.rec_top_x, message.rec_top_y = thing.x - half, thing.y - half_height
            message.rec_bottom_x, message.rec_bottom_y = thing.x + half, thing.y + half_height
        return message

    def _begin(self, mode: int, x: float, y: float, reach: float) -> bool:
        if self._frame is None or not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0):
            return False
        found = self._nearest(self._frame, x, y, reach, None)
        if found is None:
            return False
        self.thing, self.mode, self._lost = found, int(mode), False
        return True

    def _nearest(
        self, frame: CameraFrame, x: float, y: float, reach: float, tag_id: int | None
    ) -> TrackedThing | None:
        model = self._model
        best, thing = reach, None
        for detection in frame.detections:
            if tag_id is not None and detection.target_id != tag_id:
                continue
            place = detection.u_px / model.width_px, detection.v_px / model.height_px
            distance = math.hypot(place[0] - x, (place[1] - y) * model.height_px / model.width_px)
            if distance <= best:
                best = distance
                size = detection.size_rad * model.focal_px / model.width_px
                thing = TrackedThing(*place, size, detection.target_id, frame.time_us, detection)
        return thing
