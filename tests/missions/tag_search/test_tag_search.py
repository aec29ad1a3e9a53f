"""Searches for a tag: the flight, its figures and pictures, and the frames that are not rendered."""

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from pymavlink import mavutil

from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.payload import CameraView, GroundTargetParameters, Static, TargetView
from flightsim.world_spec import WorldSpec
from missions.base.options import FlightOptions, Via
from missions.base.request import RunRequest
from missions.errors import PlanError
from missions.library import find_mission
from missions.pattern_search.tag_target import TagTarget
from missions.pattern_search.world import motion_of, tag_search_world
from missions.runs.session import fly
from missions.worlds.search_camera import search_camera

LOW_HOME_SEED = 16
"""With this seed the autopilot's home is 1.2 m below the origin of its local frame."""


def newest(log, name):
    link = mavutil.mavlink_connection(str(log), dialect="all")
    found = None
    while (message := link.recv_match(type=name)) is not None:
        found = message
    return found


def search(
    tmp_path,
    name="parallel-sweep",
    *,
    place=(9.0, -6.0),
    tag_id=3,
    seen_id=3,
    seed=LOW_HOME_SEED,
    picture=False,
    **changes,
):
    options = FlightOptions(
        width_m=30.0, height_m=30.0, search=True, search_time_s=90.0, tag_id=tag_id, speed_m_s=4.0, **changes
    )
    target = GroundTargetParameters(
        motion=Static(north_m=place[0], east_m=place[1]), size_m=0.4, tag_id=seen_id
    )
    world = replace(WorldSpec.of_team(1, seed=seed), targets=(target,))
    world = tag_search_world(world, options, TagTarget(size_m=0.4))
    request = RunRequest(options=options, world=world, out=tmp_path / "run", picture=picture)
    return fly(find_mission(name), request)


@pytest.mark.parametrize("via", [Via.SETPOINTS, pytest.param(Via.WAYPOINTS, marks=pytest.mark.slow)])
def test_a_flight_ends_when_the_tag_is_found(tmp_path, via):
    result = search(tmp_path, via=via, picture=via is Via.WAYPOINTS)
    assert (result.outcome, result.reason) == ("completed", "")
    found = result.summary["search"]
    assert found["found"] and 0.0 < found["search_s"] < 60.0
    assert found["error_m"] < 1.0
    assert (found["north_m"], found["east_m"]) == pytest.approx((9.0, -6.0), abs=1.0)
    assert result.summary["message_counts"]["TUNNEL"] == pytest.approx(found["frames"], rel=0.1)
    assert result.summary["message_counts"]["LANDING_TARGET"] >= 1
    home = newest(result.folder / "flight.tlog", "HOME_POSITION")
    assert home.z > 1.0  # the height of the search is that above home
    if via is Via.WAYPOINTS:
        picture = cv2.imread(str(result.folder / "tag1.png"))
        assert picture.shape == (720, 1280, 3)
        assert (picture == (0, 255, 0)).all(axis=2).any()  # the outline


@pytest.mark.slow
@pytest.mark.parametrize("via", list(Via))
def test_a_tag_on_the_way_to_the_pattern_ends_the_search(tmp_path, via):
    result = search(tmp_path, name="lissajous", place=(-3.0, 4.0), via=via, picture=True)
    assert (result.outcome, result.reason) == ("completed", "")
    found = result.summary["search"]
    assert found["found"] and found["search_s"] < 10.0
    assert found["error_m"] < 1.0


@pytest.mark.slow
def test_a_tag_of_another_number_is_not_found(tmp_path):
    result = search(tmp_path, name="expanding-square", seen_id=4)
    found = result.summary["search"]
    assert (result.outcome, result.reason) == ("completed", "")
    assert not found["found"] and found["north_m"] is None
    assert found["search_s"] == pytest.approx(90.0, abs=1.0)
    assert result.summary["message_counts"]["LANDING_TARGET"] >= 1


@pytest.mark.slow
def test_frames_that_are_not_rendered_have_the_same_detections():
    camera = search_camera(0.3)
    given = {"model": camera.model, "imager": camera.imager, "blur_px_m": camera.blur_px_m, "seed": 1}
    quick = camera.reader.start(**given)
    whole = replace(camera.reader, skip=False).start(**given)  # type: ignore[type-var]
    rng = np.random.default_rng(4)
    detected = 0
    for number in range(14):
        q = np.zeros(4)
        quaternion_from_euler(rng.normal(0, 0.1), -0.5 * math.pi + rng.normal(0, 0.1), rng.uniform(-3, 3), q)
        view = CameraView(
            time_us=100_000 * number,
            eye_ned_m=(*rng.uniform(-8.0, 8.0, 2).tolist(), -10.0),
            q_ned_from_mount=tuple(q.tolist()),
            exposure_s=0.004,
            velocity_ned_m_s=(4.0, 2.0, 0.0),
            rotation_mount_rad_s=(0.1, 0.1, -0.1),
            targets=(TargetView(position_ned_m=(1.0, 2.0, 0.0), size_m=0.3, tag_id=7),),
        )
        one, other = quick.read(view), whole.read(view)
        assert [found.target_id for found in one] == [found.target_id for found in other]
        for a, b in zip(one, other, strict=True):
            detected += 1
            assert math.dist((a.u_px, a.v_px), (b.u_px, b.v_px)) < 0.05
            assert a.distance_m == pytest.approx(b.distance_m, rel=0.01)
    assert detected >= 2 and quick.skipped >= 3 and whole.skipped == 0
    assert quick.kept is not None and quick.kept.pixels.shape == (720, 1280, 3)


def test_the_target_starts_outside_the_middle():
    options = FlightOptions(search=True)
    rng = np.random.default_rng(1)
    starts = np.array([motion_of(TagTarget(), options, rng).start_m for _ in range(500)])  # type: ignore[attr-defined]
    assert np.abs(starts).max() < 50.0 and (np.abs(starts).max(axis=1) > 5.0).all()
    assert np.abs(starts.mean(axis=0)).max() < 5.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: TagTarget(speed_m_s=-1.0), "`speed_m_s` -1"),
        (lambda: TagTarget(size_m=0.0), "`size_m` 0"),
        (lambda: FlightOptions(search=True, tag_id=300), "`tag_id` 300"),
        (
            lambda: motion_of(
                TagTarget(), FlightOptions(width_m=8.0, height_m=8.0), np.random.default_rng(1)
            ),
            "`width_m, height_m` 8 m x 8 m",
        ),
    ],
)
def test_impossible_searches_are_named(make, message):
    with pytest.raises(PlanError, match=message):
        make()


def test_teams_and_aircraft_do_not_search(tmp_path):
    for world, vehicles, message in (
        (WorldSpec.of_team(2), 2, "`vehicles` is 2"),
        (WorldSpec.of_team(1, model="aerosonde"), 1, "flown by multicopters"),
    ):
        request = RunRequest(
            options=FlightOptions(search=True, vehicles=vehicles), world=world, out=tmp_path / "run"
        )
        with pytest.raises(PlanError, match=message):
            fly(find_mission("sector"), request)
