"""The embedded world of a vision search: where the target is, and how the cameras are mounted."""

import math
from dataclasses import replace

import pytest

from flightsim.payload import RandomWalk
from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.search.area import edges
from missions.vision_search.options import VisionSearchOptions
from missions.vision_search.world import HiddenTag, vision_search_world  # type: ignore[attr-defined]
from tests.missions.held_options import with_fields

OPTIONS = with_fields(VisionSearchOptions(), **edges((0.0, -50.0, 100.0, 50.0)))


def made(count=1, seed=3, hidden=None):
    options = replace(OPTIONS, vehicles=count)
    return vision_search_world(WorldSpec.of_team(count, seed=seed), options, hidden)


def test_the_target_is_that_of_the_seed_for_any_team():
    (one,), (two,) = made().targets, made(2).targets
    assert one == two
    assert one.tag_id == 0 and one.size_m == OPTIONS.estimator.target_size_m
    places = [(t.motion.north_m, t.motion.east_m) for seed in range(40) for t in made(seed=seed).targets]
    assert len(set(places)) == 40
    assert all(5.0 <= n <= 95.0 and -45.0 <= e <= 45.0 for n, e in places)


def test_each_camera_is_turned_on_its_mount_by_its_own_angles():
    world = made(2)
    turned = [vehicle.payload.camera.misalignment_rad for vehicle in world.vehicles]
    assert turned[0] != turned[1]
    assert turned[0] == made().vehicles[0].payload.camera.misalignment_rad
    squares = [
        angle**2
        for seed in range(60)
        for angle in made(seed=seed).vehicles[0].payload.camera.misalignment_rad
    ]
    assert math.sqrt(sum(squares) / len(squares)) == pytest.approx(math.radians(0.3), rel=0.15)
    straight = made(hidden=HiddenTag(misalignment_rad=0.0))
    assert straight.vehicles[0].payload.camera.misalignment_rad == (0.0, 0.0, 0.0)


def test_a_target_may_be_placed_and_may_walk():
    (target,) = made(hidden=HiddenTag(place_ne_m=(20.0, 10.0), speed_m_s=1.0)).targets
    assert isinstance(target.motion, RandomWalk)
    assert target.motion.start_m == (20.0, 10.0)


@pytest.mark.parametrize(
    ("make", "reported"),
    [
        (lambda: made(hidden=HiddenTag(place_ne_m=(-1.0, 0.0))), "`target_ne_m` -1,0 is not in `area_m`"),
        (lambda: HiddenTag(speed_m_s=99.0), "`speed_m_s` 99 m/s"),
        (lambda: HiddenTag(misalignment_rad=1.0), "`misalignment_rad` 57.2958 degrees"),
    ],
)
def test_an_impossible_target_is_refused(make, reported):
    with pytest.raises(PlanError, match=reported):
        make()
