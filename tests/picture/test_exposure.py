"""What lens and sensor do to pictures, against OpenCV's own models and against pictures of other moments."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from flightsim.payload import BrownDistortion, CameraView, ImagerParameters, PinholeModel, TargetView
from flightsim.picture import Renderer
from flightsim.picture.window import Window
from tests.rotations import rotation_matrix

SMALL = PinholeModel(width_px=320, height_px=240, horizontal_fov_rad=math.radians(60.0))
LENS = BrownDistortion(k1=-0.15, k2=0.05, p1=0.001, p2=-0.0008, k3=-0.004)
DOWN = (math.sqrt(0.5), 0.0, -math.sqrt(0.5), 0.0)
TAG = TargetView(position_ned_m=(1.0, -0.5, 0.0), size_m=2.0, tag_id=42)
VIEW = CameraView(time_us=1_000_000, eye_ned_m=(0.0, 0.0, -10.0), q_ned_from_mount=DOWN, targets=(TAG,))


def grey(picture):
    return cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY).astype(np.float64)


def test_distortion_is_opencvs():
    rays = np.random.default_rng(1).uniform(-0.6, 0.6, (50, 2))
    points = np.column_stack((rays, np.ones(50)))
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), np.eye(3), np.array(LENS.coefficients))
    assert LENS.distorted(rays) == pytest.approx(expected.reshape(-1, 2), abs=1e-12)
    assert LENS.rays(LENS.distorted(rays)) == pytest.approx(rays, abs=1e-9)


def test_a_lens_that_folds_the_picture_is_refused():
    with pytest.raises(ValueError, match="folds the picture"):
        Renderer(SMALL, imager=ImagerParameters(distortion=BrownDistortion(k1=-3.0)))


def test_a_distorted_picture_undistorts_to_the_ideal_one():
    ideal = Renderer(SMALL).render(VIEW)
    distorted = Renderer(SMALL, imager=ImagerParameters(distortion=LENS)).render(VIEW)
    matrix = np.array([[SMALL.focal_px, 0.0, 159.5], [0.0, SMALL.focal_px, 119.5], [0.0, 0.0, 1.0]])
    straight = cv2.undistort(distorted, matrix, np.array(LENS.coefficients))
    inner = (slice(30, 210), slice(40, 280))
    off = np.abs(grey(straight)[inner] - grey(ideal)[inner])
    assert np.median(off) <= 2.0
    assert np.abs(grey(distorted)[inner] - grey(ideal)[inner]).mean() > 2.0 * off.mean()


def test_motion_blur_is_the_mean_of_the_pictures_of_its_moments():
    moving = replace(
        VIEW, exposure_s=0.04, velocity_ned_m_s=(6.0, 3.0, -1.0), rotation_mount_rad_s=(0.5, -0.4, 0.3)
    )
    blurred = grey(Renderer(SMALL).render(moving))
    renderer = Renderer(SMALL)
    moments = []
    r = rotation_matrix(np.array(DOWN))
    for after_s in np.linspace(-0.02, 0.02, 17):
        turn = cv2.Rodrigues(after_s * np.array(moving.rotation_mount_rad_s))[0]
        matrix = r @ turn
        w = 0.5 * math.sqrt(1.0 + np.trace(matrix))
        q = (
            w,
            (matrix[2, 1] - matrix[1, 2]) / (4.0 * w),
            (matrix[0, 2] - matrix[2, 0]) / (4.0 * w),
            (matrix[1, 0] - matrix[0, 1]) / (4.0 * w),
        )
        eye = np.array(VIEW.eye_ned_m) + after_s * np.array(moving.velocity_ned_m_s)
        view = replace(VIEW, eye_ned_m=tuple(eye.tolist()), q_ned_from_mount=q)
        moments.append(grey(renderer.render(view)))
    inner = (slice(15, 225), slice(15, 305))
    expected = np.mean(moments, axis=0)[inner]
    sharp = grey(renderer.render(VIEW))[inner]
    assert np.abs(blurred[inner] - expected).mean() < 0.25 * np.abs(sharp - expected).mean()


def test_a_rolling_shutter_takes_each_row_at_its_own_time():
    imager = ImagerParameters(rolling_shutter_s=0.1)
    moving = replace(VIEW, velocity_ned_m_s=(0.0, 5.0, 0.0))
    rolled = grey(Renderer(SMALL, imager=imager).render(moving))
    for row in (20, 120, 220):
        after_s = 0.1 * ((row + 0.5) / 240 - 0.5)
        there = replace(VIEW, eye_ned_m=(0.0, 5.0 * after_s, -10.0))
        assert np.abs(rolled[row, 20:-20] - grey(Renderer(SMALL).render(there))[row, 20:-20]).mean() < 1.5


def test_noise_grows_with_the_light_and_belongs_to_the_frame():
    imager = ImagerParameters(read_noise=2.0, shot_noise=0.05)
    renderer = Renderer(SMALL, imager=imager, seed=7)
    clean = Renderer(SMALL).render(VIEW).astype(np.float64)
    frames = [
        renderer.render(replace(VIEW, time_us=1_000_000 + k)).astype(np.float64) - clean for k in range(30)
    ]
    for low, high in ((40.0, 70.0), (120.0, 150.0)):
        chosen = (clean > low) & (clean < high)
        level = clean[chosen].mean()
        assert np.std([f[chosen] for f in frames]) == pytest.approx(math.sqrt(4.0 + 0.05 * level), rel=0.03)
    again = Renderer(SMALL, imager=imager, seed=7)
    assert (again.render(VIEW) == renderer.render(VIEW)).all()
    assert (Renderer(SMALL, imager=imager, seed=8).render(VIEW) != renderer.render(VIEW)).any()
    assert abs(np.corrcoef(frames[0].ravel(), frames[1].ravel())[0, 1]) < 0.02


def test_a_part_of_a_picture_is_the_same_as_in_the_whole():
    imager = ImagerParameters(distortion=LENS, read_noise=2.0, shot_noise=0.05)
    view = replace(VIEW, exposure_s=0.01, velocity_ned_m_s=(4.0, 2.0, 0.0))
    renderer = Renderer(SMALL, imager=imager)
    window = Window(left=60, top=35, width=150, height=120)
    off = renderer.render(view, window=window).astype(int) - renderer.render(view)[35:155, 60:210].astype(int)
    assert np.abs(off).max() <= 2 and (off != 0).mean() < 0.01


def test_light_falls_off_by_the_angle_and_saturates():
    """cos^4 of the angle of each pixel's ray, by the geometry of the model, times the brightness."""
    clean = Renderer(SMALL).render(VIEW).astype(float)
    dark = Renderer(SMALL, imager=ImagerParameters(vignetting=1.0)).render(VIEW)
    for row, column in ((120, 160), (120, 310), (5, 5)):
        off_px = math.hypot(column + 0.5 - 160.0, row + 0.5 - 120.0)
        share = math.cos(math.atan(off_px / SMALL.focal_px)) ** 4
        assert dark[row, column] == pytest.approx(share * clean[row, column], abs=1.0)
    bright = Renderer(SMALL, imager=ImagerParameters(brightness=2.0)).render(VIEW)
    assert bright == pytest.approx(np.minimum(2.0 * clean, 255.0), abs=1.0)


def test_compression_loses_by_its_quality_and_in_the_blocks_of_the_whole_picture():
    clean = Renderer(SMALL).render(VIEW).astype(float)
    losses = []
    for quality in (95, 50, 10):
        renderer = Renderer(SMALL, imager=ImagerParameters(jpeg_quality=quality))
        whole = renderer.render(VIEW)
        losses.append(np.abs(whole - clean).mean())
        window = Window(left=60, top=35, width=150, height=120)
        part = renderer.render(VIEW, window=window)
        inner = (slice(48, 144), slice(64, 208))  # whole blocks of 16 pixels
        off = part[48 - 35 : 144 - 35, 64 - 60 : 208 - 60].astype(int) - whole[inner]
        assert np.abs(off).mean() < 0.3 and (np.abs(off) > 8).mean() < 0.01
    assert 0.0 < losses[0] < losses[1] < losses[2] < 20.0
    with pytest.raises(ValueError, match="jpeg_quality 101"):
        ImagerParameters(jpeg_quality=101)


def test_the_ground_has_corners_to_track_at_every_height():
    for height_m in (10.0, 30.0, 90.0):
        view = replace(VIEW, eye_ned_m=(30.0, 20.0, -height_m), targets=())
        picture = cv2.cvtColor(Renderer(PinholeModel()).render(view), cv2.COLOR_BGR2GRAY)
        corners = cv2.goodFeaturesToTrack(picture, 500, 0.01, 10)
        assert corners is not None and len(corners) >= 50, height_m


def test_tags_out_of_view_are_certain():
    renderer = Renderer(SMALL, imager=ImagerParameters(distortion=LENS))
    rng = np.random.default_rng(3)
    hidden = 0
    for _ in range(24):
        place = (*rng.uniform(-14.0, 14.0, 2).tolist(), 0.0)
        view = replace(VIEW, targets=(replace(TAG, position_ned_m=place),))
        same = (renderer.render(view) == renderer.render(replace(view, targets=()))).all()
        if not renderer.may_show_tag(view, margin=0.0):
            hidden += 1
            assert same
    assert 4 < hidden < 24
    assert not renderer.may_show_tag(replace(VIEW, targets=()))
    assert not renderer.may_show_tag(replace(VIEW, covered=True))
    assert not renderer.may_show_tag(replace(VIEW, targets=(replace(TAG, tag_id=-1),)))
