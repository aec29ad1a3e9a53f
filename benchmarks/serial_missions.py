"""The missions over a serial line as narrow as a real one, both flavours, at 57600 and 921600 baud.

    python -m benchmarks.serial_missions [--baud 57600] [--flavour px4] [--mission plan] [--unplug]

For each a `flightstack sitl` at one end and `flightstack fly --connect` at the other, each with the rate of
the line; at a speedup the line is so much faster by the wall clock. A row tells how the mission ended, what
of the line was used, how long bytes waited for it, how many commands there were, how many had to be repeated
and how long the slowest answer took, and the rates of telemetry that were left: ATTITUDE,
GLOBAL_POSITION_INT, HEARTBEAT. All times are the vehicle's (`tests.serial_meter`). With `--unplug` the line
is pulled out in flight, longer than failsafes wait, and put in again.

Exit code 1: a mission did not end as planned, or bytes waited for half a second. After unplugging, a mission
whose autopilot has left the guided mode may end with its reason. Repeated commands are reported and not
judged: a machine that stops makes a mission ask again. `orbit` steers by received messages, and loses its
target when the machine can't keep up: give it a lower speedup.
"""

import argparse
import itertools
import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Thread
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from autopilot_bridge.mavlink import decode, decode_as, definition, dialect
from autopilot_bridge.tlog import TlogReader
from tests.clients.sitl_process import running_sitl
from tests.serial_line import SerialLine, serial_line
from tests.serial_meter import LineMeter

FLAVOURS = ("px4", "ardupilot")
BAUDS = (57600, 921600)
LONGEST_WAIT_S = 0.5
UNPLUGGED_S = 10.0
"""Of vehicle time; looking for the device takes up to a second of the wall clock more."""
DEADLINE_S = 1800.0
_LONG, _INT, _ACK = (definition(name).message_id for name in ("COMMAND_LONG", "COMMAND_INT", "COMMAND_ACK"))
SCRIPT = """
from missions.vehicle import Setpoint
import math


async def fly(vehicle, options):
    await vehicle.wait_ready()
    await vehicle.takeoff(10.0)
    await vehicle.goto_ned(10.0, 0.0, -10.0)
    await vehicle.follow(
        lambda t: Setpoint(position_ned_m=(10.0 * math.cos(0.3 * t), 10.0 * math.sin(0.3 * t), -10.0))
        if t < 40.0
        else None,
        rate_hz=50.0,
    )
    await vehicle.return_to_launch()
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """One mission.

    Attributes:
        arguments: of `flightstack fly`.
        vehicle: of `flightstack sitl`.
        unplug_after_s: in the air.
    """

    arguments: tuple[str, ...]
    vehicle: tuple[str, ...] = ()
    unplug_after_s: float = 20.0


SMALL = ("--size", "40", "--altitude", "10")
ORBITED = ("--target", "200,100")
MISSIONS = {
    "lissajous": Flight(arguments=("lissajous", "--pattern", "L1", *SMALL)),
    "setpoints": Flight(arguments=("lissajous", "--pattern", "L1", *SMALL, "--via", "setpoints")),
    "sector": Flight(arguments=("sector", *SMALL)),
    "parallel-sweep": Flight(arguments=("parallel-sweep", *SMALL)),
    "expanding-square": Flight(arguments=("expanding-square", *SMALL)),
    "plan": Flight(arguments=("PLAN",)),
    "script": Flight(arguments=("SCRIPT",)),
    "orbit": Flight(
        arguments=("orbit", *ORBITED, "--duration", "120"),
        vehicle=("--model", "aerosonde", "--camera", "--video", "off", *ORBITED, "--wind", "4@0"),
        unplug_after_s=200.0,
    ),
    "occupancy": Flight(
        arguments=("occupancy", "--size", "800", "--map", "MAP"),
        vehicle=("--model", "aerosonde", "--map-target", "150,250", "--map", "MAP"),
        unplug_after_s=150.0,
    ),
}
"""Aircraft for orbit and occupancy, whose devices the vehicle carries."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answers:
    """Commands of a mission, by its log.

    Attributes:
        commands: sent for the first time.
        repeated: sent again.
        slowest_s: from the first of them to the answer.
    """

    commands: int
    repeated: int
    slowest_s: float


def answers(log: Path) -> Answers:
    """How the vehicle's autopilot answered."""
    sent_us: dict[int, int] = {}
    commands = repeated = slowest_us = 0
    for time_us, frame in TlogReader(log):
        if frame.message_id in (_LONG, _INT):
            message = decode(frame)
            assert isinstance(
                message, dialect.MAVLink_command_long_message | dialect.MAVLink_command_int_message
            )
            if message.target_component not in (0, 1):
                continue
            if message.command in sent_us:
                repeated += 1
            else:
                commands += 1
                sent_us[message.command] = time_us
        elif frame.message_id == _ACK and frame.component_id == 1:
            since_us = sent_us.pop(decode_as(frame, dialect.MAVLink_command_ack_message).command, None)
            if since_us is not None:
                slowest_us = max(slowest_us, time_us - since_us)
    return Answers(commands=commands, repeated=repeated, slowest_s=slowest_us * 1e-6)


def unplug_in_flight(line: SerialLine, meter: LineMeter, after_s: float, speedup: float, over: Event) -> None:
    """Pull the plug out when the vehicle has been in the air for so long, and put it in again."""
    while not over.wait(0.05):
        if meter.airborne_s > after_s:
            line.unplug()
            over.wait(UNPLUGGED_S / speedup)
            line.plug()
            return


def fly(
    name: str, flavour: str, baud: int, speedup: float, folder: Path, *, unplug: bool = False
) -> tuple[str, bool]:
    """Fly one mission; gives its row, and whether all was well."""
    flight = MISSIONS[name]
    files = made_files(flight, flavour, folder)
    arguments, vehicle = (
        [str(files.get(text, text)) for text in texts] for texts in (flight.arguments, flight.vehicle)
    )
    meter, over = LineMeter(baud), Event()
    taps = (meter.take_down, meter.take_up)
    with (
        serial_line(folder / "line", round(baud * speedup), latency_s=0.005 / speedup, taps=taps) as line,
        running_sitl(flavour, [line.vehicle], speedup=speedup, options=vehicle),
    ):
        command = [sys.executable, "-m", "missions", "fly", *arguments, "--connect", line.ground]
        command += ["--yes", "--no-picture", "--out", str(folder / "run")]
        hand = Thread(target=unplug_in_flight, args=(line, meter, flight.unplug_after_s, speedup, over))
        if unplug:
            hand.start()
        done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=False)
        over.set()
        if unplug:
            hand.join()
    file = folder / "run" / "summary.json"
    if not file.exists():
        return f"did not begin: {(done.stdout + done.stderr).strip()[-200:]}", False
    return row(json.loads(file.read_text()), done.returncode, meter, baud, folder, unplug=unplug)


def row(
    summary: dict[str, Any], code: int, meter: LineMeter, baud: int, folder: Path, *, unplug: bool
) -> tuple[str, bool]:
    """What is printed of a flight, and whether all was well."""
    seconds = summary["sim_time_s"] or 1.0
    rates = [
        summary["message_counts"].get(key, 0) / seconds
        for key in ("ATTITUDE", "GLOBAL_POSITION_INT", "HEARTBEAT")
    ]
    answered = answers(folder / "run" / "flight.tlog")
    measured_s = max(meter.vehicle_s, 1.0)
    down, up = (size * 10.0 / (baud * measured_s) for size in (meter.down_bytes, meter.up_bytes))
    waited_s = max(meter.down.longest_wait_s, meter.up.longest_wait_s)
    reason = "" if code == 0 else f"  {summary['reason'][:160]}"
    if unplug:
        reason = f"  out for {meter.longest_gap_s:.0f} s{reason}"
    well = code == 0
    if unplug:
        well = code == 0 or (code == 1 and "left the guided mode" in reason)
        waited_s = meter.down.longest_wait_s  # the clock of the other way stands while the line is out
        well = well and meter.longest_gap_s > 0.8 * UNPLUGGED_S
    return (
        f"{summary['outcome']:<10} {seconds:5.0f} s, {100.0 * down:3.0f} % down {100.0 * up:3.0f} % up, "
        f"waits {meter.down.longest_wait_s:4.2f} {meter.up.longest_wait_s:4.2f} s, "
        f"{answered.commands:3d} commands, {answered.repeated} repeated, "
        f"slowest {answered.slowest_s:4.2f} s, rates "
        + " ".join(f"{rate_hz:5.1f}" for rate_hz in rates)
        + reason,
        well and waited_s < LONGEST_WAIT_S,
    )


def made_files(flight: Flight, flavour: str, folder: Path) -> dict[str, Path]:
    """Files that a mission is flown from, by the word that stands for them."""
    words = (*flight.arguments, *flight.vehicle)
    files: dict[str, Path] = {}
    if "SCRIPT" in words:
        files["SCRIPT"] = folder / "script.py"
        files["SCRIPT"].write_text(SCRIPT)
    if "PLAN" in words:
        files["PLAN"] = folder / "sector.plan"
        command = [sys.executable, "-m", "missions", "fly", "sector", *SMALL, "--autopilot", flavour]
        command += ["--export-plan", str(files["PLAN"])]
        subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=True)
    if "MAP" in words:
        files["MAP"] = magnetic_map(flavour, folder)
    return files


def magnetic_map(flavour: str, folder: Path) -> Path:
    """The map of the firmware's place, as an embedded `fly occupancy` publishes it when it begins."""
    run = folder / "embedded"
    search = ["occupancy", "--size", "800", "--autopilot", flavour, "--model", "aerosonde", "--no-picture"]
    command = [sys.executable, "-m", "missions", "fly", *search, "--out", str(run)]
    subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=True)
    return run / "magnetic_map.npz"


def main() -> int:
    """Fly what was chosen, and print a row for each."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--baud", type=int, choices=BAUDS, help="one rate alone")
    parser.add_argument("--flavour", choices=FLAVOURS, help="one flavour alone")
    parser.add_argument("--mission", choices=tuple(MISSIONS), help="one mission alone")
    parser.add_argument("--speedup", type=float, default=8.0)
    parser.add_argument("--unplug", action="store_true", help="pull the line out in flight")
    chosen = parser.parse_args()
    failed = False
    for name, flavour, baud in itertools.product(
        (chosen.mission,) if chosen.mission else tuple(MISSIONS),
        (chosen.flavour,) if chosen.flavour else FLAVOURS,
        (chosen.baud,) if chosen.baud else BAUDS,
    ):
        with tempfile.TemporaryDirectory() as folder:
            row, well = fly(name, flavour, baud, chosen.speedup, Path(folder), unplug=chosen.unplug)
        failed |= not well
        sys.stdout.write(f"{name:<17}{flavour:<10}{baud:>7}  {'' if well else 'MISSED '}{row}\n")
        sys.stdout.flush()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
