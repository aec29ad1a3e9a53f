"""What is refused before anything is started, and what each kind of vehicle gets."""

import math
from dataclasses import replace

import pytest

from estimators.magnetic_identification.parameters import IdentificationParameters
from flightsim.world_spec import WorldSpec
from missions.errors import PlanError
from missions.occupancy.checks import check_vehicle, for_vehicle, layout_of
from missions.occupancy.magnetic_target import MagneticTarget
from missions.occupancy.mission import OccupancyMission
from missions.occupancy.options import OccupancyOptions
from missions.occupancy.parameters import DecisionParameters, Identify
from missions.occupancy.world import drawn_false_anomalies, drawn_target, occupancy_world
from missions.vehicle.limits import FixedWingLimits, MulticopterLimits
from tests.missions.held_options import with_fields

WINGS = FixedWingLimits(
    airspeed_min_m_s=18.0,
    airspeed_trim_m_s=25.0,
    airspeed_max_m_s=30.0,
    bank_max_rad=math.radians(45.0),
    wind_m_s=5.0,
)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"width_m": -1.0}, "`width_m`"),
        ({"height_m": 1e6}, "`height_m`"),
        ({"cell_m": 0.0}, "`cell_m`"),
        ({"cell_m": 2000.0}, "`cell_m`"),
        ({"neighbourhood": 0}, "`neighbourhood`"),
        ({"heading_penalty": -1.0}, "`heading_penalty`"),
        ({"detection_probability": 1.0}, "`detection_probability`"),
        ({"detection_range_m": 0.0}, "`detection_range_m`"),
        ({"threshold_nt": 1.0}, "`threshold_nt` 1 nT is below 3 standard deviations"),
        ({"noise_nt": 2.0}, "`noise_nt`"),
        ({"confirmations": 0}, "`confirmations`"),
        ({"raise_radius_m": 0.0}, "`raise_radius_m`"),
        ({"search_time_s": 0.0}, "`search_time_s`"),
        ({"search_time_s": 1e6}, "`search_time_s`"),
        ({"area_ne_m": (math.nan, 0.0)}, "`area_ne_m`"),
        ({"vehicles": 0}, "`vehicles`"),
    ],
)
def test_impossible_values_are_refused_by_name(values, words):
    with pytest.raises(PlanError, match=words):
        with_fields(OccupancyOptions(), **values)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"cell_m": 60.0}, "`cell_m` 60 m is too small .* ask for `cell_m` 120 or more"),
        ({"altitude_m": 110.0, "vehicles": 3, "index": 2}, "`altitude_m`"),
        ({"altitude_m": 5.0}, "`altitude_m`"),
        ({"width_m": 45_000.0, "cell_m": 1000.0}, "reaches"),
        ({"area_ne_m": (25_000.0, 0.0)}, "reaches"),
        ({"speed_m_s": 40.0}, "airspeed 40"),
    ],
)
def test_what_an_aircraft_cannot_fly_is_refused_by_name(values, words):
    with pytest.raises(PlanError, match=words):
        check_vehicle(for_vehicle(OccupancyOptions(**values), WINGS), WINGS)


def test_cells_an_aircraft_cannot_turn_in_are_reached_by_a_larger_neighbourhood():
    options = for_vehicle(OccupancyOptions(cell_m=60.0, decision=DecisionParameters(neighbourhood=3)), WINGS)
    check_vehicle(options, WINGS)
    rotors = MulticopterLimits()
    check_vehicle(for_vehicle(OccupancyOptions(cell_m=60.0), rotors), rotors)


def test_each_kind_of_vehicle_has_its_own_habits_and_speed():
    options = OccupancyOptions()
    wings, rotors = for_vehicle(options, WINGS), for_vehicle(options, MulticopterLimits())
    assert (wings.speed_m_s, rotors.speed_m_s) == (25.0, 10.0)
    assert rotors.decision_parameters.heading_penalty < wings.decision_parameters.heading_penalty
    chosen = for_vehicle(OccupancyOptions(heading_penalty=0.7, speed_m_s=8.0), MulticopterLimits())
    assert (chosen.heading_penalty, chosen.speed_m_s) == (0.7, 8.0)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"amplitude_nt": 2.0}, "`amplitude_nt` 2 nT of the target is not beyond `threshold_nt`"),
        ({"sigma_along_m": 0.0}, "`sigma_along_m` 0 is not possible"),
        ({"sigma_across_m": math.nan}, "`sigma_across_m` nan is not possible"),
        ({"moment_a_m2": -1.0}, "`moment_a_m2` -1 is not possible"),
        ({"depth_m": 2000.0}, "`depth_m` 2000 m is not in -1000..1000 m"),
        ({"place_ne_m": (0.0, 1300.0)}, "`target_ne_m` 0,1300 is outside the searched map"),
    ],
)
def test_an_impossible_target_is_refused_by_name(values, words):
    with pytest.raises(PlanError, match=words):
        occupancy_world(WorldSpec(), OccupancyOptions(), MagneticTarget(**values))


def test_the_target_follows_the_seed_and_nothing_else():
    options = OccupancyOptions(vehicles=3)
    first, _ = drawn_target(options, 1)
    assert drawn_target(replace(options, vehicles=1, cell_m=100.0), 1)[0] == pytest.approx(first)
    assert drawn_target(options, 2)[0] != first
    for seed in range(50):
        assert layout_of(options).contains(*drawn_target(options, seed)[0])
    assert drawn_target(options, 1, (10.0, 20.0))[0] == (10.0, 20.0)


def test_the_world_of_a_search_has_magnetometers_and_a_map_with_room_around_the_area(tmp_path):
    options = OccupancyOptions(area_ne_m=(300.0, -100.0))
    world = occupancy_world(WorldSpec(seed=1), options)
    field = world.magnetic_field
    assert field.map_file is None
    assert 0.5 * field.height_m >= 300.0 + 1200.0 + 200.0
    assert 0.5 * field.width_m >= 100.0 + 1200.0 + 200.0
    assert all(vehicle.payload.magnetometer for vehicle in world.vehicles)
    assert (
        occupancy_world(world, options, MagneticTarget(place_ne_m=(0.0, 0.0))) == world
    )  # its own field stays
    given = occupancy_world(WorldSpec(), replace(options, map_file=str(tmp_path / "map.npz")))
    assert given.magnetic_field.map_file == tmp_path / "map.npz"
    published = OccupancyMission().with_map(options, tmp_path / "made.npz")
    assert published.map_file == str(tmp_path / "made.npz")


def test_a_map_that_is_none_is_refused_before_the_flight(tmp_path):
    (tmp_path / "map.npz").write_bytes(b"no map")
    options = for_vehicle(OccupancyOptions(map_file=str(tmp_path / "map.npz")), WINGS)
    with pytest.raises(PlanError, match="is not a magnetic map"):
        OccupancyMission().check(options, WINGS)
    with pytest.raises(PlanError, match="takes none"):
        OccupancyMission().check(replace(options, map_file=None, arguments={"x": "1"}), WINGS)


def test_classes_of_an_identification_are_checked_with_the_options():
    with pytest.raises(ValueError, match="targets names no class"):
        IdentificationParameters(targets=())
    with pytest.raises(ValueError, match="class 'x' is not accepted; give NAME:gaussian"):
        IdentificationParameters(false_anomalies=("x",))
    submarine = IdentificationParameters(targets=("sub:dipole:15:50:150",), false_anomalies=())
    with pytest.raises(PlanError, match=r"`identify=trace`: no class that is sought \(sub\) is Gaussian"):
        OccupancyOptions(identify=Identify.TRACE, identification=submarine)
    OccupancyOptions(identify=Identify.BAYES, identification=submarine)
    weak = IdentificationParameters(threshold_nt=40.0)
    OccupancyOptions(identification=weak)
    with pytest.raises(PlanError, match="`identify=bayes`: amplitude_nt 30 of class target does not exceed"):
        OccupancyOptions(identify=Identify.BAYES, identification=weak)


def test_false_anomalies_are_apart_and_follow_from_the_seed():
    options = OccupancyOptions()
    found = drawn_false_anomalies(options, 3, 5, (0.0, 0.0))
    again = drawn_false_anomalies(options, 3, 5, (0.0, 0.0))
    assert found == again != drawn_false_anomalies(options, 4, 5, (0.0, 0.0))
    places = [(0.0, 0.0), *((s.north_m, s.east_m) for s in found)]
    assert min(math.dist(a, b) for k, a in enumerate(places) for b in places[:k]) >= 500.0
    assert all(layout_of(options).contains(*place) for place in places)
    with pytest.raises(PlanError, match="`false_count` 60 does not fit into the area"):
        drawn_false_anomalies(options, 3, 60, (0.0, 0.0))
