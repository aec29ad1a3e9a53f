"""The missions over a serial line as narrow as a real one, both flavours, at 57600 and 921600 baud.

    python -m benchmarks.serial_missions [--baud 57600] [--flavour px4] [--mission lissajous] [--speedup 8]

For each a `flightstack sitl` at one end and `flightstack fly --connect` at the other, each told the rate of
the line; at a speedup the line is so much faster by the wall clock. A row tells how the mission ended, how
much of the line was used, how long bytes waited for it, and the rates of telemetry that were left. Exit
code 1: a mission did not end as planned, or bytes waited for half a second of vehicle time and more.
"""

import argparse
import itertools
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from tests.clients.sitl_process import running_sitl
from tests.serial_line import serial_line

FLAVOURS = ("px4", "ardupilot")
BAUDS = (57600, 921600)
LONGEST_WAIT_S = 0.5
DEADLINE_S = 1800.0
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
    """

    arguments: tuple[str, ...]
    vehicle: tuple[str, ...] = ()


SMALL = ("--size", "40", "--altitude", "10")
ORBITED = ("--target", "200,100")
MISSIONS = {
    "lissajous": Flight(arguments=("lissajous", "--pattern", "L1", *SMALL)),
    "setpoints": Flight(arguments=("lissajous", "--pattern", "L1", *SMALL, "--via", "setpoints")),
    "sector": Flight(arguments=("sector", *SMALL)),
    "parallel-sweep": Flight(arguments=("parallel-sweep", *SMALL)),
    "expanding-square": Flight(arguments=("expanding-square", *SMALL)),
    "script": Flight(arguments=("SCRIPT",)),
    "orbit": Flight(
        arguments=("orbit", *ORBITED), vehicle=("--model", "aerosonde", "--camera", *ORBITED, "--wind", "4@0")
    ),
    "occupancy": Flight(
        arguments=("occupancy", "--size", "800", "--map", "MAP"),
        vehicle=("--model", "aerosonde", "--map-target", "150,250", "--map", "MAP"),
    ),
}
"""Aircraft for orbit and occupancy, whose devices the vehicle carries."""


def fly(name: str, flavour: str, baud: int, speedup: float, folder: Path) -> tuple[str, bool]:
    """Fly one mission; gives its row, and whether all was well."""
    flight = MISSIONS[name]
    script = folder / "script.py"
    script.write_text(SCRIPT)
    files = {"SCRIPT": script}
    if "MAP" in flight.vehicle:
        files["MAP"] = magnetic_map(flavour, folder)
    arguments, vehicle = (
        [str(files.get(text, text)) for text in texts] for texts in (flight.arguments, flight.vehicle)
    )
    start_s = time.monotonic()
    with (
        serial_line(folder / "line", round(baud * speedup)) as line,
        running_sitl(flavour, [line.vehicle], speedup=speedup, options=vehicle),
    ):
        command = [sys.executable, "-m", "missions", "fly", *arguments, "--connect", line.ground]
        command += ["--yes", "--no-picture", "--out", str(folder / "run")]
        done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=False)
        carried, waited_s = line.down.carried_bytes, speedup * line.down.longest_wait_s
        up, up_waited_s = line.up.carried_bytes, speedup * line.up.longest_wait_s
    file = folder / "run" / "summary.json"
    if not file.exists():
        return f"did not begin: {(done.stdout + done.stderr).strip()[-200:]}", False
    summary = json.loads(file.read_text())
    seconds = summary["sim_time_s"] or 1.0
    counts = summary["message_counts"]
    wall_s = time.monotonic() - start_s
    rates = " ".join(
        f"{counts.get(key, 0) / seconds:5.1f}" for key in ("ATTITUDE", "GLOBAL_POSITION_INT", "HEARTBEAT")
    )
    # the line was open longer than the mission: it is compared with the wall clock
    share = 10.0 * carried / (baud * speedup * wall_s)
    well = done.returncode == 0 and max(waited_s, up_waited_s) < LONGEST_WAIT_S
    reason = "" if done.returncode == 0 else f"  {summary['reason'][:100]}"
    return (
        f"{summary['outcome']:<10} {seconds:6.0f} s {100.0 * share:4.0f} % down, {up / seconds:6.0f} B/s up, "
        f"waits {waited_s:4.2f} {up_waited_s:4.2f} s, rates {rates}{reason}",
        well,
    )


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
    chosen = parser.parse_args()
    failed = False
    for name, flavour, baud in itertools.product(
        (chosen.mission,) if chosen.mission else tuple(MISSIONS),
        (chosen.flavour,) if chosen.flavour else FLAVOURS,
        (chosen.baud,) if chosen.baud else BAUDS,
    ):
        with tempfile.TemporaryDirectory() as folder:
            row, well = fly(name, flavour, baud, chosen.speedup, Path(folder))
        failed |= not well
        sys.stdout.write(f"{name:<17}{flavour:<10}{baud:>7}  {'' if well else 'MISSED '}{row}\n")
        sys.stdout.flush()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
