"""Pictures against the geometry of the detections, and against detectors that others wrote."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from flightsim import truth as t
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.home import Home
from flightsim.payload import (
    Camera,
    CameraParameters,
    CameraView,
    GroundTargetParameters,
    GroundTargets,
    PictureDetection,
    PinholeModel,
    ResolutionDetection,
    Static,
    TargetShape,
    TargetView,
    Terrain,
)
from flightsim.picture import Renderer, Scenery
from tests.rotations import rotation_matrix
from tests.slow import slow

HOME = Home(lat_deg=47.4, lon_deg=8.5, alt_m=480.0)
MODEL = PinholeModel()
SHARP = {"pixel_noise_px": 0.0, "size_noise": 0.0, "latency_s": 0.0}
SURE = ResolutionDetection.constant(1.0)


def quaternion(roll_deg: float, pitch_deg: float, yaw_deg: float) -> tuple[float, ...]:
    q = np.zeros(4)
    quaternion_from_euler(math.radians(roll_deg), math.radians(pitch_deg), math.radians(yaw_deg), q)
    return tuple(q.tolist())


def camera_at(place_ned_m, attitude_deg, targets, *, zoom=1.0, time_us=4000, detection=SURE):
    """A camera along the body's x axis of a vehicle there, what it detects, and its view."""
    truth = np.zeros(t.TRUTH_SIZE)
    lat_deg, lon_deg = HOME.offset(place_ned_m[0], place_ned_m[1])
    truth[t.LAT_RAD], truth[t.LON_RAD] = math.radians(lat_deg), math.radians(lon_deg)
    truth[t.ALT_M] = HOME.alt_m - place_ned_m[2]
    truth[t.Q_NED_FROM_FRD] = quaternion(*attitude_deg)
    camera = Camera(
        CameraParameters(mount_pitch_rad=0.0, position_frd_m=(0.2, 0.0, 0.1), detection=detection, **SHARP),
        truth=truth,
        home=HOME,
        targets=GroundTargets(targets, seeds=lambda i: np.random.SeedSequence([1, i])),
        physics_rate_hz=250,
        seeds=lambda name: np.random.SeedSequence([2, *name.encode()]),
    )
    camera.zoom = zoom
    return camera.step(time_us), camera.view(time_us)


def blob_centre(picture, mask) -> tuple[float, float]:
    """Middle of a mask, in pixels counted from the picture's corner."""
    v, u = np.nonzero(mask)
    assert len(u), "nothing of that colour in the picture"
    return float(u.mean()) + 0.5, float(v.mean()) + 0.5


def tag_detector() -> cv2.aruco.ArucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    parameters.adaptiveThreshWinSizeMax = 53  # the default is for smaller tags
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    return cv2.aruco.ArucoDetector(family, parameters)


def red(picture):
    b, g, r = (picture[..., c].astype(int) for c in range(3))
    return (r > 110) & (r > 2.5 * g) & (r > 2.5 * b)


POSES = [
    ((0.0, 0.0, -40.0), (0.0, -50.0, 0.0), (30.0, 4.0)),
    ((-60.0, 20.0, -80.0), (12.0, -35.0, -10.0), (40.0, -15.0)),
    ((10.0, 10.0, -25.0), (-20.0, -89.0, 130.0), (12.0, 6.0)),
    ((200.0, -300.0, -120.0), (0.0, -30.0, 100.0), (170.0, -110.0)),
]


@pytest.mark.parametrize("zoom", [1.0, 2.5])
@pytest.mark.parametrize(("place", "attitude", "target"), POSES)
def test_a_ball_is_where_the_detection_says(place, attitude, target, zoom):
    ball = GroundTargetParameters(motion=Static(north_m=target[0], east_m=target[1]), size_m=3.0)
    frame, view = camera_at(place, attitude, [ball], zoom=zoom)
    if not frame.detections:
        assert zoom > 1.0  # a narrower picture, and the target is beside it
        return
    picture = Renderer(MODEL).render(view)
    (found,) = frame.detections
    assert blob_centre(picture, red(picture)) == pytest.approx((found.u_px, found.v_px), abs=1.0)
    across_px = math.sqrt(4.0 / math.pi * red(picture).sum())
    assert across_px == pytest.approx(MODEL.focal_px * zoom * found.size_rad, rel=0.15, abs=1.5)


@pytest.mark.parametrize(("place", "attitude", "target"), POSES[:3])
def test_a_tag_is_read_by_opencv_where_the_detection_says(place, attitude, target):
    tag = GroundTargetParameters(motion=Static(north_m=target[0], east_m=target[1]), size_m=4.0, tag_id=42)
    frame, view = camera_at(place, attitude, [tag])
    picture = Renderer(MODEL).render(view)
    corners, ids, _ = tag_detector().detectMarkers(picture)
    assert ids is not None and ids.ravel().tolist() == [42]
    (found,) = frame.detections
    # corners of a tag in OpenCV's pixels, whose first has its middle at 0
    centre = corners[0].reshape(4, 2).mean(axis=0) + 0.5
    assert centre == pytest.approx((found.u_px, found.v_px), abs=1.5)


@pytest.mark.parametrize(("attitude", "axis"), [slow((0.0, -20.0, 0.0), 0), ((25.0, -30.0, 60.0), 1)])
@pytest.mark.slow
def test_a_tag_is_read_until_the_edge_of_the_picture_cuts_it_off(attitude, axis):
    """A large, flat tag moves out of the picture: the model loses it where OpenCV does, within a cell."""
    size_m = 3.0
    heading_rad = math.radians(attitude[2])
    ahead = 10.0 / math.tan(math.radians(-attitude[1]))

    def seen(offset_m: float) -> tuple[bool, bool]:
        """Whether OpenCV reads the tag, and whether the model reports it."""
        forward, right = (ahead - offset_m, 0.0) if axis == 0 else (ahead, offset_m)
        north = forward * math.cos(heading_rad) - right * math.sin(heading_rad)
        east = forward * math.sin(heading_rad) + right * math.cos(heading_rad)
        tag = GroundTargetParameters(motion=Static(north_m=north, east_m=east), size_m=size_m, tag_id=3)
        frame, view = camera_at(
            (0.0, 0.0, -10.0), attitude, [tag], detection=PictureDetection(max_probability=1.0)
        )
        _, ids, _ = tag_detector().detectMarkers(Renderer(MODEL).render(view))
        return ids is not None, bool(frame.detections)

    coarse_m = np.arange(0.0, 30.0, 1.5)
    last_m = coarse_m[[any(seen(offset_m)) for offset_m in coarse_m]].max()
    assert 3.0 < last_m < coarse_m.max()
    offsets_m = np.arange(last_m - 0.8, last_m + 1.6, 0.2)
    lost_m = [offsets_m[np.flatnonzero(known).max()] for known in zip(*map(seen, offsets_m), strict=True)]
    assert lost_m[1] == pytest.approx(lost_m[0], abs=size_m / 8 + 0.2)


def test_the_top_of_a_tag_points_north():
    view = CameraView(
        time_us=0,
        eye_ned_m=(0.0, 0.0, -20.0),
        q_ned_from_mount=quaternion(0.0, -90.0, 0.0),
        targets=(TargetView(position_ned_m=(0.0, 0.0, 0.0), size_m=6.0, tag_id=7),),
    )
    corners, ids, _ = tag_detector().detectMarkers(Renderer(MODEL).render(view))
    assert ids.ravel().tolist() == [7]
    top_left, _, _, bottom_left = corners[0].reshape(4, 2)
    assert top_left[1] < bottom_left[1] - 100.0 and top_left[0] == pytest.approx(bottom_left[0], abs=2.0)


def test_home_is_marked_and_the_ground_stays_where_it_is():
    """The same place keeps its look from elsewhere: two pictures match by the plane's homography."""
    renderer = Renderer(MODEL)
    first = CameraView(time_us=0, eye_ned_m=(2.0, 1.0, -20.0), q_ned_from_mount=quaternion(0, -89, 0))
    second = CameraView(time_us=0, eye_ned_m=(-6.0, 4.0, -26.0), q_ned_from_mount=quaternion(5, -70, 40))
    pictures = [renderer.render(view) for view in (first, second)]
    assert (pictures[0] > 225).all(axis=2).sum() > 2000  # white paint

    def homography(view):  # ground (north, east, 1) to pixels
        camera_from_ned = rotation_matrix(view.q_ned_from_mount).T[[1, 2, 0]]
        ground = np.column_stack([np.eye(3)[:, :2], -np.array(view.eye_ned_m)])
        return MODEL.matrix @ camera_from_ned @ ground

    shift = np.array([[1.0, 0.0, -0.5], [0.0, 1.0, -0.5], [0.0, 0.0, 1.0]])
    h = shift @ homography(second) @ np.linalg.inv(shift @ homography(first))
    size = (MODEL.width_px, MODEL.height_px)
    moved = cv2.warpPerspective(pictures[0], h, size)
    inside = cv2.erode(
        cv2.warpPerspective(np.full(pictures[0].shape[:2], 255, np.uint8), h, size), np.ones((9, 9))
    )
    difference = np.abs(moved.astype(int) - pictures[1].astype(int))[inside > 250]
    assert len(difference) > 50_000
    assert difference.mean() < 6.0
    # and it is no even colour that would match anywhere
    wrong = np.abs(np.roll(moved, 40, axis=1).astype(int) - pictures[1].astype(int))[inside > 250]
    assert wrong.mean() > 1.7 * difference.mean()


def test_the_horizon_is_level_and_at_the_height_of_the_eye():
    view = CameraView(time_us=0, eye_ned_m=(0.0, 0.0, -100.0), q_ned_from_mount=quaternion(0, -10, 20))
    picture = Renderer(MODEL, scenery=Scenery(visibility_m=1e6)).render(view)
    blue_over_green = picture[..., 0].astype(int) - picture[..., 1]
    # the sky is bluer than green, the ground is not; the true horizon lies 10 degrees up in the picture
    rows = np.argmax(blue_over_green[:, ::100] < 0, axis=0)
    expected = 0.5 * MODEL.height_px - MODEL.focal_px * math.tan(math.radians(10.0))
    assert rows == pytest.approx(np.full(rows.shape, expected), abs=3.0)


def test_a_runway_has_its_heading():
    heading_rad = math.radians(30.0)
    renderer = Renderer(MODEL, scenery=Scenery(runway_length_m=300.0, runway_heading_rad=heading_rad))
    view = CameraView(time_us=0, eye_ned_m=(0.0, 0.0, -200.0), q_ned_from_mount=quaternion(0, -90, 0))
    picture = renderer.render(view)
    spread = picture.max(axis=2).astype(int) - picture.min(axis=2)
    v, u = np.nonzero(spread < 8)  # asphalt and paint are grey
    assert len(u) > 10_000
    along = np.linalg.svd(np.column_stack([u - u.mean(), v - v.mean()]), full_matrices=False)[2][0]
    found_deg = math.degrees(math.atan2(along[0], -along[1])) % 180.0
    assert found_deg == pytest.approx(30.0, abs=1.0)


def test_focus_blurs_and_a_camera_that_is_put_away_sees_nothing():
    renderer = Renderer(MODEL, aperture_px_m=2.0)
    sharp = CameraView(time_us=0, eye_ned_m=(0, 0, -20.0), q_ned_from_mount=quaternion(0, -60, 0), zoom=4.0)
    near = CameraView(
        time_us=0,
        eye_ned_m=(0, 0, -20.0),
        q_ned_from_mount=quaternion(0, -60, 0),
        zoom=4.0,
        focus_distance_m=1.0,
    )
    detail = [float(cv2.Laplacian(renderer.render(view), cv2.CV_64F).var()) for view in (sharp, near)]
    assert detail[1] < 0.2 * detail[0]
    covered = CameraView(
        time_us=0, eye_ned_m=(0, 0, -20.0), q_ned_from_mount=quaternion(0, -60, 0), covered=True
    )
    assert renderer.render(covered).std() == 0.0


def test_a_smaller_picture_shows_the_same():
    view = CameraView(
        time_us=0,
        eye_ned_m=(0.0, 0.0, -30.0),
        q_ned_from_mount=quaternion(5, -60, 10),
        targets=(TargetView(position_ned_m=(15.0, 6.0, 0.0), size_m=3.0, tag_id=-1),),
    )
    renderer = Renderer(MODEL)
    large, small = renderer.render(view), renderer.render(view, width_px=640)
    assert small.shape == (360, 640, 3)
    u, v = blob_centre(large, red(large))
    assert blob_centre(small, red(small)) == pytest.approx((0.5 * u, 0.5 * v), abs=0.5)


SMALL = PinholeModel(width_px=320, height_px=240)


def pixels_of(view, places_ned_m):
    camera_from_ned = rotation_matrix(view.q_ned_from_mount).T[[1, 2, 0]]
    return SMALL.project((np.asarray(places_ned_m) - view.eye_ned_m) @ camera_from_ned.T)


# of a vehicle the front is highest in the picture, a little over the ground, of a person the head
@pytest.mark.parametrize(
    ("shape", "size_m", "ahead_m", "height_m"),
    [(TargetShape.VEHICLE, 4.5, 2.25, 0.85), (TargetShape.PERSON, 1.75, 0.1, 1.75)],
)
def test_a_body_stands_where_it_is(shape, size_m, ahead_m, height_m):
    """What differs from the empty picture is the target with its shadow."""
    north, east = 21.0, 3.0
    body = TargetView(
        position_ned_m=(north, east, 0.0), size_m=size_m, tag_id=-1, shape=shape, course_rad=0.6
    )
    view = CameraView(time_us=0, eye_ned_m=(0.0, 0.0, -20.0), q_ned_from_mount=quaternion(3, -42, 5))
    renderer = Renderer(SMALL)
    empty, shown = renderer.render(view), renderer.render(replace(view, targets=(body,)))
    changed = np.abs(shown.astype(int) - empty).max(axis=2) > 8
    top_m = size_m if shape is TargetShape.PERSON else 0.33 * size_m
    feet, top = pixels_of(view, [(north, east, 0.0), (north, east, -top_m)])
    v, u = np.nonzero(changed)
    front = (north + ahead_m * math.cos(0.6), east + ahead_m * math.sin(0.6), -height_m)
    assert v.min() + 0.5 == pytest.approx(pixels_of(view, [front])[0][1], abs=3.0)
    assert changed[round(0.5 * (feet[1] + top[1])), round(0.5 * (feet[0] + top[0]))]
    if shape is TargetShape.PERSON:  # a car lies on most of its own shadow
        # the sun is in the south-east at 45 degrees: the shadow is north-west, as long as the body is high
        away = 0.6 * top_m * np.array([-math.cos(math.radians(150)), -math.sin(math.radians(150)), 0.0])
        u_px, v_px = np.round(pixels_of(view, [np.array((north, east, 0.0)) + away])[0] - 0.5).astype(int)
        assert shown[v_px, u_px].sum() < 0.85 * empty[v_px, u_px].sum()
    assert np.hypot(u - feet[0], v - feet[1]).max() < 1.5 * SMALL.focal_px * size_m / 20.0


def test_terrain_moves_the_ground_by_its_parallax():
    """A plateau looks as level ground does from as much less height, and targets stand on it."""
    plateau = Terrain(south_m=-500.0, west_m=-500.0, spacing_m=250.0, height_m=np.full((5, 5), 8.0))
    ball = TargetView(position_ned_m=(14.0, -2.0, 0.0), size_m=2.0, tag_id=-1)
    high = CameraView(
        time_us=0, eye_ned_m=(0.0, 0.0, -30.0), q_ned_from_mount=quaternion(4, -55, 0), targets=(ball,)
    )
    low = replace(high, eye_ned_m=(0.0, 0.0, -22.0))
    raised = Renderer(SMALL, terrain=plateau).render(high)
    level = Renderer(SMALL).render(low)
    same = np.abs(raised.astype(int) - level).max(axis=2) <= 1
    assert same.mean() > 0.99
    assert (np.abs(raised.astype(int) - Renderer(SMALL).render(high)).max(axis=2) > 1).mean() > 0.5


def test_a_slope_is_where_its_rays_meet_it():
    """A mark at home, on a slope, is where projection puts its place."""
    north_m = np.linspace(-100.0, 100.0, 21)
    slope = Terrain(
        south_m=-100.0, west_m=-100.0, spacing_m=10.0, height_m=np.repeat(5.0 + 0.2 * north_m[:, None], 21, 1)
    )
    view = CameraView(time_us=0, eye_ned_m=(-25.0, 4.0, -30.0), q_ned_from_mount=quaternion(0, -45, 0))
    picture = Renderer(SMALL, terrain=slope).render(view)
    v, u = np.nonzero((picture > 190).all(axis=2))
    assert (u.mean() + 0.5, v.mean() + 0.5) == pytest.approx(pixels_of(view, [(0.0, 0.0, -5.0)])[0], abs=2.0)


@pytest.mark.parametrize("eye", [(0.0, 0.0, 0.0), (1e7, -1e7, -1e5), (0.0, 0.0, 30.0)])
@pytest.mark.parametrize("attitude", [(0, 0, 0), (180, 0, 0), (0, 90, 0), (45, -90, 0)])
def test_strange_places_make_pictures_too(eye, attitude):
    targets = tuple(
        TargetView(position_ned_m=(north, 0.0, 0.0), size_m=2.0, tag_id=tag)
        for north in (-0.3, 0.0, 0.3, 1e5)
        for tag in (-1, 3, 586, 587)
    )
    targets += tuple(replace(target, shape=TargetShape.VEHICLE) for target in targets)
    view = CameraView(
        time_us=0, eye_ned_m=eye, q_ned_from_mount=quaternion(*attitude), zoom=6.0, targets=targets
    )
    assert Renderer(MODEL, aperture_px_m=2.0).render(view, width_px=160).shape == (90, 160, 3)
