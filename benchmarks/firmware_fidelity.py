"""Every difference between a real firmware and its emulation, in one session in one world.

    python -m benchmarks.firmware_fidelity --out FOLDER [--firmware px4=BUILD] [--firmware ardupilot=FILE]

Both fly `benchmarks/fidelity_session.py` by `flightstack fly` with the same world, seed and vehicle, and
their logs are compared: answers to commands, texts, modes, messages with their rates and fields, times and
steps. Each difference is printed. Those in `benchmarks/accepted_differences.toml` have a reason; exit code 1:
there are others. Without `--firmware` the builds of FLIGHTSTACK_PX4 and FLIGHTSTACK_ARDUCOPTER are flown, and
what is missing is left out. What FOLDER has is not flown again.
"""

import argparse
import re
import subprocess
import sys
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.firmware_process.build import FIRMWARES, FirmwareBuild
from autopilot_bridge.mavlink import command_name, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from benchmarks.fidelity_session import HEIGHT_M, STEP_M
from estimators.logs import Log, Table, open_log
from flightsim.airframe import AirframeKind

ACCEPTED: Final = Path(__file__).with_name("accepted_differences.toml")
SESSION: Final = Path(__file__).with_name("fidelity_session.py")
_VEHICLE: Final = 1
_RATE_SHARE: Final = 0.2
_TIME_SHARE: Final = 0.15
_TIME_S: Final = 0.5
_STEP_M: Final = 0.3
_LEAST_SENT: Final = 3  # fewer messages have no rate, and say little about a field
_UP_M: Final = 0.3
_ANSWERS: Final = frozenset({"COMMAND_ACK", "COMMAND_LONG", "EVENT", "PARAM_VALUE", "STATUSTEXT"})
"""Messages that are no streams."""
_LIMIT_S: Final = 1800.0

Fact = str | float
Facts = dict[str, Fact]
Array = NDArray[np.float64]


def facts_of(log: Log) -> Facts:
    """What a log of the session shows, by name."""
    tables = {
        key.name: log.table(key.name, system_id=_VEHICLE, component_id=AUTOPILOT_COMPONENT)
        for key in log.keys
        if (key.system_id, key.component_id) == (_VEHICLE, AUTOPILOT_COMPONENT)
    }
    armed_us, disarmed_us = _armed(tables["HEARTBEAT"])
    return {
        **_answers(log, tables, armed_us),
        **_texts(tables),
        "modes": " ".join(_changes(tables["HEARTBEAT"]["custom_mode"].tolist())),
        **_rates(tables, armed_us, disarmed_us),
        **_fields(tables),
        **_flight(tables["LOCAL_POSITION_NED"], armed_us, disarmed_us),
    }


def _armed(heartbeats: Table) -> tuple[int, int]:
    """Times of the first and the last heartbeat of an armed vehicle."""
    times = heartbeats.time_us[heartbeats["base_mode"] & dialect.MAV_MODE_FLAG_SAFETY_ARMED > 0]
    return int(times[0]), int(times[-1])


def _changes(values: Iterable[int]) -> Iterator[str]:
    before = None
    for value in values:
        if value != before:
            yield str(value)
        before = value


def _answers(log: Log, tables: Mapping[str, Table], armed_us: int) -> Facts:
    """The last answer to each command; "none" where there was none."""
    sent = [
        (int(order), int(command), float(first))
        for name in ("COMMAND_LONG", "COMMAND_INT")
        for key in log.keys
        if key.name == name and key.system_id != _VEHICLE
        for table in (log.table(name, system_id=key.system_id, component_id=key.component_id),)
        for order, command, first in zip(table.order, table["command"], table["param1"], strict=True)
    ]
    acks = tables["COMMAND_ACK"]
    answers = list(zip(acks.order.tolist(), acks["command"].tolist(), acks["result"].tolist(), strict=True))
    heartbeats = tables["HEARTBEAT"]
    armed_from = int(heartbeats.order[heartbeats.time_us >= armed_us][0])
    found: Facts = {}
    for order, command, first in sorted(sent):
        until = min((o for o, c, _ in sent if c == command and o > order), default=sys.maxsize)
        results = [str(r) for o, c, r in answers if c == command and order < o < until]
        phase = "in the air" if order > armed_from else "on the ground"
        name = command_name(command)
        if command == dialect.MAV_CMD_REQUEST_MESSAGE:
            name += f" {first:g}"
        found[f"answer {phase}: {name}"] = " ".join(results) or "none"
    return found


def _texts(tables: Mapping[str, Table]) -> Facts:
    """Texts without their numbers, and how often each was sent. Parts of a long one are put together."""
    if "STATUSTEXT" not in tables:
        return {}
    whole: list[str] = []
    table = tables["STATUSTEXT"]
    for text, part in zip(table["text"].tolist(), table["chunk_seq"].tolist(), strict=True):
        if part and whole:
            whole[-1] += text.decode(errors="replace")
        else:
            whole.append(text.decode(errors="replace"))
    counted = Counter(re.sub(r"-?\d+(\.\d+)?", "#", text.strip()) for text in whole)
    return {f"text: {text}": float(count) for text, count in counted.items()}


def _rates(tables: Mapping[str, Table], armed_us: int, disarmed_us: int) -> Facts:
    """Messages a second; messages that were sent once or twice are not streams."""
    found: Facts = {}
    for name in sorted(tables.keys() - _ANSWERS):
        times = tables[name].time_us
        for phase, inside in (
            ("on the ground", times < armed_us),
            ("in the air", (times >= armed_us) & (times <= disarmed_us)),
        ):
            if inside.sum() >= _LEAST_SENT:
                span_s = 1e-6 * float(np.ptp(times[inside]))
                found[f"rate {phase}: {name}"] = (inside.sum() - 1) / span_s if span_s > 0.0 else 0.0
    return found


def _fields(tables: Mapping[str, Table]) -> Facts:
    """What each field of a message has: NaN, 0, always the same number, or numbers."""
    return {
        f"field: {name}.{field}": _content(table[field])
        for name, table in tables.items()
        if len(table) >= _LEAST_SENT and name not in _ANSWERS
        for field in table.fields
        if field in table and table[field].dtype.kind in "iuf"
    }


def _content(values: NDArray[np.generic]) -> str:
    numbers = np.asarray(values, dtype=np.float64)
    if np.isnan(numbers).all():
        return "NaN"
    if not numbers.any():
        return "0"
    if values.dtype.kind in "iu" and values.ndim == 1 and (values == values[0]).all():
        return str(values[0])
    return "numbers"


def _flight(positions: Table, armed_us: int, disarmed_us: int) -> Facts:
    """Times of the take-off, the step and the way home, and by how much they overshoot."""
    inside = positions.time_us >= armed_us
    time_s: Array = 1e-6 * (positions.time_us[inside] - armed_us).astype(np.float64)
    up = -positions.si("z")[inside]
    up -= up[0]
    step_m = positions.si("x")[inside]
    step_m -= step_m[0]
    end_s = 1e-6 * (disarmed_us - armed_us)
    off_s = _first(time_s, up > _UP_M)
    at_height_s = _first(time_s, up > 0.95 * HEIGHT_M)
    begin_s, most_s = _first(time_s, step_m > 0.1 * STEP_M), _first(time_s, step_m > 0.9 * STEP_M)
    back = (time_s > most_s) & (step_m < 0.9 * STEP_M)
    home_s = _first(time_s, back) if back.any() else end_s
    return {
        "time: from arming to lift-off": off_s,
        "time: from lift-off to 95 % of the height": at_height_s - off_s,
        "time: 10 % to 90 % of the step": most_s - begin_s,
        "time: from 90 % of the way home to disarming": end_s - home_s,
        "path: overshoot of the take-off": float(up[time_s < begin_s].max() - HEIGHT_M),
        "path: overshoot of the step": float(step_m.max() - STEP_M),
        "path: greatest height": float(up.max()),
    }


def _first(time_s: Array, holds: NDArray[np.bool_]) -> float:
    """Time at which something first holds; infinite: never."""
    return float(time_s[np.argmax(holds)]) if holds.any() else float("inf")


def differences(real: Facts, emulated: Facts) -> dict[str, tuple[Fact | None, Fact | None]]:
    """Facts that differ by more than their tolerance: real and emulated; None: there is none."""
    messages = [
        {name.rpartition(": ")[2] for name in facts if name.startswith("rate")} for facts in (real, emulated)
    ]
    both = messages[0] & messages[1]
    return {
        name: (real.get(name), emulated.get(name))
        for name in sorted(real | emulated)
        if not (name.startswith("field") and name.removeprefix("field: ").partition(".")[0] not in both)
        and not _alike(name, real.get(name), emulated.get(name))
    }


def _alike(name: str, a: Fact | None, b: Fact | None) -> bool:
    if not (isinstance(a, float) and isinstance(b, float)):
        return a == b
    if name.startswith("rate"):
        return abs(a - b) <= _RATE_SHARE * max(a, b)
    if name.startswith("time"):
        return abs(a - b) <= _TIME_S + _TIME_SHARE * max(a, b)
    return abs(a - b) <= _STEP_M if name.startswith("path") else a == b


def accepted(firmware: str, file: Path = ACCEPTED) -> dict[str, str]:
    """Patterns of accepted differences of a firmware, with their reasons.

    Raises:
        ValueError: an entry has no reason.
    """
    found: dict[str, str] = defaultdict(str)
    for entry in tomllib.loads(file.read_text(encoding="utf-8")).get(firmware, ()):
        if not entry.get("reason"):
            raise ValueError(f"{file.name}: {entry} has no reason")
        for pattern in entry["differences"]:
            found[pattern] = entry["reason"]
    return found


def fly(folder: Path, arguments: Sequence[str]) -> Log:
    """The log of a session, which is flown when it is not there.

    Raises:
        RuntimeError: the session was not completed.
    """
    if not (folder / "summary.json").exists():
        command = [
            sys.executable,
            "-m",
            "missions",
            "fly",
            str(SESSION),
            "--model",
            "iris",
            "--out",
            str(folder),
        ]
        done = subprocess.run(
            [*command, *arguments], capture_output=True, text=True, timeout=_LIMIT_S, check=False
        )
        if done.returncode:
            raise RuntimeError(f"{' '.join(arguments)}: {done.stderr.strip()}")
    return open_log(folder / "flight.tlog")


def compare(firmware: FirmwareBuild, out: Path) -> bool:
    """Fly and compare both; whether every difference is accepted."""
    real = facts_of(fly(out / f"{firmware.firmware}-real", ["--firmware", str(firmware)]))
    emulated = facts_of(fly(out / f"{firmware.firmware}-emulated", ["--autopilot", firmware.firmware]))
    reasons = accepted(firmware.firmware)
    used: set[str] = set()
    new = 0
    for name, (theirs, ours) in differences(real, emulated).items():
        pattern = next((pattern for pattern in reasons if fnmatchcase(name, pattern)), None)
        new += pattern is None
        used |= {pattern} if pattern else set()
        mark = f"accepted: {reasons[pattern]}" if pattern else "NEW"
        sys.stdout.write(
            f"{firmware.firmware} {name}: real {_text(theirs)}, emulated {_text(ours)} ({mark})\n"
        )
    for pattern in sorted(set(reasons) - used):
        sys.stdout.write(f"{firmware.firmware} {pattern}: accepted, and no longer different\n")
    sys.stdout.write(f"{firmware.firmware}: {len(real)} facts, {new} new differences\n")
    return not new


def _text(value: Fact | None) -> str:
    return "none" if value is None else f"{value:.2f}" if isinstance(value, float) else value


def main(arguments: Sequence[str] | None = None) -> int:
    """Compare what was chosen; returns the exit code."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--firmware", action="append", metavar="NAME[=BUILD]", help="repeat; default: both")
    chosen = parser.parse_args(arguments)
    chosen.out.mkdir(parents=True, exist_ok=True)
    well = True
    for text in chosen.firmware or FIRMWARES:
        build = FirmwareBuild.parse(text)
        try:
            build.located(AirframeKind.MULTICOPTER)
        except ValueError as error:
            if chosen.firmware:
                parser.error(str(error))
            sys.stderr.write(f"left out: {error}\n")
            continue
        well = compare(build, chosen.out) and well
    return int(not well)


if __name__ == "__main__":
    sys.exit(main())
