"""A camera that tells the distance of a tag from its apparent size."""

import math

import numpy as np
import pytest

from autopilot_bridge.payload.camera_messages import landing_target
from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import (
    Camera,
    CameraParameters,
    GroundTargetParameters,
    GroundTargets,
    ResolutionDetection,
    Static,
)

HOME = Home(lat_deg=47.4, lon_deg=8.5, alt_m=480.0)
HEIGHT_M = 40.0
SIZE_M = 1.5


def detections(tag: int, **chosen):
    """A thousand frames of a camera that looks straight down on a target below it."""
    streams = RandomStreams(3)
    targets = GroundTargets(
        (GroundTargetParameters(motion=Static(north_m=0.0, east_m=0.0), size_m=SIZE_M, tag_id=tag),),
        seeds=lambda i: streams.child("target", i),
    )
    truth = np.zeros(t.TRUTH_SIZE)
    truth[t.LAT_RAD], truth[t.LON_RAD] = math.radians(HOME.lat_deg), math.radians(HOME.lon_deg)
    truth[t.ALT_M] = HOME.alt_m + HEIGHT_M
    truth[t.Q_NED_FROM_FRD] = 1.0, 0.0, 0.0, 0.0
    camera = Camera(
        CameraParameters(rate_hz=50, latency_s=0.0, detection=ResolutionDetection.constant(1.0), **chosen),
        truth=truth,
        home=HOME,
        targets=targets,
        physics_rate_hz=50,
        seeds=lambda name: streams.child("vehicle", 0, "sensor", name),
    )
    found = [camera.step(20_000 * k) for k in range(1000)]
    return [detection for frame in found if frame is not None for detection in frame.detections]


def test_distance_has_the_noise_that_pixel_noise_implies() -> None:
    found = detections(5, tag_range=True, pixel_noise_px=0.5)
    distances = np.array([detection.distance_m for detection in found])
    size_px = CameraParameters().model.focal_px * 2.0 * math.atan(0.5 * SIZE_M / HEIGHT_M)
    expected_m = HEIGHT_M * 0.5 / math.sqrt(2.0) / size_px
    assert len(found) == 1000
    assert distances.mean() == pytest.approx(HEIGHT_M, abs=4.0 * expected_m / math.sqrt(1000) + 0.01)
    assert distances.std() == pytest.approx(expected_m, rel=0.1)
    assert found[0].size_rad == pytest.approx(2.0 * math.atan(0.5 * SIZE_M / found[0].distance_m))
    assert landing_target(found[0]).distance == found[0].distance_m  # type: ignore[attr-defined]


def test_without_it_or_without_a_tag_there_is_no_distance() -> None:
    assert {d.distance_m for d in detections(5)} == {0.0}
    assert {d.distance_m for d in detections(-1, tag_range=True)} == {0.0}


def test_it_changes_no_other_noise() -> None:
    with_range, without = detections(5, tag_range=True), detections(5)
    assert [(d.u_px, d.v_px) for d in with_range] == [(d.u_px, d.v_px) for d in without]
