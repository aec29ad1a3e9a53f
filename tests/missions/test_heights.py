"""Heights below home: refused before anything is sent, unless the user allows them."""

import math

import pytest

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import PlanError
from missions.vehicle.heights import low_items, refuse_low_items
from missions.vehicle.setpoint import Setpoint

WAYPOINT, LAND = dialect.MAV_CMD_NAV_WAYPOINT, dialect.MAV_CMD_NAV_LAND
HOME_ALT_M = 584.0
RELATIVE, ABSOLUTE, TERRAIN = 6, 5, 11


def at(height_m: float, frame: int, command: int = WAYPOINT) -> MissionItem:
    return MissionItem(command=command, frame=frame, x=-35.36, y=149.16, z=height_m)


@pytest.mark.parametrize(
    ("item", "home_alt_m", "height_m"),
    [
        (at(-5.0, RELATIVE), None, -5.0),
        (at(100.0, ABSOLUTE), HOME_ALT_M, -484.0),
        (at(100.0, ABSOLUTE), None, None),  # home is not known yet
        (at(584.0, ABSOLUTE), HOME_ALT_M, None),
        (at(-2.0, TERRAIN), HOME_ALT_M, -2.0),
        (at(0.0, RELATIVE), HOME_ALT_M, None),
        (at(-0.4, RELATIVE), HOME_ALT_M, None),  # home itself moves as much
        (at(-5.0, RELATIVE, LAND), HOME_ALT_M, None),
        (at(-5.0, 2, dialect.MAV_CMD_DO_CHANGE_SPEED), HOME_ALT_M, None),
    ],
)
def test_each_height_is_judged_in_its_own_frame(item, home_alt_m, height_m) -> None:
    assert [found.height_m for found in low_items([item], home_alt_m)] == ([height_m] if height_m else [])


def test_the_error_names_items_and_altitudes() -> None:
    items = [at(20.0, RELATIVE), at(100.0, ABSOLUTE), at(90.0, ABSOLUTE)]
    with pytest.raises(
        PlanError,
        match=r"item 2 \(NAV_WAYPOINT\): altitude 100 m above mean sea level is 484 m below home "
        r"\(584 m .*; also item 3 .*frame 3.* `allow_below_home`",
    ):
        refuse_low_items(items, HOME_ALT_M, below_home_allowed=False)
    refuse_low_items(items, HOME_ALT_M, below_home_allowed=True)
    with pytest.raises(PlanError, match=r"item 1 .*: altitude -2 m above the ground is 2 m below it"):
        refuse_low_items([at(-2.0, TERRAIN)], HOME_ALT_M, below_home_allowed=True)


def below(vehicle) -> GeodeticPosition:
    home = vehicle.home
    return GeodeticPosition(lat_deg=home.lat_deg, lon_deg=home.lon_deg, alt_m=home.alt_m - 10.0)


COMMANDS = {
    "goto_ned": lambda v: v.goto_ned(20.0, 0.0, 10.0),
    "goto": lambda v: v.goto(below(v)),
    "change_altitude": lambda v: v.change_altitude(-10.0),
    "follow": lambda v: v.follow(lambda t: Setpoint(position_ned_m=(0.0, 0.0, 10.0)) if t < 1.0 else None),
    "upload_mission": lambda v: v.plans.upload_mission([at(-10.0, RELATIVE)]),
}


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.sampled(5)
def test_no_command_goes_below_home(flown, flavour, name) -> None:
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        with pytest.raises(PlanError, match=r"10(\.0)? m below home.*`allow_below_home`"):
            await COMMANDS[name](vehicle)
        assert (autopilot.setpoints, autopilot.items) == ([], [])
        assert autopilot.kind != "guided" or autopilot.flavour == "ardupilot"
        assert dialect.MAV_CMD_DO_REPOSITION not in [command for command, _ in autopilot.commands]

    flown(script, flavour)


def test_setpoints_that_come_below_home_end_the_flight_before_they_are_sent(flown) -> None:
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        with pytest.raises(PlanError, match=r"follow, 5.\d s: 0.6 m below home"):
            await vehicle.follow(lambda t: Setpoint(position_ned_m=(0.0, 0.0, -10.0 + 2.0 * t)))
        assert max(m.z for _, m in autopilot.setpoints) < 1.0

    flown(script)


def test_where_the_ground_is_lower_it_can_be_allowed(flown) -> None:
    async def script(vehicle, autopilot):
        await vehicle.takeoff(10.0)
        vehicle.allow_below_home = True
        await vehicle.change_altitude(-10.0)
        assert autopilot.commands[-1][0] == dialect.MAV_CMD_DO_REPOSITION
        with pytest.raises(PlanError, match="nan m can't be flown"):
            await vehicle.change_altitude(math.nan)

    flown(script)
