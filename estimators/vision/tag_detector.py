"""Detector of AprilTags of the family 36h11 in pictures, by the AprilTag 3 library (Wang and Olson 2016).

The corners are refined to fractions of a pixel, freed of the lens distortion, and give the tag's pose by the
solution for squares of Collins and Bartoli (2014, IPPE).
"""

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from apriltag import apriltag
from numpy.typing import NDArray

from estimators.vision.camera import CameraGeometry
from estimators.vision.tag_parameters import TagDetectorParameters

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

_LEAST_SIDE_PX: Final = 8
"""A tag is eight cells across, so in less none is read; below 3 pixels the library ends the process."""
_CORNERS: Final = "lb-rb-rt-lt"  # the library's name for the corners and their order
_FROM_TOP_LEFT: Final = [1, 0, 3, 2]
"""Of those corners, in our order: the printed tag's top is the library's bottom."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TagDetection:
    """One tag in one picture.

    Attributes:
        tag_id: its number.
        corners_px: (4, 2), from the tag's top left clockwise.
        centre_px: where its centre is seen: of the diagonals' intersection, not of the corners' mean.
        angle_x_rad, angle_y_rad: of the centre's ray off the optical axis, right and down, each in its plane
            (LANDING_TARGET).
        size_rad: angle that the mean side covers.
        position_camera_m: (3,) of its centre in the camera frame.
        r_camera_from_tag: (3, 3); the tag's x to its right, y to its top, z out of it.
        reprojection_px: root mean square distance of the corners from those of the pose.
    """

    tag_id: int
    corners_px: Array
    centre_px: tuple[float, float]
    angle_x_rad: float
    angle_y_rad: float
    size_rad: float
    position_camera_m: Array
    r_camera_from_tag: Array
    reprojection_px: float

    @property
    def distance_m(self) -> float:
        """Distance of the centre from the camera."""
        return float(np.linalg.norm(self.position_camera_m))


class TagDetector:
    """Finds tags in the pictures of one camera.

    Args:
        camera: its geometry.
        parameters: None: the defaults.
    """

    def __init__(self, camera: CameraGeometry, parameters: TagDetectorParameters | None = None) -> None:
        self.camera = camera
        p = self.parameters = parameters or TagDetectorParameters()
        self._detector = apriltag("tag36h11", threads=1, maxhamming=p.corrected_bits, decimate=1.0)
        self._wanted = frozenset(p.tag_ids)
        self._sizes_m = dict(p.sizes_m)

    def detect(
        self, picture: Picture, *, corner_px: tuple[int, int] | None = None
    ) -> tuple[TagDetection, ...]:
        """The tags in a picture (height, width) or (height, width, 3) BGR, from left to right.

        Args:
            picture: the whole picture, or a part of it.
            corner_px: column and row of the camera's picture at which the part begins; None: it is the whole.

        Raises:
            EstimatorError: the whole picture has another size than the camera's.
        """
        if corner_px is None:
            self.camera.check_size(picture)
        grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY) if picture.ndim == 3 else picture
        if min(grey.shape) < _LEAST_SIDE_PX:
            return ()
        left_top = np.array(corner_px or (0, 0))
        found = []
        for seen in self._detector.detect(np.ascontiguousarray(grey)):
            tag_id, corners_px = int(seen["id"]), np.asarray(seen[_CORNERS])[_FROM_TOP_LEFT] + left_top
            if self._wanted and tag_id not in self._wanted:
                continue
            detection = self._measured(tag_id, corners_px)
            if detection is not None:
                found.append(detection)
        found.sort(key=lambda detection: detection.centre_px)
        return tuple(found)

    def _measured(self, tag_id: int, corners_px: Array) -> TagDetection | None:
        """A tag's angles and pose; None: no pose before the camera has such corners."""
        half_m = 0.5 * self._sizes_m.get(tag_id, self.parameters.size_m)
        square = half_m * np.array([(-1.0, 1.0, 0.0), (1.0, 1.0, 0.0), (1.0, -1.0, 0.0), (-1.0, -1.0, 0.0)])
        rays = self.camera.rays(corners_px)
        solved, turn, place = cv2.solvePnP(square, rays, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE_SQUARE)
        if not solved or not float(place[2, 0]) > 0.0:
            return None
        turn, place = cv2.solvePnPRefineLM(square, rays, np.eye(3), None, turn, place)
        rotation = np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)
        position = np.asarray(place, dtype=np.float64).ravel()
        seen = self.camera.pixels(square @ rotation.T + position)
        off_px = float(np.sqrt(np.mean(np.sum((seen - corners_px) ** 2, axis=1))))
        centre = self.camera.pixels(position[None])[0]
        sides = np.linalg.norm(np.diff(np.vstack((rays, rays[:1])), axis=0), axis=1)
        return TagDetection(
            tag_id=tag_id,
            corners_px=corners_px,
            centre_px=(float(centre[0]), float(centre[1])),
            angle_x_rad=math.atan2(position[0], position[2]),
            angle_y_rad=math.atan2(position[1], position[2]),
            size_rad=2.0 * math.atan(0.5 * float(sides.mean())),
            position_camera_m=position,
            r_camera_from_tag=rotation,
            reprojection_px=off_px,
        )


def draw_detections(picture: Picture, detections: tuple[TagDetection, ...]) -> Picture:
    """A copy of a picture (height, width, 3) with the outline and the number of each tag."""
    drawn = picture.copy()
    for found in detections:
        outline = np.round((found.corners_px - 0.5) * 16).astype(np.int32)
        cv2.polylines(drawn, [outline], True, (0, 255, 0), 2, cv2.LINE_AA, 4)
        place = (found.corners_px.max(axis=0) + 4).astype(int).tolist()
        text = f"{found.tag_id}: {found.distance_m:.1f} m"
        for colour, width in (((0, 0, 0), 4), ((255, 255, 255), 1)):
            cv2.putText(drawn, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.6, colour, width, cv2.LINE_AA)
    return drawn
