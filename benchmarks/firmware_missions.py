"""The whole mission set on real firmware: PX4 with its SIH and ArduPilot's SITL, copter and plane.

    python -m benchmarks.firmware_missions --out FOLDER [--px4 BUILD] [--arducopter FILE] [--arduplane FILE]
        [--firmware px4] [--vehicle plane] [--mission sector] [--speed 1] [--jobs 8]

Every mission is flown twice in one session of a firmware's process, by `flightstack fly --connect` as a user
flies it, at speeds 1 and 5, and once on the emulated autopilot of the same firmware with a vehicle of the
same class. Builds are taken from the options, or from FLIGHTSTACK_PX4, FLIGHTSTACK_ARDUCOPTER and
FLIGHTSTACK_ARDUPLANE; a firmware without a build is left out. `orbit` and `occupancy` need devices that the
simulators don't have: a refusal before the takeoff is what is expected.

FOLDER gets rows.jsonl (a row after each flight), table.md and the run folders. Called again with the same
FOLDER, what has its rows is not flown again; `--table` only prints. Exit code 1: a flight did not end as
expected.
"""

import argparse
import itertools
import json
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from benchmarks.firmware import FIRMWARES, VEHICLES, Firmware, FirmwareMissing
from benchmarks.firmware_cases import CASES
from benchmarks.firmware_table import EMULATED, Row, Session, cell, row_of, rows_in, sessions, table

SPEEDS: Final = (1.0, 5.0)
MAX_JOBS: Final = 10
JOBS: Final = 8
"""Sessions side by side in real time, where a firmware uses little of a processor."""
QUICK_JOBS: Final = 2
_FLIGHT_S: Final = 1500.0  # of vehicle time, at most
_BOOT_S: Final = 240.0  # of wall time: imports, compilation and a busy machine
_POLL_S: Final = 0.5
_END_S: Final = 60.0


class Campaign:
    """Flies sessions side by side, and keeps their rows.

    Args:
        out: folder of everything.
        builds: by (firmware, vehicle).
        jobs: sessions side by side; None: as many as usual at their speed.
    """

    def __init__(self, out: Path, builds: Mapping[tuple[str, str], Firmware], jobs: int | None) -> None:
        self.out = out
        self.stopping = threading.Event()
        self._builds = builds
        self._jobs = jobs
        self._lock = threading.Lock()
        self._instances: queue.Queue[int] = queue.Queue()
        for instance in range(MAX_JOBS):
            self._instances.put(instance)

    @property
    def rows_file(self) -> Path:
        """A JSON object a line."""
        return self.out / "rows.jsonl"

    def fly(self, wanted: Sequence[Session]) -> None:
        """Fly what has no rows yet."""
        done = rows_in(self.rows_file)
        missing = [
            session
            for session in wanted
            if any(
                (*asdict(session).values(), flight) not in done for flight in range(1, session.flights + 1)
            )
        ]
        for speed, together in itertools.groupby(missing, key=lambda session: session.speed):
            self._fly_together(list(together), self._jobs or (JOBS if speed == 1.0 else QUICK_JOBS))

    def _fly_together(self, wanted: Sequence[Session], jobs: int) -> None:
        with ThreadPoolExecutor(jobs) as pool:
            flown = [pool.submit(self._fly_session, session) for session in wanted]
            try:
                for each in flown:
                    each.result()
            except BaseException:
                self.stopping.set()
                pool.shutdown(cancel_futures=True)
                raise

    def _fly_session(self, session: Session) -> None:
        if self.stopping.is_set():
            return
        folder = self._new_folder(session.name)
        instance = self._instances.get()
        case = CASES[session.mission]
        try:
            if session.speed == EMULATED:
                arguments = case.emulated_arguments(session.firmware, session.vehicle, folder)
                running: Any = nullcontext(None)
            else:
                build = self._builds[session.firmware, session.vehicle]
                arguments = case.arguments_on(session.firmware, session.vehicle, folder)
                arguments += ["--connect", build.address(instance), "--yes"]
                running = build.running(folder / "firmware", instance=instance, speed=session.speed)
            with running as firmware:
                for flight in range(1, session.flights + 1):
                    if self.stopping.is_set():
                        return
                    self._keep(self._fly_once(session, flight, arguments, folder, firmware))
        finally:
            self._instances.put(instance)

    def _new_folder(self, name: str) -> Path:
        for number in itertools.count(1):
            folder = self.out / (name if number == 1 else f"{name}-{number}")
            if not folder.exists():
                folder.mkdir(parents=True)
                return folder
        raise AssertionError("numbers don't end")

    def _fly_once(
        self, session: Session, flight: int, arguments: list[str], folder: Path, firmware: Any
    ) -> Row:
        run = folder / f"run{flight}"
        said = folder / f"run{flight}.txt"
        command = [sys.executable, "-m", "missions", "fly", *arguments, "--no-picture", "--out", str(run)]
        began_s = time.monotonic()
        deadline_s = began_s + _BOOT_S + _FLIGHT_S / (session.speed or 5.0)
        with said.open("wb") as output:
            process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT
            )
            ended_here = False
            while process.poll() is None:
                if self.stopping.is_set() or time.monotonic() > deadline_s:
                    ended_here = True
                    _end(process)
                time.sleep(_POLL_S)
        text = said.read_text(encoding="utf-8", errors="replace")
        if firmware is not None and firmware.poll() is not None:
            text += f" (the firmware's process has ended with {firmware.returncode})"
        code = None if ended_here else process.returncode
        return row_of(session, flight, run, code, text, time.monotonic() - began_s)

    def _keep(self, row: Row) -> None:
        if self.stopping.is_set():
            return  # it was cut off
        with self._lock:
            with self.rows_file.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(row)) + "\n")
            mark = "" if row.well else "NOT AS EXPECTED "
            name = Path(row.folder).parent.name
            sys.stdout.write(f"{name} flight {row.flight}: {mark}{cell(row)} ({row.wall_s:.0f} s)\n")
            sys.stdout.flush()


def _end(process: "subprocess.Popen[bytes]") -> None:
    """End a flight as a user does: wait until the vehicle is left safely; then end it at once."""
    process.terminate()
    try:
        process.wait(_END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def chosen_builds(chosen: argparse.Namespace) -> dict[tuple[str, str], Firmware]:
    """The firmware builds of what was chosen; those that are missing are named and left out."""
    given = {
        ("px4", "copter"): chosen.px4,
        ("px4", "plane"): chosen.px4,
        ("ardupilot", "copter"): chosen.arducopter,
        ("ardupilot", "plane"): chosen.arduplane,
    }
    builds = {}
    for firmware, vehicle in itertools.product(chosen.firmware or FIRMWARES, chosen.vehicle or VEHICLES):
        try:
            builds[firmware, vehicle] = Firmware.find(firmware, vehicle, given[firmware, vehicle])
        except FirmwareMissing as missing:
            sys.stderr.write(f"left out: {missing}\n")
    return builds


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--out", type=Path, required=True, help="folder of rows, table and runs")
    made.add_argument("--px4", type=Path, help="PX4's build folder, with bin/px4")
    made.add_argument("--arducopter", type=Path, help="ArduPilot's arducopter, in its source tree")
    made.add_argument("--arduplane", type=Path, help="ArduPilot's arduplane, in its source tree")
    made.add_argument("--firmware", action="append", choices=FIRMWARES, help="repeat; default: both")
    made.add_argument("--vehicle", action="append", choices=VEHICLES, help="repeat; default: both")
    made.add_argument("--mission", action="append", choices=tuple(CASES), help="repeat; default: all")
    made.add_argument("--speed", action="append", type=speed_of, help="repeat; default: 1 and 5")
    made.add_argument(
        "--jobs", type=jobs_of, default=8, help=f"sessions side by side, 1..{MAX_JOBS}; default 8"
    )
    made.add_argument("--no-emulator", action="store_true", help="real firmware alone")
    made.add_argument("--table", action="store_true", help="fly nothing: print the table of --out")
    return made


def speed_of(text: str) -> float:
    """A speed factor."""
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not 0.1 <= speed <= 100.0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a speed factor of 0.1 to 100, such as 5")
    return speed


def jobs_of(text: str) -> int:
    """A number of jobs: PX4 has ports for ten instances."""
    if text not in {str(number) for number in range(1, MAX_JOBS + 1)}:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of sessions from 1 to {MAX_JOBS}")
    return int(text)


def main(arguments: Sequence[str] | None = None) -> int:
    """Fly what was chosen, and print the table."""
    chosen = parser().parse_args(arguments)
    campaign: Campaign | None = None
    if not chosen.table:
        builds = chosen_builds(chosen)
        if not builds:
            sys.stderr.write("no firmware to fly; give the path of a build\n")
            return 2
        chosen.out.mkdir(parents=True, exist_ok=True)
        campaign = Campaign(chosen.out, builds, chosen.jobs)
        missions, speeds = chosen.mission or tuple(CASES), list(chosen.speed or SPEEDS)
        if not chosen.no_emulator:
            speeds.append(EMULATED)
        wanted = sessions(builds, speeds, missions)
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        try:
            campaign.fly(wanted)
        except KeyboardInterrupt:
            sys.stderr.write(f"interrupted; the rows so far are in {campaign.rows_file}\n")
            return 130
    rows = rows_in(chosen.out / "rows.jsonl")
    text = table(rows)
    if campaign is not None:
        (chosen.out / "table.md").write_text(text, encoding="utf-8")
    sys.stdout.write(text)
    return 0 if all(row.well for row in rows.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
