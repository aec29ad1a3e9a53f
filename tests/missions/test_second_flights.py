"""Several flights in one session: the vehicle stands where and as the flight before has left it."""

import asyncio

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.clock import LoopClock, run
from autopilot_bridge.mission_plan import MissionItem
from flightsim.world_spec import WorldSpec
from missions.base.options import FlightOptions, Via
from missions.embedded import EmbeddedSitl
from missions.errors import VehicleTimeout
from missions.library import find_mission
from missions.runs.limits_before_flight import adapted
from missions.vehicle import Vehicle
from missions.vehicle.connection import Connection
from missions.vehicle.firmware import Mode

both = pytest.mark.parametrize("flavour", ["px4", "ardupilot"])


def fly_in_a_row(flavour: str, model: str, flights: list[FlightOptions]) -> list[Vehicle]:
    """Each flight by a client of its own, in one SITL."""
    sitl = EmbeddedSitl(WorldSpec.of_team(model=model, autopilot=flavour))
    mission = find_mission("sector")

    async def one(link, options: FlightOptions) -> Vehicle:
        async with Connection(link, LoopClock()) as connection:
            vehicle = Vehicle(connection)
            await vehicle.wait_ready()
            own, _ = adapted(mission, options, await vehicle.limits(), vehicle.home.alt_m)
            await mission.flight([vehicle], [own]).fly()
            return vehicle

    async def main() -> list[Vehicle]:
        links = [sitl.links[0], *(sitl.sitl.connect(0) for _ in flights[1:])]
        return [await one(link, options) for link, options in zip(links, flights, strict=True)]

    try:
        return run(main(), sitl.loop)
    finally:
        sitl.close()


def pattern_s(vehicle: Vehicle) -> float:
    phase = vehicle.notes.phase("pattern")
    return 0.0 if phase is None else (phase.end_us - phase.start_us) * 1e-6


@both
@pytest.mark.sampled(1)
def test_a_multicopter_flies_its_second_mission(flavour: str) -> None:
    options = FlightOptions(pattern="sector", width_m=30.0, height_m=30.0, via=Via.WAYPOINTS)
    first, second = fly_in_a_row(flavour, "iris", [options, options])
    assert pattern_s(first) > 20.0
    assert pattern_s(second) == pytest.approx(pattern_s(first), abs=3.0)
    assert second.notes.warnings == []


@pytest.mark.slow
@both
@pytest.mark.parametrize("via", Via)
def test_an_aircraft_flies_its_second_mission(flavour: str, via: Via) -> None:
    options = FlightOptions(pattern="sector", via=via)
    first, second = fly_in_a_row(flavour, "aerosonde", [options, options])
    assert pattern_s(first) > 60.0
    assert pattern_s(second) == pytest.approx(pattern_s(first), abs=5.0)


@both
@pytest.mark.parametrize("mode", ["mission", "return", "land"])
def test_a_vehicle_in_the_mode_of_its_last_flight_leaves_it_before_it_is_ready(flown, flavour, mode) -> None:
    """ArduPlane 4.6.3 after a landing: "PreArm: In landing sequence" until mode and mission change.

    PX4 1.16.1 reports no pre-arm health in Return and Land.
    """

    async def script(vehicle, autopilot):
        autopilot.mode = next(m for m, n in autopilot.kinds.items() if n == mode)
        autopilot.items, autopilot.current = [None] * 5, 4
        autopilot.unready_modes = {mode}
        await vehicle.wait_ready(20.0)
        assert vehicle.link.custom_mode == vehicle.firmware.modes[vehicle.firmware.resting_mode]
        return autopilot.current, autopilot.time_us * 1e-6

    current, seconds = flown(script, flavour, ready=False)
    assert current == (0 if mode == "mission" else 4)
    assert seconds < 10.0


def test_a_vehicle_that_is_in_the_air_keeps_its_mode(flown) -> None:
    """Disarmed in the air: a wreck, or a wrong message; in any case nothing is switched."""

    async def script(vehicle, autopilot):
        autopilot.mode = next(m for m, n in autopilot.kinds.items() if n == "return")
        autopilot.pos[2] = -20.0
        autopilot.unready_modes = {"return"}
        with pytest.raises(VehicleTimeout, match="no readiness to fly"):
            await vehicle.wait_ready(20.0)
        assert autopilot.kind == "return"

    flown(script, ready=False)


def test_what_a_wait_waits_for_is_known_while_it_lasts(flown) -> None:
    async def script(vehicle, autopilot):
        waiting = asyncio.ensure_future(vehicle.wait_ready(20.0, leave_mode=False))
        await vehicle.clock.sleep(1.0)
        assert vehicle.link.awaited == ""  # most waits are short
        await vehicle.clock.sleep(8.0)
        assert vehicle.link.awaited == "readiness to fly (missing: pre-arm checks)"
        with pytest.raises(VehicleTimeout):
            await waiting
        assert vehicle.link.awaited == ""

    flown(script, ready=False, setup=lambda autopilot: autopilot.unready_modes.add("hold"))


def test_one_that_only_observes_leaves_the_mode_alone(flown) -> None:
    async def script(vehicle, autopilot):
        await vehicle.wait_ready()
        await vehicle.commands.set_mode(Mode.MISSION)
        await vehicle.wait_ready(leave_mode=False)
        assert vehicle.link.custom_mode == vehicle.firmware.modes[Mode.MISSION]

    flown(script)


@both
def test_an_uploaded_mission_begins_anew(flown, flavour) -> None:
    async def script(vehicle, autopilot):
        autopilot.current = 52
        home = vehicle.home
        commands = (mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_WAYPOINT)
        items = [MissionItem(command=c, x=home.lat_deg, y=home.lon_deg, z=10.0) for c in commands]
        await vehicle.plans.upload_mission(items)
        return autopilot.current, vehicle.notes.warnings

    assert flown(script, flavour) == (0, [])


def test_a_loop_that_never_waits_lets_time_go_on(flown) -> None:
    """Position and messages that are there already are given at once; the world goes on all the same."""

    async def script(vehicle, autopilot):
        over = asyncio.Event()
        asyncio.get_running_loop().call_later(0.5, over.set)
        while not over.is_set():
            await vehicle.position()

    flown(script)


def test_a_full_queue_gives_other_tasks_a_turn(flown) -> None:
    async def script(vehicle, autopilot):
        over = asyncio.Event()
        with vehicle.link.messages(mavlink.MAVLink_command_ack_message) as stream:
            autopilot.ack(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0)
            asyncio.get_running_loop().call_later(0.01, over.set)
            while not over.is_set():
                await anext(stream)
                autopilot.ack(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0)  # an answer that comes at once

    flown(script)
