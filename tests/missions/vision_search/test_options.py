"""Options of the vision search: what is refused, and what suits a vehicle."""

import math

import pytest

from missions.errors import PlanError
from missions.search.area import edges
from missions.vehicle.limits import FixedWingLimits, MulticopterLimits
from missions.vision_search.for_vehicle import check_vehicle, for_vehicle
from missions.vision_search.options import LocalizeKind, VisionSearchOptions
from tests.missions.held_options import with_fields

COPTER = MulticopterLimits()
WINGS = FixedWingLimits()


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        (edges((10.0, 0.0, 0.0, 10.0)), "north_m must be above south_m"),
        (edges((0.0, 0.0, 3e4, 1e3)), "`area_m` has a side of 30000 m"),
        ({"passes": 0}, "`passes` 0 is not in 1..1000"),
        ({"tag_id": 255}, "tag_id 255 is not in 0..254"),
        ({"loss": 1.1}, "`loss` 1.1 is not in 0..1"),
        ({"delay_s": -1.0}, "`delay_s` -1 s is not in 0..60 s"),
        ({"repeats": 0}, "`repeats` 0 is not in 1..10"),
        ({"view_rad": 3.0}, "`view_rad` 171.887 degrees is not in 5.72958..166.158 degrees"),
        ({"target_size_m": 0.0}, "target_size_m 0"),
        ({"horizon": 9}, "`horizon` 9 is not in 1..8"),
        ({"cell_m": 0.001}, "`cell_m` 0.001 m makes"),
        ({"forward_sigma_m": -1.0}, "forward_sigma_m -1"),
        ({"search_time_s": 1e6}, "`search_time_s` 1e.06 is not possible"),
    ],
)
def test_impossible_values_are_named(changes, reported):
    with pytest.raises(ValueError, match=reported):
        with_fields(VisionSearchOptions(), **changes)


def test_a_multicopter_and_an_aircraft_get_values_that_suit_them():
    copter = for_vehicle(VisionSearchOptions(), COPTER)
    assert (copter.step_m, copter.speed_m_s, copter.acceptance_m, copter.altitude_m) == (20.0, 8.0, 8.0, 60.0)
    wings = for_vehicle(VisionSearchOptions(), WINGS)
    assert wings.altitude_m == 90.0 and wings.separation_m == 10.0
    assert wings.speed_m_s == WINGS.airspeed_trim_m_s
    assert wings.step_m == pytest.approx(2.5 * WINGS.turn_radius_m(WINGS.airspeed_trim_m_s))
    assert wings.turn_limit_rad == pytest.approx(0.5 * math.pi)
    assert for_vehicle(VisionSearchOptions(altitude_m=70.0), WINGS).altitude_m == 70.0
    assert copter.own_spacing_m == pytest.approx(0.8 * 120.0 * math.tan(math.radians(35.0)))


@pytest.mark.parametrize(
    ("limits", "changes", "reported"),
    [
        (COPTER, edges((0.0, 0.0, 6000.0, 100.0)), "reaches 6001 m from home"),
        (COPTER, {"curve": "L9"}, "`curve` 'L9' is not known; there are L1, L2, L3, L4"),
        (COPTER, {"speed_m_s": 30.0}, "speed 30 m/s"),
        (COPTER, {"altitude_m": 119.0, "vehicles": 2, "index": 1}, "altitude 125 m"),
        (WINGS, {"step_m": 5.0}, "`step_m` 5 m is too short for an aircraft"),
        (WINGS, {"localize": LocalizeKind.ORBIT}, "ask for `localize` passes"),
    ],
)
def test_what_a_vehicle_cannot_fly_is_refused(limits, changes, reported):
    options = for_vehicle(with_fields(VisionSearchOptions(), **changes), limits)
    with pytest.raises(PlanError, match=reported):
        check_vehicle(options, limits)
