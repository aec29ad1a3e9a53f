"""DO_CHANGE_SPEED is flown on the present leg and lasts until the next mode, whatever parameters are set."""

import math

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware import FLAVOUR_NAMES
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.navigation import layout as nav
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import MissionError
from missions.vehicle.firmware import Mode
from missions.vehicle.vehicle import Vehicle
from tests.system.flying import Flying

ANY_FLIGHT_PARAMETER = {"px4": "MIS_TAKEOFF_ALT", "ardupilot": "PILOT_SPEED_UP"}
CRUISE_M_S = {"px4": 5.0, "ardupilot": 10.0}
COMMANDED_M_S = 3.0


def ground_speed_m_s(flying: Flying) -> float:
    north, east, _ = flying.autopilot.navigation.state[nav.VEL_NED_M_S]
    return math.hypot(north, east)


def place(vehicle: Vehicle, north_m: float, height_m: float = 10.0) -> GeodeticPosition:
    lat, lon, alt = LocalFrame(vehicle.home).geodetic_from_ned(north_m, 0.0, -height_m)
    return GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt)


async def change_and_watch(flying: Flying, vehicle: Vehicle) -> list[float]:
    """Speeds before the command, after it, and after an unrelated parameter was set."""
    speeds = [ground_speed_m_s(flying)]
    await vehicle.set_speed(COMMANDED_M_S)
    await vehicle.clock.sleep(7.0)
    speeds.append(ground_speed_m_s(flying))
    name = ANY_FLIGHT_PARAMETER[flying.flavour]
    flying.autopilot.parameters.set(name, flying.autopilot.parameters.get(name) + 1.0)
    await vehicle.clock.sleep(5.0)
    speeds.append(ground_speed_m_s(flying))
    return speeds


async def set_out(vehicle: Vehicle, north_m: float) -> None:
    try:
        await vehicle.goto(place(vehicle, north_m), timeout_s=8.0)
    except MissionError:
        return  # still on the way: as wanted
    raise AssertionError("too near")


@pytest.mark.parametrize("flavour", FLAVOUR_NAMES)
@pytest.mark.parametrize("leg_m", [400.0, 25.0])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_in_a_mission(flavour: str, leg_m: float) -> None:
    flying = Flying(flavour)

    async def script(vehicle: Vehicle) -> list[float]:
        await vehicle.wait_ready()
        await vehicle.takeoff(10.0)
        items = [vehicle.firmware.takeoff_item(vehicle.home, 10.0)]
        for i in range(1, round(400.0 / leg_m) + 1):
            there = place(vehicle, i * leg_m)
            items.append(
                MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=there.lat_deg, y=there.lon_deg, z=10.0)
            )
        await vehicle.plans.upload_mission(items)
        await vehicle.start_mission()
        await vehicle.clock.sleep(12.0)
        speeds = await change_and_watch(flying, vehicle)
        await vehicle.hold()
        await vehicle.clock.sleep(4.0)
        await set_out(vehicle, -400.0)
        return [*speeds, ground_speed_m_s(flying)]

    cruise = CRUISE_M_S[flavour]
    wanted = [cruise, COMMANDED_M_S, COMMANDED_M_S, cruise]  # another mode: the parameter's again
    assert flying.mission(script) == pytest.approx(wanted, abs=0.4)


@pytest.mark.parametrize("flavour", FLAVOUR_NAMES)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_on_the_way_to_a_place_and_to_the_next_one(flavour: str) -> None:
    flying = Flying(flavour)

    async def script(vehicle: Vehicle) -> list[float]:
        await vehicle.wait_ready()
        await vehicle.takeoff(10.0)
        await set_out(vehicle, 400.0)
        speeds = await change_and_watch(flying, vehicle)
        await set_out(vehicle, 600.0)
        return [*speeds, ground_speed_m_s(flying)]

    wanted = [CRUISE_M_S[flavour], COMMANDED_M_S, COMMANDED_M_S, COMMANDED_M_S]
    assert flying.mission(script) == pytest.approx(wanted, abs=0.4)


@pytest.mark.parametrize("flavour", FLAVOUR_NAMES)
@pytest.mark.slow
def test_on_the_way_home(flavour: str) -> None:
    flying = Flying(flavour)

    async def script(vehicle: Vehicle) -> list[float]:
        await vehicle.wait_ready()
        await vehicle.takeoff(35.0)
        await vehicle.goto(place(vehicle, 220.0, 35.0))
        await vehicle.commands.set_mode(Mode.RETURN)
        await vehicle.clock.sleep(9.0)
        return await change_and_watch(flying, vehicle)

    wanted = [CRUISE_M_S[flavour], COMMANDED_M_S, COMMANDED_M_S]
    assert flying.mission(script) == pytest.approx(wanted, abs=0.5)
