"""Studies: trials per second in this process, in two processes and on a Ray cluster of two nodes.

    python -m benchmarks.study_scaling                  # flights and computed trials, without Ray
    python -m benchmarks.study_scaling --ray            # and on Ray: a head and a worker node on loopback
    python -m benchmarks.study_scaling --ray --flights 0

Engines take turns, so that a change of the machine's speed meets all. A rate is that between the first and
the last result; starting the workers is given by itself. `gain` is the rate by that of this process. `load`
is the processor time of the parent process for each trial, the part of a study that is done one trial after
the other: the model of docs/studies.md predicts larger clusters from it.
"""

import argparse
import io
import pickle
import resource
import statistics
import sys
import tempfile
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from autopilot_bridge.clock.pacing import wall_time_s
from missions.cli.bodies.sweep import sweep_study
from missions.studies import Inline, Pool, RayCluster, Study, grid, run_study
from missions.studies.engine import Engine, Progress
from missions.studies.rows import TrialOutcome, TrialResult
from tests.missions.studies.ray_nodes import two_nodes

WORKERS = 2
AHEAD = (100, 1000)


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A row of some numbers, as a flight has."""

    total: int
    error_m: float
    figures: Mapping[str, float]


def compute(parameters: Mapping[str, Any], seed: int) -> Row:
    """A fixed amount of work."""
    total = seed
    for k in range(int(parameters["steps"])):
        total = (total * 1103515245 + 12345 + k) & 0x7FFFFFFF
    return Row(total=total, error_m=total / 3.0, figures={"a": 1.0, "b": 2.0, "c": 3.0})


def computed(steps: int) -> Study[Any, Row]:
    """A study of trials of that many steps."""
    return Study(name="computed", trial=compute, row=Row, design=grid(steps=(steps,)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """One run of a study.

    Attributes:
        rate_hz: trials per second between the first and the last result.
        start_s: from the start to the first result, without the time of one trial.
        load_s: processor time of this process for each trial.
        trial_s: median time of a trial in its worker.
        row_bytes: bytes of the table for each row.
    """

    rate_hz: float
    start_s: float
    load_s: float
    trial_s: float
    row_bytes: float


def measured(study: Study[Any, Any], engine: Engine, runs: int) -> Measured:
    """Run a study once."""
    seen: list[tuple[float, int, float]] = []

    def note(progress: Progress) -> None:
        seen.append((wall_time_s(), progress.done, _processor_s()))

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "study"
        started_s = wall_time_s()
        result = run_study(study, runs=runs, engine=engine, out=out, picture=False, on_progress=note)
        if result.results.without_row():
            raise SystemExit(f"a trial failed: {result.results.without_row()[0]}")
        row_bytes = (out / "rows.parquet").stat().st_size / result.results.table.num_rows
    first = next(entry for entry in seen if entry[1])
    last = next(entry for entry in seen if entry[1] == seen[-1][1])
    trial_s = statistics.median(result.results.timing["wall_time_s"].to_pylist())
    count = last[1] - first[1]
    return Measured(
        rate_hz=count / (last[0] - first[0]),
        start_s=first[0] - started_s - trial_s,
        load_s=(last[2] - first[2]) / count,
        trial_s=trial_s,
        row_bytes=row_bytes,
    )


def _processor_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def message_bytes(study: Study[Any, Any]) -> int:
    """Bytes of a result on its way to the parent."""
    row = study.schema.values(compute({"steps": 1}, 0))
    result = TrialResult(
        index=0, outcome=TrialOutcome.DONE, values=row, versions="x" * 170, worker="host:12345"
    )
    sink = io.BytesIO()
    pickle.dump(result, sink)
    return len(sink.getvalue())


def show(name: str, found: Mapping[str, list[Measured]]) -> dict[str, Measured]:
    """Print the medians of some runs, and return them."""
    say(name)
    heads = (("trials/s", 11), ("gain", 8), ("start s", 9), ("load ms", 9), ("trial ms", 10), ("B/row", 8))
    say(f"{'engine':>8}" + "".join(f"{head:>{width}}" for head, width in heads))
    medians = {
        engine: Measured(
            **{f: statistics.median(getattr(m, f) for m in runs) for f in Measured.__dataclass_fields__}
        )
        for engine, runs in found.items()
    }
    for engine, m in medians.items():
        gain = m.rate_hz / medians["inline"].rate_hz
        say(
            f"{engine:>8}{m.rate_hz:11.3f}{gain:8.2f}{m.start_s:9.2f}{1e3 * m.load_s:9.3f}"
            f"{1e3 * m.trial_s:10.2f}{m.row_bytes:8.0f}"
        )
    return medians


def predicted(medians: Mapping[str, Measured], engine: str, trials: int) -> None:
    """Print what the model of docs/studies.md says of many workers: the parent's load for each trial is
    serial, and the workers start once.
    """
    m, alone = medians[engine], medians["inline"]
    serial = m.load_s / alone.trial_s
    say(f"{engine}: serial part {serial:.2e} of a trial; {1.0 / serial:.0f} workers keep the parent busy")
    for workers in AHEAD:
        rate = min(workers / alone.trial_s, 1.0 / m.load_s)
        time_s = m.start_s + trials / rate
        efficiency = trials * alone.trial_s / (workers * time_s)
        say(f"  {workers} workers, {trials} trials: {time_s:.0f} s, efficiency {efficiency:.2f}")


def main() -> int:
    """Measure, and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--ray", action="store_true", help="also on a Ray cluster of two nodes")
    parser.add_argument(
        "--flights", type=int, default=20, help="runs of each of the two cells of the flights; 0: none"
    )
    parser.add_argument("--turns", type=int, default=3, help="how often each engine takes its turn")
    arguments = parser.parse_args()
    studies: list[tuple[str, Study[Any, Any], int]] = [
        ("computed trials of about 50 ms", computed(500_000), 80),
        ("empty trials", computed(1), 2000),
    ]
    if arguments.flights:
        flights = sweep_study("lissajous", ["wind-speed=0,8"], [], sampling="random")
        studies.insert(0, ("flights: lissajous over two winds", flights, arguments.flights))
    with two_nodes() if arguments.ray else nullcontext() as cluster:
        engines: dict[str, Engine] = {"inline": Inline(), "pool": Pool(WORKERS)}
        if cluster is not None:
            engines["ray"] = RayCluster(cluster.address)
        for name, study, runs in studies:
            found: dict[str, list[Measured]] = {engine: [] for engine in engines}
            for _ in range(arguments.turns):
                for engine, where in engines.items():
                    found[engine].append(measured(replace(study, metrics=()), where, runs))
            medians = show(name, found)
            if not name.startswith("empty"):
                for engine in [e for e in engines if e != "inline"]:
                    predicted(medians, engine, 100_000)
    say(f"a result on its way to the parent: {message_bytes(studies[-1][1])} bytes")
    return 0


def say(line: str) -> None:
    """A line on the standard output, at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
