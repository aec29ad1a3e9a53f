"""Opens every log in a folder and compares what it holds with what the formats' own readers find.

    python -m benchmarks.foreign_logs FOLDER [--csv TABLE.csv]

For each log: whether it opens (or the words of the refusal), vehicle, firmware and modes, message counts
beside those of pymavlink (`DFReader`, `mavutil`) or pyulog, time in the air, and the attitude filter's roll
and pitch against the autopilot's (RMS, degrees).
"""

import argparse
import contextlib
import csv
import io
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from estimators.attitude.estimator import AttitudeEstimator
from estimators.attitude.parameters import AttitudeParameters
from estimators.comparison import comparisons
from estimators.log_replay import replay
from estimators.logs import Log, LogError, open_log, report_of
from estimators.logs.dataflash_scan import META

_COLUMNS: Final = (
    "log", "format", "opened", "vehicle", "firmware", "modes", "messages", "theirs", "counts", "air_s",
    "air_from", "roll_rms_deg", "pitch_rms_deg", "roll_mean_deg", "pitch_mean_deg", "note",
)  # fmt: skip
_OWN_SUFFIX: Final = ("bin", "ulg")


def main() -> int:
    """Print the table and its sums."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--csv", type=Path)
    given = parser.parse_args()
    rows = []
    for path in sorted(item for item in given.folder.iterdir() if item.is_file()):
        rows.append(_row(path))
        _print(rows[-1])
    opened = [row for row in rows if row["opened"] == "yes"]
    compared = [row for row in opened if row["counts"] != ""]
    errors = [row for row in opened if row["roll_rms_deg"] != ""]
    sys.stdout.write(
        f"\n{len(rows)} logs, {len(opened)} opened, {len(rows) - len(opened)} refused; counts equal in "
        f"{sum(row['counts'] == 'equal' for row in compared)} of {len(compared)}; "
        f"attitude compared in {len(errors)}\n"
    )
    if errors:
        for axis in ("roll", "pitch"):
            values = sorted(float(row[f"{axis}_rms_deg"]) for row in errors)
            sys.stdout.write(
                f"{axis} RMS, deg: median {values[len(values) // 2]:.2f}, "
                f"90 % below {values[int(0.9 * (len(values) - 1))]:.2f}, largest {values[-1]:.2f}\n"
            )
    if given.csv is not None:
        with given.csv.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, _COLUMNS)
            writer.writeheader()
            writer.writerows(rows)
    return 0


def _print(row: Mapping[str, Any]) -> None:
    sys.stdout.write(" | ".join(str(row[name]) for name in _COLUMNS) + "\n")
    sys.stdout.flush()


def _row(path: Path) -> dict[str, Any]:
    row: dict[str, Any] = dict.fromkeys(_COLUMNS, "") | {"log": path.name}
    try:
        log = open_log(path)
    except LogError as error:
        return row | {"opened": "no", "note": str(error).replace(str(path), path.name)}
    row |= {"opened": "yes", "format": log.format, "messages": len(log)}
    vehicles = report_of(log).vehicles
    row["vehicle"] = "+".join(vehicle.type for vehicle in vehicles)
    row["firmware"] = "+".join(vehicle.firmware for vehicle in vehicles)
    modes = dict.fromkeys(span.mode for vehicle in vehicles for span in vehicle.modes)
    row["modes"] = ",".join(list(modes)[:6])
    ours, theirs = _counts(log), _their_counts(log)
    differing = {name for name in ours | theirs if ours[name] != theirs[name]}
    row["messages"], row["theirs"] = sum(ours.values()), sum(theirs.values())
    row["counts"] = "equal"
    if differing:
        row["counts"] = " ".join(f"{name}:{ours[name]}/{theirs[name]}" for name in sorted(differing)[:4])
    return row | _attitude(log)


def _attitude(log: Log) -> dict[str, Any]:
    done = replay(log, lambda: AttitudeEstimator(AttitudeParameters()))
    found: dict[str, Any] = {}
    notes = ["; ".join(texts) for texts in done.lacking.values()]
    for runner in done.fleet.runners.values():
        for compared in comparisons([log], runner, "autopilot"):
            found |= {"air_s": f"{compared.airborne_s:.1f}", "air_from": compared.airborne_from}
            notes.append(compared.not_compared)
            for item in compared.figures.get("autopilot", ()):
                if item.quantity in ("roll", "pitch"):
                    found[f"{item.quantity}_rms_deg"] = f"{item.rms:.2f}"
                    found[f"{item.quantity}_mean_deg"] = f"{item.mean:+.2f}"
        if not runner.tables:
            notes.append("no estimate was made")
    return found | {"note": "; ".join(note for note in notes if note)}


def _counts(log: Log) -> Counter[str]:
    """Messages by name: those of the file, without the MAVLink messages that are made from them."""
    if log.format in _OWN_SUFFIX:
        made = {stream.name for stream in log.source.streams if stream.description.definition.message_id >= 0}
        return Counter({key.name: key.count for key in log.keys if key.name not in made})
    counts: Counter[str] = Counter()
    for key in log.keys:
        counts[key.name] += key.count
    return counts


def _their_counts(log: Log) -> Counter[str]:
    """What the format's own reader finds of the same names."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        if log.format == "ulg":
            return _pyulog(log)
        if log.format == "bin":
            return _dataflash(log)
        return _mavutil(log)


def _pyulog(log: Log) -> Counter[str]:
    from pyulog.core import ULog

    counts: Counter[str] = Counter()
    for data in ULog(str(log.path), disable_str_exceptions=True).data_list:
        name = data.name if not data.multi_id else f"{data.name}_{data.multi_id}"
        counts[name] += len(data.data["timestamp"])
    return counts


def _dataflash(log: Log) -> Counter[str]:
    from pymavlink import DFReader

    made = {stream.name for stream in log.source.streams if stream.description.definition.message_id >= 0}
    text = log.source.remarks.get("form") == "text"
    reader = (DFReader.DFReader_text if text else DFReader.DFReader_binary)(str(log.path))
    counts: Counter[str] = Counter()
    for message in _received(reader):
        counts[message.get_type()] += 1
    return Counter({name: count for name, count in counts.items() if name not in META | made})


def _mavutil(log: Log) -> Counter[str]:
    from pymavlink import mavutil

    mavutil.set_dialect("all")
    reader = mavutil.mavlink_connection(str(log.path), robust_parsing=True, notimestamps=log.format != "tlog")
    counts: Counter[str] = Counter()
    for message in _received(reader):
        name = message.get_type()
        if name != "BAD_DATA" and not name.startswith("UNKNOWN_"):
            counts[name] += 1
    return counts


def _received(reader: Any) -> Iterator[Any]:
    while (message := reader.recv_msg()) is not None:
        yield message


if __name__ == "__main__":
    sys.exit(main())
