"""From a camera's view to its picture."""

import math
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import NotNegative, Positive, require_not_negative
from flightsim.foundation.options import Options
from flightsim.payload.camera_model import PinholeModel, camera_from_gimbal
from flightsim.payload.camera_view import CameraView, TargetView
from flightsim.payload.imager import ImagerParameters
from flightsim.payload.target_shape import TargetShape, paint_of
from flightsim.payload.terrain import Terrain
from flightsim.picture import landscape_kernel as k
from flightsim.picture.exposure import Exposure
from flightsim.picture.ground_texture import ground_texture
from flightsim.picture.pose import rotation_of
from flightsim.picture.target_bodies import draw_body
from flightsim.picture.target_marks import draw_ball, draw_tag, shows_tag, tag_box, tag_may_show
from flightsim.picture.window import Window

Picture = NDArray[np.uint8]

_KEPT: Final = 4  # sizes and zooms at a time
_COVERED: Final = 12  # grey of a camera that is put away


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenery(Options):
    """The scenery besides the targets: fields of 100 m with tracks between them, a mark at home.

    Attributes:
        runway_length_m: length of a runway with its middle at home; 0: no runway.
        runway_width_m, runway_heading_rad: of it.
        visibility_m: over which haze takes 63 % of the contrast.
        sun_azimuth_rad, sun_elevation_rad: where light comes from.
    """

    runway_length_m: NotNegative = 0.0
    runway_width_m: Positive = 20.0
    runway_heading_rad: float = 0.0
    visibility_m: Positive = 6000.0
    sun_azimuth_rad: float = math.radians(150.0)
    sun_elevation_rad: float = math.radians(45.0)


class Renderer:
    """Makes pictures for one camera.

    Args:
        model: the camera's geometry at zoom 1.
        aperture_px_m: blur of what is far off when focused near: diameter in pixels times distance in metres
            at zoom 1 (thin lens). 0: all is sharp always.
        scenery: of the world.
        imager: lens and sensor; ideal by default.
        seed: of the noise.
        terrain: heights of the ground, on which the targets stand then; None: it is level. It must not be
            steeper than the rays that meet it: one place is found for each, what hides another is not.

    Raises:
        ValueError: the distortion folds the picture.
    """

    def __init__(
        self,
        model: PinholeModel,
        *,
        aperture_px_m: float = 0.0,
        scenery: Scenery | None = None,
        imager: ImagerParameters | None = None,
        seed: int = 0,
        terrain: Terrain | None = None,
    ) -> None:
        require_not_negative(aperture_px_m=aperture_px_m)
        self.model = model
        self.scenery = scenery or Scenery()
        self._aperture_px_m = aperture_px_m
        self._texture = ground_texture()
        self._imager = imager or ImagerParameters()
        self._seed = seed
        self._terrain = terrain
        self._heights = np.zeros((0, 0)) if terrain is None else np.ascontiguousarray(terrain.height_m)
        self._grid = (
            np.zeros(3) if terrain is None else np.array([terrain.south_m, terrain.west_m, terrain.spacing_m])
        )
        self._exposures: dict[tuple[int, float], Exposure] = {}
        self._exposure(model.width_px, 1.0)
        numbers = self._numbers = np.zeros(k.SCENERY)
        s = self.scenery
        numbers[k.RUNWAY_LENGTH_M] = s.runway_length_m
        numbers[k.RUNWAY_WIDTH_M] = s.runway_width_m
        numbers[k.RUNWAY_COSINE] = math.cos(s.runway_heading_rad)
        numbers[k.RUNWAY_SINE] = math.sin(s.runway_heading_rad)
        numbers[k.VISIBILITY_M] = s.visibility_m
        level = math.cos(s.sun_elevation_rad)
        numbers[k.SUN_NED] = (
            level * math.cos(s.sun_azimuth_rad),
            level * math.sin(s.sun_azimuth_rad),
            -math.sin(s.sun_elevation_rad),
        )

    def render(
        self, view: CameraView, *, width_px: int | None = None, window: Window | None = None
    ) -> Picture:
        """The picture (height, width, 3), BGR, at the model's size or scaled to another width.

        Args:
            view: the view.
            width_px: width of the picture; None: the model's.
            window: a part of the picture; None: all of it.
        """
        model = self.model
        width = model.width_px if width_px is None else width_px
        height = max(1, round(model.height_px * width / model.width_px))
        if view.covered:
            shape = (height, width) if window is None else (window.height, window.width)
            return np.full((*shape, 3), _COVERED, np.uint8)
        exposure = self._exposure(width, view.zoom)
        size_px = exposure.ideal_px
        if window is None:
            window = Window(left=0, top=0, width=width, height=height)
            part = Window(left=0, top=0, width=size_px[0], height=size_px[1])
        else:
            part = exposure.ideal_window(window)
        picture: Picture = np.empty((part.height, part.width, 3), np.uint8)
        scale = width / model.width_px
        focal_px = model.focal_px * view.zoom * scale
        r_ned_from_mount = rotation_of(view.q_ned_from_mount)
        eye = np.array(view.eye_ned_m)
        k.paint_landscape(
            r_ned_from_mount,
            eye,
            focal_px,
            0.5 * size_px[0] - part.left,
            0.5 * size_px[1] - part.top,
            self._numbers,
            self._texture,
            self._heights,
            self._grid,
            picture,
        )
        camera_from_ned = camera_from_gimbal(r_ned_from_mount).T
        sun = self._numbers[k.SUN_NED]

        def distance_m(index: int) -> float:
            return math.dist(view.targets[index].position_ned_m, view.eye_ned_m)

        for index in sorted(range(len(view.targets)), key=distance_m, reverse=True):
            target = self._placed(view.targets[index])
            if shows_tag(target):
                draw_tag(picture, part, size_px, target, camera_from_ned, eye, focal_px)
            elif target.shape is not TargetShape.BALL:
                paint = paint_of(index)
                draw_body(picture, part, size_px, target, paint, camera_from_ned, eye, focal_px, sun)
            else:
                draw_ball(picture, part, size_px, target, camera_from_ned, eye, focal_px, sun)
        sharp = self._defocused(picture, view, r_ned_from_mount, scale)
        return exposure.expose(sharp, view, window, part)

    def _placed(self, target: TargetView) -> TargetView:
        """A target on the terrain."""
        if self._terrain is None:
            return target
        north, east, down = target.position_ned_m
        height = float(self._terrain.at(np.array([north]), np.array([east]))[0])
        return replace(target, position_ned_m=(north, east, down - height))

    def tag_window(self, view: CameraView, margin_px: int) -> Window | None:
        """The part of the picture around the tags of a view; None: all of it, or nothing, may be needed."""
        model = self.model
        focal_px = model.focal_px * view.zoom
        box = tag_box(view, focal_px)
        if box is None:
            return None
        centre = np.array(model.centre_px)
        distortion = self._imager.distortion
        corners = np.array([(x, y) for x in (box[0][0], box[1][0]) for y in (box[0][1], box[1][1])])
        reach = np.hypot(*self._exposure(model.width_px, view.zoom).ideal_px)
        if np.hypot(*corners.T).max() > reach:  # beyond what the model of the distortion is for
            return None
        seen = distortion.distorted(corners / focal_px) * focal_px + centre
        low, high = seen.min(axis=0).tolist(), seen.max(axis=0).tolist()
        return Window.around(
            (low[0], low[1]), (high[0], high[1]), margin_px, (model.width_px, model.height_px)
        )

    def may_show_tag(self, view: CameraView, margin: float = 0.05) -> bool:
        """Whether a tag, or a part of one, may lie in the picture of a view; False is certain.

        Args:
            view: camera and targets.
            margin: around the picture, in focal lengths.
        """
        width, height = self._exposure(self.model.width_px, 1.0).ideal_px
        focal_px = self.model.focal_px
        return tag_may_show(view, 0.5 * width / focal_px + margin, 0.5 * height / focal_px + margin)

    def _exposure(self, width_px: int, zoom: float) -> Exposure:
        """Lens and sensor for a size and a zoom; a few are kept."""
        key = (width_px, zoom)
        if key not in self._exposures:
            model = self.model
            made = Exposure(
                self._imager,
                width_px=width_px,
                height_px=max(1, round(model.height_px * width_px / model.width_px)),
                focal_px=model.focal_px * zoom * width_px / model.width_px,
                seed=self._seed,
            )
            if len(self._exposures) == _KEPT:
                del self._exposures[next(iter(self._exposures))]
            self._exposures[key] = made
        return self._exposures[key]

    def _defocused(
        self, picture: Picture, view: CameraView, r_ned_from_mount: NDArray[np.float64], scale: float
    ) -> Picture:
        """Blur by the distance in the middle of the picture: one circle of confusion for all of it."""
        sine = float(r_ned_from_mount[2, 0])
        height_m = max(0.05, -view.eye_ned_m[2])
        nearness = max(0.0, sine / height_m)
        # thin lens: the circle grows with the square of the focal length, at one aperture number
        circle_px = self._aperture_px_m * view.zoom**2 * scale * abs(1.0 / view.focus_distance_m - nearness)
        if circle_px < 0.5:
            return picture
        sigma = min(40.0, 0.35 * circle_px)
        blurred: Picture = cv2.GaussianBlur(picture, (0, 0), sigma).astype(np.uint8, copy=False)
        return blurred
