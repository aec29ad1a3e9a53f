"""Options of a search, and the worlds they are flown in."""

import math

import numpy as np
import pytest

from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.multi_target.for_vehicle import check_vehicle, for_vehicle
from missions.multi_target.options import MultiTargetOptions
from missions.multi_target.target_field import TargetField
from missions.multi_target.world import multi_target_world, places_of
from missions.search.area import Area, edges
from missions.vehicle.limits import FixedWingLimits, MulticopterLimits
from tests.missions.held_options import with_fields


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"steps": 0}, "`steps` 0"),
        (edges((0.0, 0.0, 0.0, 10.0)), "is empty"),
        (edges((0.0, 0.0, 5_000.0, 50_000.0)), "`area_m`"),
        ({"start_ne_m": (900.0, 0.0)}, "`start_ne_m` 900,0"),
        ({"undetected": 0.0}, "`undetected` 0"),
        ({"search_time_s": 1e6}, "`search_time_s`"),
        ({"gain": 2.0}, "gain 2"),
        ({"found_width_m": -1.0}, "found_width_m -1"),
        ({"place_sigma_m": -1.0}, "place_sigma_m -1"),
    ],
)
def test_impossible_options_are_named(values, reason):
    with pytest.raises(ValueError, match=reason):
        with_fields(MultiTargetOptions(start_ne_m=(0.0, 0.0)), **values)


def test_each_kind_of_vehicle_gets_its_own_values():
    own = for_vehicle(MultiTargetOptions(), MulticopterLimits())
    assert (own.step_m, own.speed_m_s, own.acceptance_m) == (9.0, 4.0, 2.0)
    assert for_vehicle(MultiTargetOptions(step_m=3.0), MulticopterLimits()).acceptance_m == pytest.approx(1.2)
    check_vehicle(own, MulticopterLimits())


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"speed_m_s": 30.0}, "`speed_m_s`"),
        ({"altitude_m": 500.0}, "`altitude_m`"),
        (edges((0.0, 0.0, 9000.0, 9000.0)), "reaches"),
        ({"step_m": 400.0}, "`step_m` 400"),
    ],
)
def test_what_the_vehicle_can_not_fly_is_refused(values, reason):
    limits = MulticopterLimits()
    with pytest.raises(PlanError, match=reason):
        check_vehicle(for_vehicle(with_fields(MultiTargetOptions(), **values), limits), limits)


def test_targets_lie_in_clusters_apart_from_each_other():
    area = Area(south_m=-30.0, west_m=-30.0, north_m=270.0, east_m=270.0)
    for seed in range(20):
        places = np.array(places_of(TargetField(), area, np.random.default_rng(seed)))
        assert len(places) == 18
        distance = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
        assert distance[np.triu_indices(18, 1)].min() >= 6.0
        # every third target is of the same cluster
        spread = [np.std(places[k::3], axis=0).mean() for k in range(3)]
        assert 4.0 < np.mean(spread) < 25.0
    uniform = places_of(TargetField(count=200, clusters=0), area, np.random.default_rng(1))
    assert np.mean(uniform, axis=0) == pytest.approx([120.0, 120.0], abs=4.0 * 300.0 / math.sqrt(12 * 200))


def test_the_world_has_the_sensor_that_the_operator_knows():
    options = with_fields(MultiTargetOptions(), clutter_per_scan=2.0, range_sigma_m=0.7)
    world = multi_target_world(WorldSpec.of_team(2, seed=4), options, TargetField(count=5, clusters=1))
    for vehicle in world.vehicles:
        sensor = vehicle.payload.target_sensor
        assert (sensor.gain, sensor.clutter_per_scan, sensor.range_sigma_m) == (0.98, 2.0, 0.7)
    assert len(world.targets) == 5
    again = multi_target_world(world, options, TargetField(count=9))
    assert again.targets == world.targets
    assert multi_target_world(WorldSpec(seed=5), options).targets != world.targets
    hilly = multi_target_world(WorldSpec(), options, TargetField(terrain_relief_m=8.0))
    assert hilly.terrain.relief_m == 8.0


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"count": 251}, "`count` 251"),
        ({"count": 2, "clusters": 3}, "`clusters` 3"),
        ({"cluster_sigma_m": 0.0}, "`cluster_sigma_m`"),
        ({"speed_m_s": 20.0}, "`speed_m_s`"),
    ],
)
def test_impossible_targets_are_named(values, reason):
    with pytest.raises(PlanError, match=reason):
        TargetField(**values)


def test_targets_without_room_are_refused():
    area = Area(south_m=0.0, west_m=0.0, north_m=20.0, east_m=20.0)
    with pytest.raises(PlanError, match="have no room"):
        places_of(TargetField(count=100, clusters=2, cluster_sigma_m=2.0), area, np.random.default_rng(0))


def test_an_aircraft_takes_longer_steps_and_turns_less():
    limits = FixedWingLimits()
    area = edges((-1500.0, -1500.0, 1500.0, 1500.0))
    own = for_vehicle(with_fields(MultiTargetOptions(), **area), limits)
    assert own.step_m == pytest.approx(2.5 * limits.turn_radius_m(own.speed_m_s))
    assert own.planner_parameters.turn_limit_rad == pytest.approx(0.5 * math.pi)
    check_vehicle(own, limits)
