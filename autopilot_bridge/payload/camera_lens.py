"""Zoom and focus by the camera protocol: SET_CAMERA_ZOOM, SET_CAMERA_FOCUS, and their report CAMERA_SETTINGS.

Zoom is reported in percent of its range, linear in focal length. Focus is reported in percent from the
nearest distance (0) to infinity (100), linear in 1 / distance.
"""

import math
from typing import Final

from autopilot_bridge.mavlink import dialect
from flightsim.payload import Camera

_ZOOM_STEP: Final = 1.25
_FOCUS_STEP_PERCENT: Final = 10.0
_FULL_ZOOM_S: Final = 4.0  # from one end to the other, continuously
_FULL_FOCUS_S: Final = 4.0


class CameraLens:
    """Sets a camera's zoom and focus.

    Args:
        camera: the device.
        sensor_width_mm: converts its field of view into focal lengths.
    """

    def __init__(self, camera: Camera, *, sensor_width_mm: float) -> None:
        self._camera = camera
        self._focal_mm = 0.5 * sensor_width_mm / math.tan(0.5 * camera.parameters.model.horizontal_fov_rad)
        self._sensor_width_mm = sensor_width_mm
        self._zoom_rate = 0.0
        self._focus_rate = 0.0

    @property
    def focal_mm(self) -> float:
        """Present focal length."""
        return self._focal_mm * self._camera.zoom

    @property
    def has_zoom(self) -> bool:
        """The zoom range is not empty."""
        return self._camera.parameters.max_zoom > 1.0

    @property
    def has_focus(self) -> bool:
        """Focusing has an effect."""
        return self._camera.parameters.blur_px_m > 0.0

    @property
    def fov_rad(self) -> tuple[float, float]:
        """Present horizontal and vertical field of view."""
        model, zoom = self._camera.parameters.model, self._camera.zoom
        return (
            2.0 * math.atan(math.tan(0.5 * model.horizontal_fov_rad) / zoom),
            2.0 * math.atan(math.tan(0.5 * model.vertical_fov_rad) / zoom),
        )

    @property
    def zoom_percent(self) -> float:
        """0 to 100; NaN: there is no zoom."""
        widest = self._camera.parameters.max_zoom
        return 100.0 * (self._camera.zoom - 1.0) / (widest - 1.0) if self.has_zoom else math.nan

    @property
    def focus_percent(self) -> float:
        """0 (nearest) to 100 (infinity); NaN: automatic."""
        distance_m = self._camera.focus_distance_m
        if distance_m is None:
            return math.nan
        return 100.0 * (1.0 - self._camera.parameters.min_focus_m / distance_m)

    def reset(self) -> None:
        """Set the widest angle and automatic focus."""
        self._camera.zoom = 1.0
        self._camera.focus_distance_m = None
        self._zoom_rate = self._focus_rate = 0.0

    def zoom(self, kind: int, value: float) -> bool:
        """Execute SET_CAMERA_ZOOM; False: not accepted, and nothing changed."""
        if not (self.has_zoom and math.isfinite(value)):
            return False
        camera, longest = self._camera, self._camera.parameters.max_zoom
        if kind == dialect.ZOOM_TYPE_STEP:
            camera.zoom = camera.zoom * _ZOOM_STEP ** max(-20.0, min(20.0, value))
        elif kind == dialect.ZOOM_TYPE_CONTINUOUS:
            if abs(value) > 1.0:
                return False
            self._zoom_rate = value
            return True
        elif kind == dialect.ZOOM_TYPE_RANGE:
            if not 0.0 <= value <= 100.0:
                return False
            camera.zoom = 1.0 + 0.01 * value * (longest - 1.0)
        elif kind == dialect.ZOOM_TYPE_FOCAL_LENGTH:
            if not 0.99 <= value / self._focal_mm <= 1.01 * longest:
                return False
            camera.zoom = value / self._focal_mm
        elif kind == dialect.ZOOM_TYPE_HORIZONTAL_FOV:
            if not 0.0 < value < 180.0:
                return False
            zoom = 0.5 * self._sensor_width_mm / math.tan(math.radians(0.5 * value)) / self._focal_mm
            if not 0.99 <= zoom <= 1.01 * longest:
                return False
            camera.zoom = zoom
        else:
            return False
        self._zoom_rate = 0.0
        return True

    def focus(self, kind: int, value: float) -> bool:
        """Execute SET_CAMERA_FOCUS; False: not accepted, and nothing changed."""
        if not self.has_focus:
            return False
        if kind in (dialect.FOCUS_TYPE_AUTO, dialect.FOCUS_TYPE_AUTO_CONTINUOUS):
            self._camera.focus_distance_m = None
        elif kind == dialect.FOCUS_TYPE_AUTO_SINGLE:
            self._camera.focus_distance_m = self._camera.autofocus_m
        elif not math.isfinite(value):
            return False
        elif kind == dialect.FOCUS_TYPE_STEP:
            self._hold()
            self._set_focus(self.focus_percent + max(-20.0, min(20.0, value)) * _FOCUS_STEP_PERCENT)
        elif kind == dialect.FOCUS_TYPE_CONTINUOUS:
            if abs(value) > 1.0:
                return False
            self._hold()
            self._focus_rate = value
            return True
        elif kind == dialect.FOCUS_TYPE_RANGE:
            if not 0.0 <= value <= 100.0:
                return False
            self._set_focus(value)
        elif kind == dialect.FOCUS_TYPE_METERS:
            if not value >= self._camera.parameters.min_focus_m:
                return False
            self._camera.focus_distance_m = value
        else:
            return False
        self._focus_rate = 0.0
        return True

    @property
    def moving(self) -> bool:
        """A continuous change is in progress."""
        return self._zoom_rate != 0.0 or self._focus_rate != 0.0

    def move(self, elapsed_s: float) -> None:
        """Advance a continuous change, until the end of the range."""
        camera, longest = self._camera, self._camera.parameters.max_zoom
        if self._zoom_rate:
            camera.zoom = camera.zoom * longest ** (self._zoom_rate * elapsed_s / _FULL_ZOOM_S)
            if camera.zoom in (1.0, longest):
                self._zoom_rate = 0.0
        if self._focus_rate:
            percent = self.focus_percent + self._focus_rate * 100.0 * elapsed_s / _FULL_FOCUS_S
            self._set_focus(percent)
            if not 0.0 < percent < 100.0:
                self._focus_rate = 0.0

    def _hold(self) -> None:
        """Keep the distance found by autofocus."""
        if self._camera.focus_distance_m is None:
            self._camera.focus_distance_m = self._camera.autofocus_m

    def _set_focus(self, percent: float) -> None:
        share = 1.0 - 0.01 * max(0.0, min(100.0, percent))
        nearest_m = self._camera.parameters.min_focus_m
        self._camera.focus_distance_m = nearest_m / share if share > 1e-9 else math.inf
