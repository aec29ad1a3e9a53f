"""Detectors of moving objects, over video of a plane that plain projective geometry makes."""

import dataclasses
import functools
import math

import cv2
import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.tracking.recursive_ransac import RansacParameters, RecursiveRansac
from estimators.vision import (
    CameraGeometry,
    CameraPose,
    CornerFlowDetector,
    CornerFlowParameters,
    FrameDifferenceDetector,
    FrameDifferenceParameters,
    RegistrationParameters,
)
from estimators.vision.ground_points import CameraAxes
from estimators.vision.parallax import parallax_px_m
from tests.estimators.vision.plane_video import CAMERA, HEIGHT_M, Plate, plane_video
from tests.slow import slow

DETECTORS = (CornerFlowDetector, FrameDifferenceDetector)
CARS = (
    Plate((0.0, 6.0), (4.0, -3.0)),
    Plate((-14.0, -12.0), (-1.0, 6.0), level=20),
    Plate((12.0, -10.0), (1.2, 0.9), sides_m=(1.6, 1.6), level=20),
)
WARM_UP = {CornerFlowDetector: 7, FrameDifferenceDetector: 16}  # frames to compare with come first


@functools.cache
def frames_of(plates, count, rate_hz=10.0):
    """Frames with true places, made once for all tests."""
    return tuple(plane_video(plates, frames=count, rate_hz=rate_hz))


def watch(detector, frames):
    """What a detector finds: for each measured frame the objects and the true places."""
    return [(found, places) for frame, places in frames if (found := detector.detect(frame)) is not None]


def scored(results, near_m=2.5):
    """Share of targets found, false objects per frame, and errors (n, 2) of those that were found."""
    hits, targets, false, errors = 0, 0, 0, []
    for found, places in results:
        targets += len(places)
        far = np.linalg.norm(found.places[:, None] - places[None], axis=-1).reshape(len(found), len(places))
        false += int((far.min(axis=1, initial=math.inf) > near_m).sum())
        for target in range(len(places)):
            if len(found) and far[:, target].min() < near_m:
                hits += 1
                errors.append(found.places[far[:, target].argmin()] - places[target])
    return hits / targets, false / len(results), np.array(errors).reshape(-1, 2)


@pytest.mark.parametrize("make", DETECTORS)
def test_objects_are_found_where_they_are(make):
    frames = frames_of(CARS, 26)
    detector = make(CAMERA)
    results = watch(detector, frames)
    detected, false, errors = scored(results)
    assert len(results) == len(frames) - WARM_UP[make] == detector.counts.measured
    assert detected > 0.85
    assert false < 0.8
    assert np.sqrt(np.mean(errors**2)) < 1.0


def test_the_flow_measures_velocities():
    results = watch(CornerFlowDetector(CAMERA), frames_of(CARS, 26))
    for index, car in enumerate(CARS[:2]):
        velocities = [
            found.velocities[np.linalg.norm(found.places - places[index], axis=1).argmin()]
            for found, places in results
        ]
        assert np.median(velocities, axis=0) == pytest.approx(car.velocity_m_s, abs=0.8)


def test_the_same_video_gives_the_same_objects():
    """And the detector keeps no reference to a buffer that the caller uses again."""
    frames = [frame for frame, _ in frames_of(CARS, 26)[:20]]
    for make in DETECTORS:
        one, other, buffer = make(CAMERA), make(CAMERA), np.empty_like(frames[0].pixels)
        for frame in frames:
            buffer[:] = frame.pixels
            first, second = one.detect(frame), other.detect(dataclasses.replace(frame, pixels=buffer))
            assert (first is None) == (second is None)
            if first is not None and second is not None:
                assert first.places.tobytes() == second.places.tobytes()


def test_measurements_make_one_track_for_each_object():
    tracker = RecursiveRansac(
        RansacParameters(noise_density=0.5, window=10, good_age=8, seed_support=4, speed_max_m_s=12.0)
    )
    detector = FrameDifferenceDetector(CAMERA)
    for index, (frame, places) in enumerate(frames_of(CARS, 32)):
        eye = CARS[0].at(0.1 * index) - places[0]
        found = detector.detect(frame)
        if found is not None:
            tracker.scan(frame.time_us, found.places + eye, found.covariances)
    tracks = tracker.tracks
    assert len(tracks) == len(CARS)
    for car in CARS:
        off = min(tracks, key=lambda track: math.dist(track.state[:2], car.at(3.1)))
        assert math.dist(off.state[:2], car.at(3.1)) < 1.5
        assert off.state[2:4] == pytest.approx(car.velocity_m_s, abs=1.0)


def roofs(height_m):
    return tuple(
        Plate((north, east), sides_m=(5.0, 5.0), height_m=height_m, level=level)
        for north, east, level in ((-20.0, 5.0, 30), (10.0, 14.0, 200), (16.0, -16.0, 30))
    )


@pytest.mark.parametrize(
    ("make", "parameters", "height_m", "relief_m"),
    [
        (CornerFlowDetector, CornerFlowParameters(), 10.0, 4.0),
        (FrameDifferenceDetector, FrameDifferenceParameters(), 4.0, 1.0),
    ],
)
def test_what_stands_up_does_not_move(make, parameters, height_m, relief_m):
    """Roofs are taken for moving objects unless such heights are expected; a car is found still."""
    frames = frames_of((CARS[0], *roofs(height_m)), 26)
    false = []
    for expected_m in (0.1, relief_m):
        registration = dataclasses.replace(parameters.registration, relief_m=expected_m)
        detector = make(CAMERA, dataclasses.replace(parameters, registration=registration))
        car, others, _ = scored([(found, places[:1]) for found, places in watch(detector, frames)])
        false.append(others)
    assert car > 0.8
    assert false[0] > 0.5
    assert false[1] < 0.35 * false[0]


def test_parallax_is_that_of_projection():
    """Against two projections of points at and over the ground."""
    rng = np.random.default_rng(3)
    matrix = CAMERA.matrix
    for _ in range(20):
        h = rng.uniform(30.0, 300.0)
        poses = [
            CameraAxes.towards(*(rng.uniform(0.3, 1.0, 2) * h).tolist(), h).axes,  # type: ignore[call-arg]
            CameraAxes.towards(*(rng.uniform(0.3, 1.0, 2) * h).tolist(), h).axes,  # type: ignore[call-arg]
        ]
        eyes = [np.array([0.0, 0.0, -h]), np.array([*(rng.uniform(-0.15, 0.15, 2) * h), -h * 1.02])]
        places = np.column_stack((rng.uniform(0.2, 1.1, (9, 2)) * h, np.zeros(9)))

        def pixels(which, points, poses=poses, eyes=eyes):
            seen = (points - eyes[which]) @ poses[which].T @ matrix.T
            return seen[:, :2] / seen[:, 2:]

        homography, _ = cv2.findHomography(pixels(0, places), pixels(1, places))
        first = pixels(0, places)
        found = parallax_px_m(
            matrix, homography, first, CameraPose(axes=CameraAxes(axes=poses[0]), height_m=h)
        )
        # the point of height z that is seen at the same pixel of the first picture
        z = 0.002 * h
        raised = eyes[0] + (places - eyes[0]) * (h - z) / h
        assert pixels(0, raised) == pytest.approx(first, abs=1e-6)
        shift = (pixels(1, raised) - pixels(1, places)) / z
        assert found == pytest.approx(shift, rel=0.03, abs=1e-3)


def test_a_homography_of_no_ground_has_no_parallax():
    pose = CameraPose(axes=CameraAxes.towards(50.0, 0.0, 60.0), height_m=60.0)
    points = np.array([(100.0, 100.0), (200.0, 120.0)])
    assert parallax_px_m(CAMERA.matrix, np.diag([1.0, 1.8, 1.0]), points, pose) is None
    assert parallax_px_m(CAMERA.matrix, np.eye(3), points, pose) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("make", DETECTORS)
def test_video_at_5_hz(make):
    detected, false, _ = scored(watch(make(CAMERA), frames_of(CARS, 16, 5.0)))
    assert detected > 0.7
    assert false < 1.5


@pytest.mark.parametrize("make", DETECTORS)
def test_frames_that_say_nothing_are_counted(make):
    frames = [frame for frame, _ in frames_of(CARS, 26)[: WARM_UP[make] + 3]]
    detector, newest = make(CAMERA), frames[-1]
    for frame in frames:
        detector.detect(frame)
    before = dataclasses.replace(detector.counts)
    assert before.measured >= 3
    assert before.frames == len(frames)

    def given(**changes):
        return detector.detect(dataclasses.replace(newest, **changes))

    assert given() is None  # the same time again
    assert given(time_us=newest.time_us - 1000) is None
    assert detector.counts.not_newer == 2
    assert given(time_us=newest.time_us + 100_000) is None  # the stream has stopped: the same picture
    assert detector.counts.repeated == 1
    for pixels in (
        np.zeros((10, 10), np.uint8),
        newest.pixels.astype(np.float32),
        np.zeros((*newest.pixels.shape, 4), np.uint8),
    ):
        assert given(time_us=newest.time_us + 200_000, pixels=pixels) is None
    assert detector.counts.wrong_size == 3
    assert given(time_us=newest.time_us + 5_000_000) is None  # too long after the last one
    assert detector.counts.restarted == 1
    assert detector.counts.starting == before.starting + 1
    assert detector.counts.frames == before.frames + 7
    assert detector.counts.measured == before.measured


@pytest.mark.parametrize("make", DETECTORS)
def test_no_texture_no_objects(make):
    """Darkness, fog, and noise alone: nothing is measured, nothing raised."""
    dark, rng = make(CAMERA), np.random.default_rng(1)
    for frame, _ in frames_of(CARS, 26)[:14]:
        flat = np.full_like(frame.pixels, 40)
        flat[0, 0] = frame.time_us % 251  # or the picture would be repeated
        assert dark.detect(dataclasses.replace(frame, pixels=flat)) is None
    assert dark.counts.few_corners > 0
    noisy = make(CAMERA)
    for frame, _ in frames_of(CARS, 26)[:20]:
        pixels = rng.integers(0, 255, frame.pixels.shape, np.uint8)
        found = noisy.detect(dataclasses.replace(frame, pixels=pixels))
        assert found is None or len(found) == 0
    assert noisy.counts.few_corners + noisy.counts.no_ground > 0


@pytest.mark.parametrize("make", DETECTORS)
@pytest.mark.parametrize("focal", [slow(0.8), 1.25])
def test_wrong_focal_length_scales_places_only(make, focal):
    """With a wrong focal length objects are found; their places are off by about the same ratio."""
    wrong = CameraGeometry(
        width_px=CAMERA.width_px,
        height_px=CAMERA.height_px,
        focal_px=(CAMERA.focal_px[0] * focal, CAMERA.focal_px[1] * focal),
        centre_px=CAMERA.centre_px,
    )
    frames = frames_of(CARS, 26)
    right, off = watch(make(CAMERA), frames), watch(make(wrong), frames)
    assert len(off) == len(right)
    assert np.mean([len(found) for found, _ in off]) == pytest.approx(
        np.mean([len(found) for found, _ in right]), abs=1.0
    )
    for found, _ in off:
        assert np.isfinite(found.places).all()
        assert np.all(np.hypot(*found.places.T) < 4.0 * HEIGHT_M)


def test_distortion_is_taken_out():
    """A picture that a lens distorts gives the places of the ideal one."""
    lens = dataclasses.replace(CAMERA, distortion=(-0.15, 0.02, 0.0, 0.0, 0.0))
    columns, rows = np.meshgrid(np.arange(CAMERA.width_px) + 0.5, np.arange(CAMERA.height_px) + 0.5)
    rays = lens.rays(np.column_stack((columns.ravel(), rows.ravel())))
    ideal = (rays * CAMERA.focal_px + CAMERA.centre_px - 0.5).astype(np.float32).reshape(*columns.shape, 2)
    frames = []
    for frame, places in frames_of(CARS, 26):
        seen = cv2.remap(frame.pixels, ideal[..., 0], ideal[..., 1], cv2.INTER_LINEAR)
        frames.append((dataclasses.replace(frame, pixels=seen), places))
    detected, _, errors = scored(watch(FrameDifferenceDetector(lens), frames))
    assert detected > 0.8
    assert np.sqrt(np.mean(errors**2)) < 0.9


def test_impossible_values_are_named():
    axes = CameraAxes.towards(1.0, 0.0, 1.0)
    with pytest.raises(EstimatorError, match="height_m 0 is not possible"):
        CameraPose(axes=axes, height_m=0.0)
    with pytest.raises(EstimatorError, match="rotation matrix"):
        CameraPose(axes=CameraAxes(axes=2.0 * np.eye(3)), height_m=1.0)
    with pytest.raises(EstimatorError, match="height_sigma_m"):
        CameraPose(axes=axes, height_m=1.0, height_sigma_m=math.nan)
    with pytest.raises(ValueError, match="corners"):
        RegistrationParameters(corners=0)
    with pytest.raises(EstimatorError, match="longest_gap_s"):
        RegistrationParameters(longest_gap_s=0.1)
