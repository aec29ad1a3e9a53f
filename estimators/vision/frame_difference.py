"""Moving objects by differences of frames that are warped onto the present one (Tolman et al. 2021, section
V-A, the second source).

The difference to one earlier frame shows a moving object twice: where it is, and where it was. Where it was
differs from that frame only, so the smaller of the differences to two earlier frames shows where it is
(Kameda and Minoh 1996, with both frames in the past so that there is no delay). For that an object must have
moved by its own length, so the frames are farther apart than for the flow; a slower one leaves a ghost, which
has fewer edges than the same place had with the object on it. A difference counts as far as it is above what
an error of the registration and the parallax of heights make at the edges of the earlier frame; the object's
own edges are not in that one.
"""

from collections import deque
from dataclasses import dataclass, field
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from estimators.vision.camera import CameraGeometry
from estimators.vision.ground_registration import (
    GroundRegistration,
    Registration,
    RegistrationParameters,
    StoredFrame,
    VideoCounts,
)
from estimators.vision.moving_objects import (
    MovingObjectDetector,
    MovingObjects,
    ObjectParameters,
    ObjectPoints,
    objects_of,
)
from estimators.vision.video_frame import VideoFrame
from flightsim.foundation.checks import Count, Positive
from flightsim.foundation.options import Options

__all__ = ["FrameDifferenceDetector", "FrameDifferenceParameters"]

Array = NDArray[np.float64]
Grey = NDArray[np.uint8]

_SMOOTH_PX: Final = 3
_SOBEL_GAIN: Final = 0.125  # of a 3 x 3 Sobel, to levels per pixel
_MOST_BLOBS: Final = 60
_MOST_REACH_PX: Final = 8
_QUIET: Final = 0.98  # share of the picture in which nothing moves


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameDifferenceParameters(Options):
    """Parameters of the detector.

    Attributes:
        registration: of corners, flow and homography.
        objects: what can be an object.
        least_levels: smallest difference that counts, of 255 levels.
        noise_factor: differences count above that many times what 98 % of the picture stays below.
        slack_px: error of the registration whose differences are allowed for.
        least_px: number of pixels of an object.
        largest_m: larger differences are of no object.
    """

    registration: RegistrationParameters = field(
        default_factory=lambda: RegistrationParameters(corners=300, apart_px=9.0, baseline_s=0.8)
    )
    objects: ObjectParameters = field(default_factory=ObjectParameters)
    least_levels: Positive = 4.0
    noise_factor: Positive = 2.0
    slack_px: Positive = 0.3
    least_px: Count = 4
    largest_m: Positive = 12.0


class FrameDifferenceDetector(MovingObjectDetector):
    """What differs from two earlier frames, put together to objects.

    Args:
        camera: its geometry.
        parameters: None: the defaults.
    """

    def __init__(self, camera: CameraGeometry, parameters: FrameDifferenceParameters | None = None) -> None:
        super().__init__(camera)
        self.parameters = parameters or FrameDifferenceParameters()
        self._ground = GroundRegistration(camera, self.parameters.registration)
        self._earlier: deque[Registration] = deque()

    def detect(self, frame: VideoFrame) -> MovingObjects | None:
        p = self.parameters
        found = self._ground.add(frame)
        if found is None:
            return None
        before = next((r for r in self._earlier if r.frame.time_us == found.reference.time_us), None)
        self._earlier.append(found)
        while self._earlier[0].frame.time_us < found.reference.time_us:
            self._earlier.popleft()
        if before is None:  # the second earlier frame is not there yet
            self.counts.measured -= 1
            self.counts.starting += 1
            return None
        points = self._blobs(found, before.reference, found.homography @ before.homography)
        return objects_of(frame.time_us, points, self.camera, frame.pose, p.objects, p.least_px)

    def _blobs(self, found: Registration, second: StoredFrame, homography: Array) -> ObjectPoints:
        p = self.parameters
        parallax_px = float(np.median(np.hypot(*found.parallax_px_m.T)))
        slack_px = p.slack_px + found.sigma_px + 2.0 * found.relief_m * parallax_px
        grey: Grey = np.asarray(cv2.blur(found.frame.grey, (_SMOOTH_PX, _SMOOTH_PX)), np.uint8)
        first, first_slope = _excess(grey, found.reference.grey, found.homography, slack_px)
        other, other_slope = _excess(grey, second.grey, homography, 2.0 * slack_px)
        excess = cv2.min(first, other)
        level = max(p.least_levels, p.noise_factor * float(np.quantile(excess[::4, ::4], _QUIET)))
        _, marks = cv2.threshold(excess, level, 255, cv2.THRESH_BINARY)
        marks = cv2.morphologyEx(marks, cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
        _, _, stats, middles = cv2.connectedComponentsWithStats(marks, connectivity=8)
        stats, middles = stats[1:], middles[1:]
        area = stats[:, cv2.CC_STAT_AREA]
        extent = stats[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].max(axis=1)
        most_px = p.largest_m * max(self.camera.focal_px) / found.frame.pose.height_m
        fits = np.flatnonzero((area >= p.least_px) & (extent <= most_px))
        fits = fits[np.argsort(-area[fits], kind="stable")][:_MOST_BLOBS]
        edges = _slope(grey)
        fits = fits[[_has_edges(stats[k], edges, first_slope, other_slope) for k in fits]]
        return ObjectPoints(
            points_px=np.asarray(middles[fits], np.float64).reshape(-1, 2),
            sizes_px=extent[fits].astype(np.float64),
            weights=area[fits].astype(np.int64),
        )

    @property
    def counts(self) -> VideoCounts:
        return self._ground.counts

    def reset(self) -> None:
        self._ground.reset()
        self._earlier.clear()


def _slope(grey: Grey) -> Grey:
    """Slope of a picture, levels per pixel."""
    return np.asarray(
        cv2.max(
            cv2.convertScaleAbs(cv2.Sobel(grey, cv2.CV_16S, 1, 0), alpha=_SOBEL_GAIN),
            cv2.convertScaleAbs(cv2.Sobel(grey, cv2.CV_16S, 0, 1), alpha=_SOBEL_GAIN),
        ),
        np.uint8,
    )


def _excess(grey: Grey, earlier: Grey, homography: Array, slack_px: float) -> tuple[Grey, Grey]:
    """Magnitude of the difference to an earlier frame that is warped by the ground's homography, less what a
    shift by `slack_px` makes of that frame, 0 where it did not reach; and the slope of that frame.
    """
    height, width = grey.shape
    warped = cv2.warpPerspective(
        cv2.blur(earlier, (_SMOOTH_PX, _SMOOTH_PX)),
        homography,
        (width, height),
        dst=grey.copy(),
        borderMode=cv2.BORDER_TRANSPARENT,
    )
    slope = _slope(np.asarray(warped, np.uint8))
    reach = min(int(slack_px), _MOST_REACH_PX)
    near = cv2.dilate(slope, np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)) if reach else slope
    allowed = cv2.convertScaleAbs(near, alpha=slack_px)
    return np.asarray(cv2.subtract(cv2.absdiff(grey, warped), allowed), np.uint8), slope


def _has_edges(stat: NDArray[np.int32], now: Grey, *before: Grey) -> bool:
    """Whether a blob has more edges now than in the earlier frames; a place that was left has fewer."""
    left, top, width, height = stat[:4].tolist()
    rows, columns = slice(max(0, top - 1), top + height + 1), slice(max(0, left - 1), left + width + 1)
    return int(now[rows, columns].sum()) > max(int(slope[rows, columns].sum()) for slope in before)
