"""What is refused before anything is started, and what each kind of vehicle gets."""

import math
from dataclasses import replace

import pytest

from missions.errors import PlanError
from missions.mission import Mission
from missions.occupancy.mission import OccupancyMission, drawn_target
from missions.occupancy.options import OccupancyOptions, check_vehicle
from missions.planning.limits import FixedWingLimits, MulticopterLimits
from missions.scenario import Setting

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
        ({"amplitude_nt": 2.0}, "`amplitude_nt`"),
        ({"sigma_along_m": 0.0}, "`sigma_along_m`"),
        ({"confirmations": 0}, "`confirmations`"),
        ({"raise_radius_m": 0.0}, "`raise_radius_m`"),
        ({"search_time_s": 0.0}, "`search_time_s`"),
        ({"search_time_s": 1e6}, "`search_time_s`"),
        ({"target_ne_m": (0.0, 1300.0)}, "`target_ne_m` 0,1300 is outside the searched map"),
        ({"area_ne_m": (math.nan, 0.0)}, "`area_ne_m`"),
        ({"vehicles": 0}, "`vehicles`"),
    ],
)
def test_impossible_values_are_refused_by_name(values, words):
    with pytest.raises(PlanError, match=words):
        OccupancyOptions(**values)


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
        check_vehicle(OccupancyOptions(**values).for_vehicle(WINGS), WINGS)


def test_cells_an_aircraft_cannot_turn_in_are_reached_by_a_larger_neighbourhood():
    options = OccupancyOptions(cell_m=60.0, neighbourhood=3).for_vehicle(WINGS)
    check_vehicle(options, WINGS)
    check_vehicle(OccupancyOptions(cell_m=60.0).for_vehicle(MulticopterLimits()), MulticopterLimits())


def test_each_kind_of_vehicle_has_its_own_habits_and_speed():
    options = OccupancyOptions()
    wings, rotors = options.for_vehicle(WINGS), options.for_vehicle(MulticopterLimits())
    assert (wings.speed_m_s, rotors.speed_m_s) == (25.0, 10.0)
    assert rotors.decision_parameters.heading_penalty < wings.decision_parameters.heading_penalty
    chosen = OccupancyOptions(heading_penalty=0.7, speed_m_s=8.0).for_vehicle(MulticopterLimits())
    assert (chosen.heading_penalty, chosen.speed_m_s) == (0.7, 8.0)


def test_the_target_follows_the_seed_and_nothing_else():
    options = OccupancyOptions(vehicles=3)
    first, _ = drawn_target(options, 1)
    assert drawn_target(replace(options, vehicles=1, cell_m=100.0), 1)[0] == pytest.approx(first)
    assert drawn_target(options, 2)[0] != first
    for seed in range(50):
        assert options.layout.contains(*drawn_target(options, seed)[0])
    given = replace(options, target_ne_m=(10.0, 20.0))
    assert drawn_target(given, 1)[0] == (10.0, 20.0)


def test_a_world_is_asked_for_with_room_around_the_area(tmp_path):
    mission: Mission = OccupancyMission()
    options = OccupancyOptions(area_ne_m=(300.0, -100.0))
    survey = mission.scenario(options, Setting(seed=1, folder=tmp_path)).survey
    assert survey is not None
    assert survey.publish_to == tmp_path / "magnetic_map.npz"
    assert 0.5 * survey.height_m >= 300.0 + 1200.0 + 200.0
    assert 0.5 * survey.width_m >= 100.0 + 1200.0 + 200.0


def test_a_map_that_is_none_is_refused_before_the_flight(tmp_path):
    (tmp_path / "map.npz").write_bytes(b"no map")
    options = OccupancyOptions(map_file=str(tmp_path / "map.npz")).for_vehicle(WINGS)
    with pytest.raises(PlanError, match="is not a magnetic map"):
        OccupancyMission().check(options, WINGS)
    with pytest.raises(PlanError, match="takes none"):
        OccupancyMission().check(replace(options, map_file=None, arguments={"x": "1"}), WINGS)
