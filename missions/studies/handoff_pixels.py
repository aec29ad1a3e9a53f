"""The study `handoff` in pixels: what moves in a frame is found by the front end in a rendered picture."""

import math

import numpy as np
from numpy.typing import NDArray

from estimators.vision.ground_points import on_ground
from missions.embedded.walker_pictures import WalkerPictures
from missions.studies.handoff_world import GroundPoints, HandoffSetting, HandoffWorld

__all__ = ["PixelWorld"]

Array = NDArray[np.float64]


class PixelWorld(HandoffWorld):
    """The same world; noise, misses and false points are those of the pictures, and not of the setting."""

    def __init__(self, setting: HandoffSetting, seed: int) -> None:
        super().__init__(setting, seed)
        self._pictures = tuple(WalkerPictures(2 * seed + which) for which in range(2))

    def frame(self, which: int, pointing: tuple[float, float]) -> GroundPoints | None:
        s, a, pictures = self.setting, self._aircraft[which], self._pictures[which]
        roll, pitch = a.attitude_error.tolist()
        height_m = a.height_m + float(a.rng.normal(0.0, s.height_sigma_m))
        moving = pictures.moving(
            self.time_us,
            np.array([*a.place, -a.height_m]),
            a.heading_rad,
            pointing,
            (self.targets, self._headings),
            tilt_rad=(roll, pitch),
            height_m=height_m,
        )
        if moving is None:
            return None
        directions, looks = moving
        sigma = math.hypot(pictures.sigma, 0.3 * s.tilt_sigma_rad)  # as in the world of points
        places, covariances = on_ground(directions, height_m, sigma)
        below = np.isfinite(places).all(axis=1)
        return GroundPoints(places=places[below], covariances=covariances[below], looks=looks[below])
