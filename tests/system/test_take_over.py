"""The take-over matrix: after a mode that the program did not command, it sends nothing more to the vehicle.

A pilot at a second ground station (or a failsafe that the pilot provokes by parameters) changes the mode in
flight. What the program sends afterwards is counted in the log of the flight.
"""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import pytest

from autopilot_bridge.clock import LoopClock
from autopilot_bridge.mavlink import decode, definition, dialect
from autopilot_bridge.mavlink.components import GROUND_STATION
from autopilot_bridge.tlog import TlogReader
from missions.base.mission import Mission
from missions.base.options import FlightOptions, Via
from missions.base.request import RunRequest
from missions.embedded import EmbeddedSitl
from missions.library import find_mission
from missions.runs import session
from missions.runs.vehicle_opening import VehicleOpener, embedded_stage
from missions.vehicle import Mode, Setpoint, Vehicle
from missions.vehicle.connection import Connection
from missions.vehicle.telemetry import Position

PILOT: Final = (255, 50)
"""ArduPilot takes RC_CHANNELS_OVERRIDE from system 255 only (SYSID_MYGCS)."""
HEARTBEAT: Final = definition("HEARTBEAT").message_id
PARAMETERS: Final[Mapping[str, Mapping[str, float]]] = {
    "px4": {"COM_RC_OVERRIDE": 3, "COM_RC_IN_MODE": 1, "GF_ACTION": 3, "COM_LOW_BAT_ACT": 3},
    "ardupilot": {
        "BATT_LOW_VOLT": 10.5, "BATT_FS_LOW_ACT": 1, "FENCE_ENABLE": 1, "FENCE_TYPE": 1, "FENCE_ACTION": 1,
    },
}  # fmt: skip
"""Reactions that the pilot has set before the flight."""
STABILIZE: Final = {"px4": (7.0, 0.0), "ardupilot": (0.0, 0.0)}
GPS: Final = float(dialect.FAILURE_UNIT_SENSOR_GPS)


def commanding(mode: Mode) -> Callable[[Vehicle], Awaitable[None]]:
    async def command(pilot: Vehicle) -> None:
        await pilot.commands.set_mode(mode)

    return command


async def _manual(pilot: Vehicle, x: int, until: Callable[[], bool]) -> None:
    """Sticks by MANUAL_CONTROL, or by RC channels on ArduPilot."""
    for _ in range(100):
        if pilot.autopilot == "px4":
            pilot.link.connection.send(dialect.MAVLink_manual_control_message(1, x, 0, 500, 0, 0))
        else:
            pilot.link.connection.send(
                dialect.MAVLink_rc_channels_override_message(1, 1, 1500, 1500, 1500, 1500, *[x] * 1, 0, 0, 0)  # type: ignore[call-arg]
            )
        await asyncio.sleep(0.1)
        if until():
            return


async def by_sticks(pilot: Vehicle) -> None:
    """PX4: the moved stick; ArduPilot: the switch of the modes, from its last to its second position."""
    before = pilot.link.custom_mode

    def changed() -> bool:
        return pilot.link.custom_mode != before

    for x in (0, 900) if pilot.autopilot == "px4" else (1800, 1300):
        started_us = pilot.clock.time_us
        await _manual(pilot, x, lambda since=started_us: changed() or pilot.clock.time_us > since + 1_500_000)
    await _manual(pilot, 900 if pilot.autopilot == "px4" else 1300, lambda: False)


async def position(pilot: Vehicle) -> None:
    """Position (PX4) or Loiter, flown by sticks."""
    sticks = asyncio.ensure_future(_manual(pilot, 0, lambda: False))
    await asyncio.sleep(1.0)
    await pilot.commands.set_mode(Mode.POSITION)
    await sticks


async def stabilize(pilot: Vehicle) -> None:
    sticks = asyncio.ensure_future(_manual(pilot, 0, lambda: False))
    await asyncio.sleep(1.0)
    await pilot.try_command(dialect.MAV_CMD_DO_SET_MODE, 1.0, *STABILIZE[pilot.autopilot])
    await sticks


async def battery(pilot: Vehicle) -> None:
    if pilot.autopilot == "px4":
        await pilot.set_parameters({"BAT_LOW_THR": 0.995, "BAT_CRIT_THR": 0.99})
    else:
        await pilot.set_parameters({"SIM_BATT_VOLTAGE": 10.0})


async def fence(pilot: Vehicle) -> None:
    await pilot.set_parameter(
        *(("GF_MAX_VER_DIST", 5.0) if pilot.autopilot == "px4" else ("FENCE_ALT_MAX", 10.0))
    )


async def gps(pilot: Vehicle) -> None:
    if pilot.autopilot == "px4":
        await pilot.command(dialect.MAV_CMD_INJECT_FAILURE, GPS, float(dialect.FAILURE_TYPE_OFF), 0.0)
    else:
        await pilot.set_parameter("SIM_GPS_DISABLE", 1.0)


TAKE_OVERS: Final[Mapping[str, Callable[[Vehicle], Awaitable[None]]]] = {
    "hold": commanding(Mode.HOLD),
    "land": commanding(Mode.LAND),
    "return": commanding(Mode.RETURN),
    "position": position,
    "stabilize": stabilize,
    "sticks": by_sticks,
    "battery": battery,
    "fence": fence,
    "gps": gps,
}


class Script(Mission[FlightOptions]):
    """A user's own mission that waits for nothing of the vehicle when it is taken."""

    name = "script"

    async def fly(self, vehicle: Vehicle, options: FlightOptions) -> None:
        await vehicle.takeoff(14.0)
        async with vehicle.guided() as guided:
            await guided.follow(lambda t: Setpoint(position_ned_m=(0.0, 0.0, -14.0)) if t < 1.0 else None)
            vehicle.notes.begin("pattern", vehicle.clock.stamp_us)
            await vehicle.clock.sleep(300.0)
        await vehicle.return_to_launch()


SMALL: Final = FlightOptions(width_m=60.0, height_m=40.0, pattern="L2", altitude_m=14.0, speed_m_s=3.0)
KINDS: Final[Mapping[str, tuple[Mission[Any], FlightOptions]]] = {
    "waypoints": (find_mission("lissajous"), replace(SMALL, via=Via.WAYPOINTS)),
    "setpoints": (find_mission("lissajous"), replace(SMALL, via=Via.SETPOINTS)),
    "script": (Script(), SMALL),
    "team": (find_mission("lissajous"), replace(SMALL, via=Via.WAYPOINTS, vehicles=2)),
}


class Taken(VehicleOpener):
    """Opens an embedded world with a pilot, who takes the first vehicle in the pattern."""

    def __init__(self, take: Callable[[Vehicle], Awaitable[None]]) -> None:
        self._take = take
        self._sitl: EmbeddedSitl | None = None
        self._pilot: asyncio.Task[None] | None = None
        self.mode = 0
        """Custom mode when the pilot acts."""

    def open_world(self, request: RunRequest, folder: Any) -> Any:
        self._sitl = EmbeddedSitl(request.embedded_world)
        return embedded_stage(self._sitl)

    def look(self, flight: session.Flight) -> None:
        vehicle = flight.vehicles[0] if flight.vehicles else None
        ready = vehicle is not None and all(v.notes.current == "pattern" for v in flight.vehicles)
        if self._pilot is None and vehicle is not None and ready:
            position = vehicle.latest(Position)
            assert position is not None and position.height_m > 11.0
            self.mode = vehicle.link.custom_mode
            self._pilot = asyncio.get_running_loop().create_task(self._act())

    async def _act(self) -> None:
        assert self._sitl is not None
        async with Connection(self._sitl.sitl.connect(0), LoopClock(), identity=PILOT) as connection:
            pilot = Vehicle(connection)
            await pilot.wait_heartbeat()
            await self._take(pilot)
            await asyncio.sleep(60.0)


def sent_afterwards(log: Path, before: int) -> list[str]:
    """Names of what the program sent to vehicle 1 after its first heartbeat with another mode in the air."""
    taken = False
    names: list[str] = []
    for _, frame in TlogReader(log):
        if (frame.system_id, frame.component_id) == (1, 1) and frame.message_id == HEARTBEAT:
            if decode(frame).custom_mode == before:  # type: ignore[attr-defined]
                taken, names = False, []  # on the way to the pattern
            else:
                taken = True
        elif taken and (frame.system_id, frame.component_id) == GROUND_STATION:
            message = decode(frame)
            if message.get_type() != "HEARTBEAT" and getattr(message, "target_system", 1) == 1:
                names.append(message.get_type())
    assert taken
    return names


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("by", TAKE_OVERS)
@pytest.mark.sampled(5)
def test_nothing_is_sent_to_a_vehicle_that_another_one_has(
    by: str, kind: str, flavour: str, tmp_path: Path
) -> None:
    mission, options = KINDS[kind]
    opener = Taken(TAKE_OVERS[by])
    world = RunRequest(options=options).embedded_world
    world = replace(
        world,
        vehicles=tuple(
            replace(vehicle, autopilot=flavour, parameters=dict(PARAMETERS[flavour]))
            for vehicle in world.vehicles
        ),
    )
    request = RunRequest(options=options, world=world, out=tmp_path / "run", picture=False)
    result = session.fly(mission, request, opener.look, opener=opener)
    assert result.outcome == "failed"
    assert " has the vehicle, mode " in result.reason and result.reason.count("nothing was commanded") == 1
    left = {one.system_id: one for one in result.left}
    assert left[1].commands == () and "has it" in left[1].withheld
    assert sent_afterwards(tmp_path / "run" / "flight.tlog", opener.mode) == []
    if by in ("battery", "fence", "gps"):
        assert "failsafe" in result.reason
    if kind == "team":  # the other one is the program's own
        assert [c.answer for c in left[2].commands] == ["done"] and left[2].withheld == ""
