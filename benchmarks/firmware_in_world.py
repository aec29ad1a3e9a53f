"""The missions in one world under three autopilots: real PX4, real ArduPilot, and their emulations.

    python -m benchmarks.firmware_in_world --out FOLDER [--firmware px4=BUILD] [--firmware ardupilot=FILE]
        [--mission orbit] [--vehicle plane] [--autopilot real] [--seed 1] [--flights 2]

Each mission is flown as a user flies it: `flightstack fly MISSION --firmware ...`, and the same without
`--firmware`. World, seed, vehicle and airframe parameters are the same, so what differs is the autopilot
(docs/firmware/real.md). Without `--firmware` the builds of FLIGHTSTACK_PX4, FLIGHTSTACK_ARDUCOPTER and
FLIGHTSTACK_ARDUPLANE are flown, and those that are missing are left out.

FOLDER gets rows.jsonl (a row after each flight), table.md and the run folders; called again with the same
FOLDER, what has its row is not flown again. Exit code 1: a flight of a real firmware ended otherwise than the
emulated one.
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from autopilot_bridge.firmware_process.build import FIRMWARES, FirmwareBuild
from benchmarks.same_flights import HOME, PLAN, write_plan
from flightsim.airframe import AirframeKind

VEHICLES: Final[Mapping[str, tuple[AirframeKind, str]]] = {
    "copter": (AirframeKind.MULTICOPTER, "iris"),
    "plane": (AirframeKind.FIXED_WING, "aerosonde"),
}
MISSIONS: Final[Mapping[str, Mapping[str, tuple[str, ...]]]] = {
    "lissajous": {
        "copter": ("--pattern", "L1", "--size", "60"),
        "plane": ("--pattern", "L1", "--size", "600"),
    },
    "sector": {"copter": ("--size", "80"), "plane": ("--size", "1000")},
    "orbit": {"plane": ("--duration", "120")},
    "occupancy": {
        "copter": ("--size", "300", "--cell", "100", "--altitude", "50", "--identify", "bayes"),
        "plane": ("--size", "800", "--identify", "bayes"),
    },
    "multi-target": {
        "copter": ("--steps", "20", "--area=-50,-50,50,50", "--targets", "4"),
        "plane": ("--steps", "20"),
    },
    "vision-search": {"copter": ("--vehicles", "2", "--area=-60,-60,60,60")},
    "survey": {"plane": ("--size", "400", "--spacing", "100")},
    "handoff": {"plane": ("--vehicles", "2")},
    "plan-file": {"copter": ("--home", f"{HOME[0]},{HOME[1]},488")},
    "own-script": {"copter": ()},
}
"""Options of the missions by the vehicles that fly them."""
FILES: Final = {"plan-file": PLAN, "own-script": "examples/own_mission.py"}
REAL: Final = "real"
EMULATED: Final = "emulated"
_LIMIT_S: Final = 7200.0
_LEFT_OUT: Final = (
    "completed:",
    "failed:",
    "interrupted:",
    "still air",
    "wind ",
    "run:",
    "messages left out",
)

Row = dict[str, Any]


def fly(out: Path, mission: str, vehicle: str, firmware: str, build: FirmwareBuild | None, seed: int) -> Row:
    """Fly one mission; its row."""
    name = f"{mission}-{vehicle}-{firmware}-{EMULATED if build is None else REAL}-{seed}"
    folder = out / name
    flown = FILES.get(mission, mission)
    if flown == PLAN:
        write_plan(out)
        flown = str(out / PLAN)
    command = [
        *(sys.executable, "-m", "missions", "fly", flown),
        *("--model", VEHICLES[vehicle][1], "--seed", str(seed), "--out", str(folder)),
        *MISSIONS[mission][vehicle],
        *(("--autopilot", firmware) if build is None else ("--firmware", str(build))),
    ]
    began_s = time.monotonic()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT_S, check=False)
        code, text, error = done.returncode, done.stdout, done.stderr.strip().rpartition("\n")[2]
    except subprocess.TimeoutExpired:
        code, text, error = -1, "", f"still flying after {_LIMIT_S:g} s"
    summary_path = folder / "summary.json"
    summary = json.loads(summary_path.read_text()) if summary_path.exists() else {}
    return {
        "mission": mission,
        "vehicle": vehicle,
        "firmware": firmware,
        "autopilot": EMULATED if build is None else REAL,
        "seed": seed,
        "exit_code": code,
        "outcome": summary.get("outcome", "not ended"),
        "reason": summary.get("reason", "") or error,
        "path_rms_m": summary.get("path_rms_error_m"),
        "path_max_m": summary.get("path_max_error_m"),
        "figures": [line for line in text.splitlines() if not line.startswith(_LEFT_OUT)],
        "sim_time_s": summary.get("sim_time_s"),
        "speedup": summary.get("speedup"),
        "wall_s": round(time.monotonic() - began_s, 1),
    }


def cases(chosen: argparse.Namespace) -> Iterator[tuple[str, str, FirmwareBuild]]:
    """Missions and vehicles with the builds that fly them."""
    builds = [FirmwareBuild.parse(text) for text in chosen.firmware or FIRMWARES]
    for mission, vehicles in MISSIONS.items():
        for vehicle in vehicles:
            if (chosen.mission and mission not in chosen.mission) or chosen.vehicle not in (None, vehicle):
                continue
            for build in builds:
                try:
                    build.located(VEHICLES[vehicle][0])
                except ValueError as error:
                    if chosen.firmware:
                        raise
                    sys.stderr.write(f"left out: {error}\n")
                    continue
                yield mission, vehicle, build


def result(rows: Sequence[Row]) -> str:
    """The results of the flights of one cell, as text."""
    texts = []
    for row in rows:
        if row["outcome"] != "completed":
            texts.append(f"{row['outcome']}: {row['reason']}")
        elif row["path_rms_m"] is not None:
            texts.append(f"{row['path_rms_m']:.2f} / {row['path_max_m']:.2f} m")
        else:
            texts.append("; ".join(row["figures"]) or row["outcome"])
    return " <br> ".join(texts)


def table(rows: Sequence[Row]) -> str:
    """Real and emulated side by side, a line for each mission, vehicle and firmware."""
    lines = ["| mission | vehicle | firmware | real | emulated | real: times real time |", "|---" * 6 + "|"]
    keys = dict.fromkeys((row["mission"], row["vehicle"], row["firmware"]) for row in rows)
    for key in keys:
        own = [row for row in rows if (row["mission"], row["vehicle"], row["firmware"]) == key]
        real = [row for row in own if row["autopilot"] != EMULATED]
        speeds = ", ".join(f"{row['speedup']:.1f}" for row in real if row["speedup"])
        emulated = [row for row in own if row["autopilot"] == EMULATED]
        lines.append(f"| {' | '.join(key)} | {result(real)} | {result(emulated)} | {speeds} |")
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--firmware", action="append", metavar="NAME[=BUILD]", help="repeat; default: both")
    parser.add_argument("--mission", action="append", choices=MISSIONS, help="repeat; default: all")
    parser.add_argument("--vehicle", choices=VEHICLES)
    parser.add_argument("--autopilot", choices=(REAL, EMULATED), help="default: both")
    parser.add_argument("--seed", type=int, default=0, help="of the first flight")
    parser.add_argument("--flights", type=int, default=1, help="of each cell, with the seeds that follow")
    chosen = parser.parse_args(arguments)
    try:
        wanted = list(cases(chosen))
    except ValueError as error:
        parser.error(str(error))
    chosen.out.mkdir(parents=True, exist_ok=True)
    log = chosen.out / "rows.jsonl"
    rows: list[Row] = [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []
    known = {tuple(row[k] for k in ("mission", "vehicle", "firmware", "autopilot", "seed")) for row in rows}
    for mission, vehicle, build in wanted:
        for seed in range(chosen.seed, chosen.seed + chosen.flights):
            for flown in (build, None):
                autopilot = EMULATED if flown is None else REAL
                if (mission, vehicle, build.firmware, autopilot, seed) in known:
                    continue
                if chosen.autopilot not in (None, autopilot):
                    continue
                row = fly(chosen.out, mission, vehicle, build.firmware, flown, seed)
                rows.append(row)
                with log.open("a") as file:
                    file.write(json.dumps(row) + "\n")
                sys.stdout.write(
                    f"{mission} {vehicle} {build.firmware} {autopilot} {seed}: {result([row])}\n"
                )
                sys.stdout.flush()
    (chosen.out / "table.md").write_text(table(rows))
    sys.stdout.write(table(rows))
    same = {
        (row["mission"], row["vehicle"], row["firmware"], row["seed"]): row["outcome"]
        for row in rows
        if row["autopilot"] == EMULATED
    }
    return int(
        any(
            row["outcome"] != same.get(key, "completed")
            for row in rows
            for key in ((row["mission"], row["vehicle"], row["firmware"], row["seed"]),)
            if row["autopilot"] != EMULATED
        )
    )


if __name__ == "__main__":
    sys.exit(main())
