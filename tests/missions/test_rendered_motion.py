"""A camera that detects what moves in its rendered pictures, from the device to its messages."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameParser, decode
from autopilot_bridge.mavlink.camera_scan import CAMERA_SCAN_PAYLOAD, read_camera_scan
from autopilot_bridge.payload import CameraComponent
from flightsim import truth as t
from flightsim.foundation.vectors import from_euler
from flightsim.home import Home
from flightsim.payload import (
    Camera,
    CameraParameters,
    ConstantVelocity,
    GroundTargetParameters,
    GroundTargets,
    ImagerParameters,
    PinholeModel,
    Static,
    TargetShape,
)
from missions.embedded import MotionSource, RenderedMotion

HOME = Home(lat_deg=47.4, lon_deg=8.5, alt_m=480.0)
MODEL = PinholeModel(width_px=320, height_px=240, horizontal_fov_rad=math.radians(60.0))
CAR = GroundTargetParameters(
    motion=ConstantVelocity(north_m=-8.0, east_m=-10.0, speed_m_s=6.0, course_rad=1.2),
    size_m=4.5,
    shape=TargetShape.VEHICLE,
)
PARKED = GroundTargetParameters(
    motion=Static(north_m=-12.0, east_m=12.0), size_m=4.5, shape=TargetShape.VEHICLE
)
HEIGHT_M, PITCH_RAD, RATE_HZ = 50.0, math.radians(-60.0), 10


def flown(source, frames, *, seed=5):
    """Frames, true angles of the car, and the messages of a camera that flies by both cars to the east."""
    truth, parser, messages = np.zeros(t.TRUTH_SIZE), FrameParser(), []
    camera = Camera(
        CameraParameters(
            model=MODEL,
            rate_hz=RATE_HZ,
            latency_s=0.0,
            mount_pitch_rad=PITCH_RAD,
            imager=ImagerParameters(read_noise=1.0),
            reader=RenderedMotion(source=source),
        ),
        truth=truth,
        home=HOME,
        targets=GroundTargets([CAR, PARKED], seeds=lambda i: np.random.SeedSequence([1, i])),
        physics_rate_hz=RATE_HZ,
        seeds=lambda name: np.random.SeedSequence([seed, *name.encode()]),
    )
    component = CameraComponent(
        camera, system_id=1, send=lambda data: messages.extend(map(decode, parser.feed(data)))
    )
    delivered = []
    for step in range(frames):
        time_us = step * 1_000_000 // RATE_HZ
        north_m, east_m = -30.0, -10.0 + 8.0 * time_us * 1e-6
        lat_deg, lon_deg = HOME.offset(north_m, east_m)
        truth[t.LAT_RAD], truth[t.LON_RAD] = math.radians(lat_deg), math.radians(lon_deg)
        truth[t.ALT_M] = HOME.alt_m + HEIGHT_M
        truth[t.Q_NED_FROM_FRD] = from_euler(0.0, 0.0, 0.0)
        frame = camera.step(time_us)
        assert frame is not None
        component.update(frame)
        car_n, car_e, _, _ = CAR.motion.at(time_us * 1e-6)  # type: ignore[attr-defined]
        away = np.array([car_n - north_m, car_e - east_m, HEIGHT_M])
        c, s = math.cos(PITCH_RAD), math.sin(PITCH_RAD)
        ahead, right, below = c * away[0] - s * away[2], away[1], s * away[0] + c * away[2]
        delivered.append((frame, math.atan2(right, ahead), math.atan2(below, ahead)))
    return camera, delivered, messages


@pytest.mark.parametrize(
    "source", [pytest.param(MotionSource.CORNERS, marks=pytest.mark.slow), "differences"]
)
def test_the_moving_car_is_reported_and_the_parked_one_is_not(source):
    camera, delivered, messages = flown(MotionSource(source), 26)
    searched = [entry for entry in delivered if entry[0].searched]
    counts = camera.reader.counts
    assert len(searched) == counts.measured == 26 - counts.starting
    assert len(searched) >= 8
    assert all(not frame.detections for frame, _, _ in delivered if not frame.searched)
    found = 0
    for frame, x_rad, y_rad in searched:
        off = [math.hypot(d.angle_x_rad - x_rad, d.angle_y_rad - y_rad) for d in frame.detections]
        found += bool(off) and min(off) < 0.02
        assert len(off) <= 3
        assert all(d.target_id == -1 and d.distance_m == 0.0 and d.size_rad > 0.0 for d in frame.detections)
    assert found >= 0.8 * len(searched)
    # one LANDING_TARGET per object and one TUNNEL per searched frame: a log has them all
    kinds = [message.get_type() for message in messages]
    assert kinds.count("LANDING_TARGET") == sum(len(frame.detections) for frame, _, _ in delivered)
    scans = [
        read_camera_scan(message.payload_type, message.payload_length, message.payload)
        for message in messages
        if message.get_type() == "TUNNEL" and message.payload_type == CAMERA_SCAN_PAYLOAD
    ]
    assert [(scan.time_us, scan.detections) for scan in scans] == [
        (frame.time_us, len(frame.detections)) for frame, _, _ in searched
    ]


def test_one_seed_one_set_of_detections():
    frames = [[entry[0] for entry in flown(MotionSource.DIFFERENCES, 19)[1]] for _ in range(2)]
    assert frames[0] == frames[1]
    assert any(frame.detections for frame in frames[0])
