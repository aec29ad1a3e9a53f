"""Options of a search, and the worlds they are flown in."""

import math

import numpy as np
import pytest

from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.multi_target.options import MultiTargetOptions, check_vehicle
from missions.multi_target.world import TargetField, multi_target_world
from missions.search.area import Area
from missions.vehicle.limits import FixedWingLimits, MulticopterLimits


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"steps": 0}, "`steps` 0"),
        ({"area_m": (0.0, 0.0, 0.0, 10.0)}, "`area_m`"),
        ({"area_m": (0.0, 0.0, 10.0, 50_000.0)}, "`area_m`"),
        ({"start_ne_m": (900.0, 0.0)}, "`start_ne_m` 900,0"),
        ({"undetected": 0.0}, "`undetected` 0"),
        ({"search_time_s": 1e6}, "`search_time_s`"),
        ({"gain": 2.0}, "gain 2"),
        ({"found_width_m": -1.0}, "found_width_m = -1.0"),
        ({"place_sigma_m": -1.0}, "`place_sigma_m`"),
    ],
)
def test_impossible_options_are_named(values, reason):
    with pytest.raises(PlanError, match=reason):
        MultiTargetOptions(**values)


def test_each_kind_of_vehicle_gets_its_own_values():
    own = MultiTargetOptions().for_vehicle(MulticopterLimits())
    assert (own.step_m, own.speed_m_s, own.acceptance_m) == (9.0, 4.0, 2.0)
    assert MultiTargetOptions(step_m=3.0).for_vehicle(MulticopterLimits()).acceptance_m == pytest.approx(1.2)
    check_vehicle(own, MulticopterLimits())


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"speed_m_s": 30.0}, "`speed_m_s`"),
        ({"altitude_m": 500.0}, "`altitude_m`"),
        ({"area_m": (0.0, 0.0, 9000.0, 9000.0)}, "reaches"),
        ({"step_m": 400.0}, "`step_m` 400"),
    ],
)
def test_what_the_vehicle_can_not_fly_is_refused(values, reason):
    limits = MulticopterLimits()
    with pytest.raises(PlanError, match=reason):
        check_vehicle(MultiTargetOptions(**values).for_vehicle(limits), limits)


def test_targets_lie_in_clusters_apart_from_each_other():
    area = Area(south_m=-30.0, west_m=-30.0, north_m=270.0, east_m=270.0)
    for seed in range(20):
        places = np.array(TargetField().places(area, np.random.default_rng(seed)))
        assert len(places) == 18
        distance = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
        assert distance[np.triu_indices(18, 1)].min() >= 6.0
        # every third target is of the same cluster
        spread = [np.std(places[k::3], axis=0).mean() for k in range(3)]
        assert 4.0 < np.mean(spread) < 25.0
    uniform = TargetField(count=200, clusters=0).places(area, np.random.default_rng(1))
    assert np.mean(uniform, axis=0) == pytest.approx([120.0, 120.0], abs=4.0 * 300.0 / math.sqrt(12 * 200))


def test_the_world_has_the_sensor_that_the_operator_knows():
    options = MultiTargetOptions(clutter_per_scan=2.0, range_sigma_m=0.7)
    world = multi_target_world(WorldSpec.of_team(2, seed=4), options, TargetField(count=5, clusters=1))
    for vehicle in world.vehicles:
        sensor = vehicle.payload.target_sensor
        assert (sensor.gain, sensor.clutter_per_scan, sensor.range_sigma_m) == (0.98, 2.0, 0.7)
    assert len(world.targets) == 5
    again = multi_target_world(world, options, TargetField(count=9))
    assert again.targets == world.targets
    assert multi_target_world(WorldSpec(seed=5), options).targets != world.targets
    hilly = multi_target_world(WorldSpec(), options, terrain_relief_m=8.0)
    assert hilly.terrain.relief_m == 8.0


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"count": 251}, "`targets` 251"),
        ({"count": 2, "clusters": 3}, "`clusters` 3"),
        ({"cluster_sigma_m": 0.0}, "`cluster_sigma_m`"),
        ({"speed_m_s": 20.0}, "`target_speed_m_s`"),
    ],
)
def test_impossible_targets_are_named(values, reason):
    with pytest.raises(PlanError, match=reason):
        TargetField(**values)


def test_targets_without_room_are_refused():
    area = Area(south_m=0.0, west_m=0.0, north_m=20.0, east_m=20.0)
    with pytest.raises(PlanError, match="have no room"):
        TargetField(count=100, clusters=2, cluster_sigma_m=2.0).places(area, np.random.default_rng(0))


def test_an_aircraft_takes_longer_steps_and_turns_less():
    limits = FixedWingLimits()
    own = MultiTargetOptions(area_m=(-1500.0, -1500.0, 1500.0, 1500.0)).for_vehicle(limits)
    assert own.step_m == pytest.approx(2.5 * limits.turn_radius_m(own.speed_m_s))
    assert own.planner_parameters.turn_limit_rad == pytest.approx(0.5 * math.pi)
    check_vehicle(own, limits)
