"""Registration of a video to the ground: corners that are followed from frame to frame, and the homography
that takes the ground of an earlier frame to the present one.

Source: Tolman et al. 2021, section V-A: corners (Shi and Tomasi 1994), optical flow (Lucas and Kanade 1981,
pyramids by Bouguet 2001), homography of the ground. Here a corner is kept only if the flow backwards finds
where it came from (Kalal, Mikolajczyk and Matas 2010), and the homography is MAGSAC++ (Barath et al. 2020) in
OpenCV. Between two neighbouring frames a walker moves by less than the noise of the flow, so the earlier
frame is one from some time ago: the corners are followed through all frames, but compared over that time.
"""

import functools
import math
from collections import deque
from dataclasses import dataclass, field, fields
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from estimators.vision.camera import CameraGeometry
from estimators.vision.parallax import parallax_px_m
from estimators.vision.video_frame import CameraPose, VideoFrame
from flightsim.foundation.checks import Count, Positive, Share
from flightsim.foundation.options import Options

__all__ = ["GroundRegistration", "Registration", "RegistrationParameters", "StoredFrame", "VideoCounts"]

Array = NDArray[np.float64]
Array32 = NDArray[np.float32]
Ids = NDArray[np.int64]
Grey = NDArray[np.uint8]

_LEAST_CORNERS: Final = 12
_MAGSAC_ITERATIONS: Final = 300
_MAGSAC_CONFIDENCE: Final = 0.999
_STRIPS: Final = 4  # new corners are searched in one part of the picture per frame
_SIGMA_OF_MEDIAN: Final = 1.4826  # standard deviation of a normal error with a median magnitude of 1
_CORNER_BLOCK_PX: Final = 5
_ON_GROUND: Final = 9.0  # squared Mahalanobis distance


@dataclass(frozen=True, slots=True, kw_only=True)
class RegistrationParameters(Options):
    """Parameters of corners, flow and homography.

    Attributes:
        corners: largest number of corners.
        quality: of the weakest corner as a share of the strongest of its part of the picture.
        apart_px: least distance of two corners.
        window_px: side of the window of the flow.
        levels: of the pyramids, beside the picture itself.
        back_px: largest distance by which the flow there and back may miss.
        baseline_s: time over which motion is measured.
        longest_gap_s: after a longer time between two frames everything starts anew.
        life_s: age at which corners of the ground are replaced, so that those of objects that come into view
            find room.
        ground_px: scale of the homography's inliers.
        ground_share: least share of corners that lie on the ground.
        least_sigma_px: noise of the flow is at least that.
        relief_m: standard deviation of heights that are taken for the ground's, in any case.
    """

    corners: Count = 500
    quality: Share = 0.004
    apart_px: Positive = 6.0
    window_px: Count = 9
    levels: Count = 3
    back_px: Positive = 0.2
    baseline_s: Positive = 0.7
    longest_gap_s: Positive = 0.8
    life_s: Positive = 2.0
    ground_px: Positive = 1.5
    ground_share: Share = 0.5
    least_sigma_px: Positive = 0.15
    relief_m: Positive = 0.5

    def check_together(self) -> None:
        if self.longest_gap_s < self.baseline_s:
            raise EstimatorError(
                f"longest_gap_s {self.longest_gap_s:g} is below baseline_s {self.baseline_s:g}; "
                "give at least as much"
            )


@dataclass(slots=True)
class VideoCounts:
    """What became of the frames of a video.

    Attributes:
        frames: all that were given.
        measured: searched for moving objects.
        wrong_size: not of the camera's size, or not of 8 bits.
        not_newer: not newer than the one before.
        repeated: the same picture again: the stream has stopped.
        restarted: too long after the one before, so that everything started anew.
        starting: no earlier frame to compare with yet.
        few_corners: too few corners were followed: no texture, darkness, fog.
        no_ground: no homography explains most corners, or the ground it shows is not under the camera.
    """

    frames: int = 0
    measured: int = 0
    wrong_size: int = 0
    not_newer: int = 0
    repeated: int = 0
    restarted: int = 0
    starting: int = 0
    few_corners: int = 0
    no_ground: int = 0

    def as_dict(self) -> dict[str, int]:
        """Counts by name."""
        return {f.name: getattr(self, f.name) for f in fields(self)}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredFrame:
    """An earlier frame.

    Attributes:
        time_us: of its exposure.
        grey: its picture, without lens distortion.
        pose: of the camera.
        ids: (n,) its corners, ascending.
        points_px: (n, 2) where they were, in OpenCV's pixels (the first has its middle at 0).
        strengths: (n,) smaller eigenvalue of the flow's normal matrix: the noise of a corner falls with it.
    """

    time_us: int
    grey: Grey
    pose: CameraPose
    ids: Ids
    points_px: Array32
    strengths: Array32


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Registration:
    """The present frame beside an earlier one. Pixels are OpenCV's.

    Attributes:
        frame, reference: both frames.
        homography: (3, 3) from the ground in the reference to the ground in the frame.
        points_px: (n, 2) corners in the frame.
        ground_px: (n, 2) where each would be if it stood on the ground.
        parallax_px_m: (n, 2) way that a height of 1 m over the ground moves it by.
        sigma_px: noise of the corners on the ground, per axis.
        relief_m: standard deviation of their heights.
        normalised: (n,) squared Mahalanobis distance of each from the ground.
    """

    frame: StoredFrame
    reference: StoredFrame
    homography: Array
    points_px: Array
    ground_px: Array
    parallax_px_m: Array
    sigma_px: float
    relief_m: float
    normalised: Array

    @property
    def elapsed_s(self) -> float:
        """Time between both."""
        return (self.frame.time_us - self.reference.time_us) * 1e-6


@dataclass(slots=True)
class _Tracks:
    """Corners of the newest frame, and when each was found."""

    ids: Ids = field(default_factory=lambda: np.zeros(0, np.int64))
    points_px: Array32 = field(default_factory=lambda: np.zeros((0, 2), np.float32))
    strengths: Array32 = field(default_factory=lambda: np.zeros(0, np.float32))
    found_us: Ids = field(default_factory=lambda: np.zeros(0, np.int64))
    next_id: int = 0

    def keep(self, kept: NDArray[np.bool_]) -> None:
        """Drop the others."""
        self.ids, self.points_px = self.ids[kept], self.points_px[kept]
        self.strengths, self.found_us = self.strengths[kept], self.found_us[kept]

    def add(self, points_px: Array32, time_us: int) -> None:
        """Add new corners."""
        count = len(points_px)
        self.ids = np.concatenate((self.ids, self.next_id + np.arange(count)))
        self.next_id += count
        self.points_px = np.concatenate((self.points_px, points_px))
        self.strengths = np.concatenate((self.strengths, np.ones(count, np.float32)))
        self.found_us = np.concatenate((self.found_us, np.full(count, time_us)))


class GroundRegistration:
    """Follows the ground through a video.

    Args:
        camera: geometry; lens distortion is taken out of the pictures first.
        parameters: None: the defaults.

    Attributes:
        counts: what became of the frames.
    """

    def __init__(self, camera: CameraGeometry, parameters: RegistrationParameters | None = None) -> None:
        self.camera = camera
        self.parameters = parameters or RegistrationParameters()
        self.counts = VideoCounts()
        self._past: deque[StoredFrame] = deque()
        self._tracks = _Tracks()
        self._strip = 0
        self._step: Array | None = None  # affine map (3, 2) of the ground between the last two frames
        self._ideal = _ideal_map(camera) if camera.distortion else None

    def reset(self) -> None:
        """Discard all earlier frames."""
        self._past.clear()
        self._tracks = _Tracks(next_id=self._tracks.next_id)
        self._step = None

    def add(self, frame: VideoFrame) -> Registration | None:
        """Process a frame; None: it is not measured, and `counts` has the reason."""
        counts = self.counts
        counts.frames += 1
        grey = self._grey(frame.pixels)
        if grey is None:
            counts.wrong_size += 1
            return None
        newest = self._past[-1] if self._past else None
        if newest is not None:
            gap_us = frame.time_us - newest.time_us
            if gap_us <= 0 and gap_us > -5_000_000:
                counts.not_newer += 1
                return None
            if not 0 < gap_us <= 1e6 * self.parameters.longest_gap_s:
                counts.restarted += 1
                self.reset()
                newest = None
            elif np.array_equal(grey, newest.grey):
                counts.repeated += 1
                return None
        if newest is not None:
            self._follow(newest.grey, grey)
        self._search(grey, frame.time_us)
        stored = StoredFrame(
            time_us=frame.time_us,
            grey=grey,
            pose=frame.pose,
            ids=self._tracks.ids,
            points_px=self._tracks.points_px,
            strengths=self._tracks.strengths,
        )
        registration = self._register(stored)
        self._past.append(stored)
        self._forget(frame.time_us)
        if registration is not None:
            counts.measured += 1
        return registration

    def earlier(self, before_us: int) -> StoredFrame | None:
        """The newest stored frame of a time or before; None: there is none."""
        return next((past for past in reversed(self._past) if past.time_us <= before_us), None)

    # inside

    def _grey(self, pixels: NDArray[np.uint8]) -> Grey | None:
        """The picture in grey, as a lens without distortion would show it."""
        size = (self.camera.height_px, self.camera.width_px)
        if pixels.dtype != np.uint8 or pixels.shape not in (size, (*size, 3)):
            return None
        grey = pixels if pixels.ndim == 2 else np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY), np.uint8)
        if self._ideal is not None:
            grey = np.asarray(
                cv2.remap(grey, *self._ideal, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
            )
        return np.array(grey, np.uint8, order="C")  # the caller may reuse its buffer

    def _follow(self, before: Grey, now: Grey) -> None:
        """Move the corners into the present frame; those that are lost are dropped."""
        p, tracks = self.parameters, self._tracks
        if not len(tracks.ids):
            return
        start = tracks.points_px
        guess = start.copy()
        if self._step is not None:  # the picture goes on moving as it did
            guess = (_homogeneous(start) @ self._step).astype(np.float32)
        flow: Any = functools.partial(
            cv2.calcOpticalFlowPyrLK,
            winSize=(p.window_px, p.window_px),
            maxLevel=p.levels,
            criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.02),
            flags=cv2.OPTFLOW_USE_INITIAL_FLOW | cv2.OPTFLOW_LK_GET_MIN_EIGENVALS,
        )
        there, found, strengths = flow(before, now, start[:, None], guess[:, None].copy())
        back, found_back, _ = flow(now, before, there, start[:, None].copy())
        ends = there[:, 0]
        missed = np.hypot(*(back[:, 0] - start).T)
        size = (self.camera.width_px, self.camera.height_px)
        inside = np.all((ends >= 1.0) & (ends < np.array(size, np.float32) - 2.0), axis=1)
        kept = (found.ravel() == 1) & (found_back.ravel() == 1) & (missed < p.back_px) & inside
        tracks.points_px, tracks.strengths = ends, strengths.ravel()
        tracks.keep(kept)
        self._step = None
        if len(tracks.ids) >= _LEAST_CORNERS:
            step, *_ = np.linalg.lstsq(_homogeneous(start[kept]), tracks.points_px, rcond=None)
            self._step = np.asarray(step, np.float64)

    def _search(self, grey: Grey, time_us: int) -> None:
        """Find new corners in one part of the picture, apart from those that are followed."""
        p, tracks = self.parameters, self._tracks
        room = p.corners - len(tracks.ids)
        height = grey.shape[0]
        strips = range(_STRIPS) if not len(tracks.ids) else (self._strip,)
        self._strip = (self._strip + 1) % _STRIPS
        for strip in strips:
            if room <= 0:
                return
            top, bottom = strip * height // _STRIPS, (strip + 1) * height // _STRIPS
            within = (tracks.points_px[:, 1] >= top) & (tracks.points_px[:, 1] < bottom)
            wanted = min(room, p.corners // _STRIPS - int(within.sum()))
            if wanted <= 0:
                continue
            free = np.full((bottom - top, grey.shape[1]), 255, np.uint8)
            for x, y in np.round(tracks.points_px[within]).astype(int).tolist():
                cv2.circle(free, (x, y - top), round(p.apart_px), 0, -1)
            corners = cv2.goodFeaturesToTrack(
                grey[top:bottom], wanted, p.quality, p.apart_px, mask=free, blockSize=_CORNER_BLOCK_PX
            )
            if corners is None:
                continue
            tracks.add(np.asarray(corners[:, 0] + (0.0, top), np.float32), time_us)
            room -= len(corners)

    def _register(self, frame: StoredFrame) -> Registration | None:
        p, counts = self.parameters, self.counts
        reference = self.earlier(frame.time_us - round(1e6 * p.baseline_s))
        if reference is None:
            counts.starting += 1
            return None
        both, of_reference, of_frame = np.intersect1d(
            reference.ids, frame.ids, assume_unique=True, return_indices=True
        )
        if len(both) < _LEAST_CORNERS:
            counts.few_corners += 1
            return None
        start = reference.points_px[of_reference].astype(np.float64)
        end = frame.points_px[of_frame].astype(np.float64)
        homography, ground = _homography(start, end, p.ground_px)
        if homography is None or ground.mean() < p.ground_share:
            counts.no_ground += 1
            return None
        expected = cv2.perspectiveTransform(start[:, None], homography)[:, 0]
        parallax = parallax_px_m(self._matrix, homography, start, reference.pose)
        if parallax is None:
            counts.no_ground += 1
            return None
        off = end - expected
        strengths = frame.strengths[of_frame].astype(np.float64)
        # weak corners have more noise than the median one
        noises = np.sqrt(np.maximum(1.0, np.median(strengths) / np.maximum(strengths, 1e-12)))
        sigma_px, relief_m = _scatter(off[ground], noises[ground], parallax[ground])
        sigma_px, relief_m = max(sigma_px, p.least_sigma_px), max(relief_m, p.relief_m)
        normalised = _distances(off, parallax, sigma_px * noises, relief_m)
        self._retire(frame, of_frame[normalised < _ON_GROUND])
        return Registration(
            frame=frame,
            reference=reference,
            homography=homography,
            points_px=end,
            ground_px=np.asarray(expected, np.float64),
            parallax_px_m=parallax,
            sigma_px=sigma_px,
            relief_m=relief_m,
            normalised=normalised,
        )

    @property
    def _matrix(self) -> Array:
        """Intrinsic matrix for OpenCV's pixels."""
        matrix = self.camera.matrix
        matrix[:2, 2] -= 0.5
        return matrix

    def _retire(self, frame: StoredFrame, on_ground: Ids) -> None:
        """Make room for new corners: the oldest ones of the ground, as many as replace all within a life."""
        since_us = frame.time_us - self._past[-1].time_us
        most = math.ceil(self.parameters.corners * since_us * 1e-6 / self.parameters.life_s)
        old = on_ground[frame.time_us - self._tracks.found_us[on_ground] > 5e5 * self.parameters.life_s]
        kept = np.ones(len(self._tracks.ids), np.bool_)
        kept[old[:most]] = False  # ids, and so ages, are in order
        self._tracks.keep(kept)

    def _forget(self, time_us: int) -> None:
        """Keep twice the baseline: frame differences compare with two earlier frames."""
        oldest_us = time_us - round(2e6 * self.parameters.baseline_s)
        while len(self._past) > 1 and self._past[1].time_us <= oldest_us:
            self._past.popleft()


def _ideal_map(camera: CameraGeometry) -> tuple[NDArray[np.int16], NDArray[np.uint16]]:
    """Fixed-point maps of `cv2.remap` to a picture without distortion."""
    columns, rows = np.meshgrid(np.arange(camera.width_px) + 0.5, np.arange(camera.height_px) + 0.5)
    rays = (np.stack((columns.ravel(), rows.ravel()), -1) - camera.centre_px) / camera.focal_px
    seen = camera.pixels(np.column_stack((rays, np.ones(len(rays))))) - 0.5
    places = seen.reshape(camera.height_px, camera.width_px, 2).astype(np.float32)
    columns_of, rows_of = np.ascontiguousarray(places[..., 0]), np.ascontiguousarray(places[..., 1])
    first, second = cv2.convertMaps(columns_of, rows_of, cv2.CV_16SC2)
    return np.asarray(first, np.int16), np.asarray(second, np.uint16)


def _homogeneous(points: Array32) -> Array:
    return np.column_stack((points, np.ones(len(points)))).astype(np.float64)


def _homography(start: Array, end: Array, scale_px: float) -> tuple[Array | None, NDArray[np.bool_]]:
    """Homography of most points, and which of them follow it. OpenCV's generator has a fixed seed."""
    found, mask = cv2.findHomography(
        start, end, cv2.USAC_MAGSAC, scale_px, maxIters=_MAGSAC_ITERATIONS, confidence=_MAGSAC_CONFIDENCE
    )
    if found is None or not np.isfinite(found).all():
        return None, np.zeros(len(start), np.bool_)
    return np.asarray(found, np.float64), mask.ravel().astype(np.bool_)


def _scatter(off: Array, noises: Array, parallax: Array) -> tuple[float, float]:
    """Noise per axis, and standard deviation of the heights, of points of the ground: by medians, since some
    of them may move. `noises` (n,) are those of the points as multiples of the result.
    """
    strength = np.hypot(*parallax.T)
    along = parallax / np.maximum(strength, 1e-9)[:, None]
    across = np.abs(off[:, 0] * along[:, 1] - off[:, 1] * along[:, 0]) / noises
    sigma_px = _SIGMA_OF_MEDIAN * float(np.median(across))
    shift = _SIGMA_OF_MEDIAN * float(np.median(np.abs(np.sum(off * along, axis=1)) / noises))
    typical = float(np.median(strength))
    relief_m = math.sqrt(max(0.0, shift**2 - sigma_px**2)) / typical if typical > 1e-6 else 0.0
    return sigma_px, relief_m


def _distances(off: Array, parallax: Array, sigmas_px: Array, relief_m: float) -> Array:
    """Squared Mahalanobis distances with the covariances sigma^2 I + relief^2 J J' (inverse by Sherman and
    Morrison).
    """
    noise, height = sigmas_px**2, relief_m**2
    dot = np.sum(off * parallax, axis=1)
    squared: Array = (
        np.sum(off * off, axis=1) - height * dot**2 / (noise + height * np.sum(parallax**2, axis=1))
    ) / noise
    return squared
