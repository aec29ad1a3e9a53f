"""The take-over matrix on real firmware: what a mission sends after a pilot or a failsafe has the vehicle.

    python -m benchmarks.take_over --out FOLDER [--firmware px4] [--vehicle copter] [--kind script] [--by gps]

A mission is flown on PX4 1.16.1 (SIH) or ArduPilot 4.6.3 (SITL). In its pattern a second ground station
changes the mode by a command, moves sticks or the mode switch, or provokes a failsafe by parameters. The row
of a cell has the mode that the vehicle changed to, the number of messages that the mission sent to it after
the first heartbeat with that mode, and the reason that the run states. Builds are found as by
`benchmarks.firmware_missions`. Exit code 1: a mission sent something, or did not end with a take-over.
"""

import argparse
import itertools
import json
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from pymavlink import mavutil

from autopilot_bridge.mavlink import decode, decode_as, definition, dialect
from autopilot_bridge.mavlink.components import GROUND_STATION
from autopilot_bridge.tlog import TlogReader
from benchmarks.firmware import FIRMWARES, VEHICLES, Firmware, FirmwareMissing
from missions.base.mission import Mission
from missions.base.options import FlightOptions, Via
from missions.base.request import RunRequest
from missions.library import find_mission
from missions.runs import session
from missions.vehicle import Mode, Setpoint, Vehicle, VehicleKind
from missions.vehicle.firmware_records import FIRMWARES as RECORDS

PILOT: Final = (255, 50)
"""ArduPilot takes RC_CHANNELS_OVERRIDE from system 255 only (SYSID_MYGCS)."""
HEARTBEAT: Final = definition("HEARTBEAT").message_id
REACTIONS: Final[Mapping[str, Mapping[str, float]]] = {
    "px4": {"COM_RC_OVERRIDE": 3, "GF_ACTION": 3, "COM_LOW_BAT_ACT": 3},
    "ardupilot": {"BATT_LOW_VOLT": 10.5, "BATT_FS_LOW_ACT": 2, "FENCE_TYPE": 1, "FENCE_ACTION": 1},
}
"""Reactions that are set before the flight."""
_MODES: Final = {"hold": Mode.HOLD, "land": Mode.LAND, "return": Mode.RETURN, "position": Mode.POSITION}
_STABILIZE: Final[Mapping[tuple[str, str], tuple[float, float]]] = {
    ("px4", "copter"): (7.0, 0.0),
    ("px4", "plane"): (7.0, 0.0),
    ("ardupilot", "copter"): (0.0, 0.0),
    ("ardupilot", "plane"): (2.0, 0.0),
}
PROVOKED: Final[Mapping[tuple[str, str], Mapping[str, float]]] = {
    ("px4", "battery"): {"SIM_BAT_MIN_PCT": 6.0, "SIM_BAT_DRAIN": 2.0},
    ("px4", "fence"): {"GF_MAX_VER_DIST": 5.0},
    ("px4", "gps"): {"SIM_GPS_USED": 0.0},
    ("ardupilot", "battery"): {"SIM_BATT_VOLTAGE": 10.0},
    ("ardupilot", "fence"): {"FENCE_ALT_MAX": 10.0, "FENCE_ENABLE": 1.0},
    ("ardupilot", "gps"): {"SIM_GPS_DISABLE": 1.0},
}
BY: Final = (*_MODES, "stabilize", "sticks", "battery", "fence", "gps")
KINDS: Final = ("waypoints", "setpoints", "script", "team")
"""`team` is two vehicles by waypoints, of which the first one is taken."""
_INTEGERS: Final = {"SIM_GPS_DISABLE": 2, "FENCE_ENABLE": 2, "SIM_GPS_USED": 6}
"""MAV_PARAM_TYPE of those that are no REAL32; of an integer PX4 reads the bits: 0 has the same."""
_REAL32: Final = 9


class Script(Mission[FlightOptions]):
    """A user's own mission that waits for nothing of the vehicle when it is taken."""

    name = "script"

    async def fly(self, vehicle: Vehicle, options: FlightOptions) -> None:
        await vehicle.takeoff(options.altitude_m)
        down_m = -options.altitude_m
        if vehicle.kind is VehicleKind.FIXED_WING:
            await vehicle.wing.loiter(wait=False)
            vehicle.notes.begin("pattern", vehicle.clock.stamp_us)
            await vehicle.clock.sleep(300.0)
            return
        async with vehicle.guided() as guided:
            await guided.follow(lambda t: Setpoint(position_ned_m=(0.0, 0.0, down_m)) if t < 1.0 else None)
            vehicle.notes.begin("pattern", vehicle.clock.stamp_us)
            await vehicle.clock.sleep(300.0)


class Pilot:
    """A second ground station, which acts once in the pattern.

    Args:
        firmware, vehicle: names.
        instance: of the firmware's process.
        by: how it takes the vehicle.
    """

    def __init__(self, firmware: str, vehicle: str, instance: int, by: str) -> None:
        self.firmware, self.vehicle, self.by = firmware, vehicle, by
        self.mode: int | None = None
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        self._address = (
            f"udpout:127.0.0.1:{18570 + instance}"
            if firmware == "px4"
            else f"tcp:127.0.0.1:{5762 + 10 * instance}"
        )
        self._system_id = instance + 1

    def look(self, flight: session.Flight) -> None:
        """Act when the vehicle is in the pattern."""
        vehicle = flight.vehicles[0] if flight.vehicles else None
        if self._thread is None and vehicle is not None and vehicle.notes.current == "pattern":
            self.mode = vehicle.link.custom_mode
            self._thread = threading.Thread(target=self._act, daemon=True)
            self._thread.start()

    def end(self) -> None:
        """End what it sends."""
        self._over.set()
        if self._thread is not None:
            self._thread.join()

    def _act(self) -> None:
        link = mavutil.mavlink_connection(
            self._address, source_system=PILOT[0], source_component=PILOT[1], dialect="all"
        )
        started = True
        for tick in itertools.count():
            if self._over.wait(0.1):
                break
            with suppress(OSError):
                while link.recv_msg() is not None:
                    pass
                if tick % 10 == 0:
                    link.mav.heartbeat_send(6, 8, 0, 0, 4)
                self._sticks(link, tick)
                if tick in (12, 22) and started:
                    self._once(link)
        link.close()

    def _sticks(self, link: Any, tick: int) -> None:
        if self.by not in ("sticks", "position", "stabilize"):
            return
        moved = self.by == "sticks" and tick > 12
        if self.firmware == "px4":
            link.mav.manual_control_send(self._system_id, 900 if moved else 0, 0, 500, 0, 0)
        else:
            channels = [1500, 1500, 1500, 1500, 0, 0, 0, 0]
            channels[4 if self.vehicle == "copter" else 7] = 1300 if moved else 1800
            link.mav.rc_channels_override_send(
                self._system_id, 1, *(channels if self.by == "sticks" else [1500] * 4 + [0] * 4)
            )

    def _once(self, link: Any) -> None:
        kind = VehicleKind.MULTICOPTER if self.vehicle == "copter" else VehicleKind.FIXED_WING
        record = RECORDS[self.firmware, kind]
        if self.by in _MODES or self.by == "stabilize":
            command = record.mode_command(_MODES[self.by]) if self.by in _MODES else None
            main, sub = (
                _STABILIZE[self.firmware, self.vehicle] if command is None else (command.main, command.sub)
            )
            self._command(link, dialect.MAV_CMD_DO_SET_MODE, 1.0, main, sub)
        for name, value in PROVOKED.get((self.firmware, self.by), {}).items():
            link.mav.param_set_send(self._system_id, 1, name.encode(), value, _INTEGERS.get(name, _REAL32))

    def _command(self, link: Any, command: int, *params: float) -> None:
        values = (*params, *(0.0,) * (7 - len(params)))
        link.mav.command_long_send(self._system_id, 1, command, 0, *values)


def sent_afterwards(log: Path, system_id: int, before: int) -> tuple[int | None, list[str]]:
    """The mode that a vehicle changed to from the mode `before`, and the names of what a flight sent to it
    after the first heartbeat with it, without heartbeats.
    """
    taken: int | None = None
    names: list[str] = []
    for _, frame in TlogReader(log):
        if (frame.system_id, frame.component_id, frame.message_id) == (system_id, 1, HEARTBEAT):
            mode = decode_as(frame, dialect.MAVLink_heartbeat_message).custom_mode
            if mode == before:
                taken, names = None, []  # on the way to the pattern
            elif taken is None:
                taken = mode
        elif taken is not None and (frame.system_id, frame.component_id) == GROUND_STATION:
            message = decode(frame)
            if message.get_type() != "HEARTBEAT" and getattr(message, "target_system", 0) == system_id:
                names.append(message.get_type())
    return taken, names


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One flight."""

    firmware: str
    vehicle: str
    kind: str
    by: str


def fly_cell(cell: Cell, build: Firmware, out: Path, instance: int, speed: float) -> dict[str, Any]:
    """Fly one cell; returns its row."""
    folder = out / f"{cell.firmware}-{cell.vehicle}-{cell.kind}-{cell.by}"
    size = {"width_m": 60.0, "height_m": 40.0, "altitude_m": 14.0, "speed_m_s": 3.0}
    if cell.vehicle == "plane":
        size = {"width_m": 800.0, "height_m": 600.0, "altitude_m": 60.0}
    instances = [instance, instance + 1] if cell.kind == "team" else [instance]
    options = FlightOptions(**size, vehicles=len(instances))  # type: ignore[arg-type]
    if cell.kind in list(Via):
        options = replace(options, via=Via(cell.kind))
    mission: Mission[Any] = Script() if cell.kind == "script" else find_mission("lissajous")
    pilot = Pilot(cell.firmware, cell.vehicle, instance, cell.by)
    with ExitStack() as stack:
        for number in instances:
            stack.enter_context(build.running(folder / f"firmware{number}", instance=number, speed=speed))
        request = RunRequest(
            options=options,
            connect=[build.address(number) for number in instances],
            parameters=dict(REACTIONS[cell.firmware]),
            out=folder / "run",
            picture=False,
        )
        try:
            result = session.fly(mission, request, pilot.look)
        finally:
            pilot.end()
    row: dict[str, Any] = {
        "firmware": cell.firmware, "vehicle": cell.vehicle, "kind": cell.kind, "by": cell.by,
        "reason": result.reason, "left": [one.text for one in result.left], "mode": None, "sent": None,
    }  # fmt: skip
    if pilot.mode is not None and result.left:
        system_id = result.left[0].system_id
        taken, names = sent_afterwards(folder / "run" / "flight.tlog", system_id, pilot.mode)
        kind = VehicleKind.MULTICOPTER if cell.vehicle == "copter" else VehicleKind.FIXED_WING
        name = RECORDS[cell.firmware, kind].mode_name
        row |= {"mode": None if taken is None else name(taken), "sent": len(names)}
    row["ok"] = row["sent"] == 0 and " has the vehicle, mode " in result.reason
    return row


def main() -> int:
    """Fly the chosen cells; the rows go to rows.jsonl and to the standard output."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--firmware", choices=FIRMWARES, action="append")
    parser.add_argument("--vehicle", choices=VEHICLES, action="append")
    parser.add_argument("--kind", choices=KINDS, action="append")
    parser.add_argument("--by", choices=BY, action="append")
    parser.add_argument("--instance", type=int, default=0)
    parser.add_argument("--speed", type=float, default=1.0)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    failed = False
    write: Callable[[str], int] = sys.stdout.write
    for names in itertools.product(
        given.firmware or FIRMWARES, given.vehicle or VEHICLES, given.kind or KINDS, given.by or BY
    ):
        cell = Cell(**dict(zip(("firmware", "vehicle", "kind", "by"), names, strict=True)))
        try:
            build = Firmware.find(cell.firmware, cell.vehicle)
        except FirmwareMissing as error:
            write(f"left out: {error}\n")
            continue
        row = fly_cell(cell, build, given.out, given.instance, given.speed)
        failed = failed or not row["ok"]
        with (given.out / "rows.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        write(json.dumps(row) + "\n")
        sys.stdout.flush()
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
