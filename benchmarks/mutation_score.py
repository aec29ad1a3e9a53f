"""Mutation score of the flight code: the share of small, deliberate faults that the tests detect.

    pip install -e '.[test,mutation]'
    python -m benchmarks.mutation_score map --folder mutants
    python -m benchmarks.mutation_score map --folder mutants --plain
    python -m benchmarks.mutation_score run --folder mutants [--sample 500] [--seed 12] [--jobs 1]
    python -m benchmarks.mutation_score show --folder mutants [--equivalent FILE]

`map` runs the unit tests once with coverage and records which test executes which line, and how long each
test takes. `run` draws a random sample of mutants, applies each of them in memory, in a forked process, and
runs the tests that execute the mutated line, those of its package first, until one fails. It writes nothing
into the source tree. The results go to `results.jsonl`, one line for each mutant; an interrupted run
continues where it ended. `show` prints the score of each package, and the change of each survivor.

Modules with kernels are tested as plain Python, without Numba (`--plain`), because most tests finish before
Numba has compiled a mutant. A test of more than 30 s is left out, and the tests of one mutant end after
`--budget-s` of measured test time. Both can only lower the score.
"""

import argparse
import contextlib
import gc
import importlib
import importlib.abc
import importlib.util
import json
import math
import os
import resource
import signal
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from types import CodeType
from typing import Any, Final, NoReturn

import numba
import pytest

import flightsim.foundation.kernels
from benchmarks.mutants import ROOT, Mutant, is_plain, sample
from benchmarks.mutation_map import PLAIN_TESTS, PYTEST_OPTIONS, TESTS, TestMap, record

MUTANT_BUDGET_S: Final = 20.0
TIMEOUT_FACTOR: Final = 10.0
TIMEOUT_FLOOR_S: Final = 30.0
"""A mutant may take so much more processor time than its tests do without the fault. Processor time, since a
busy machine must not kill a mutant."""
WAITING_LIMIT_S: Final = 1800.0
"""By the wall clock: for mutants that wait and do nothing."""
MEMORY_LIMIT_BYTES: Final = 16 << 30


class MutatedModule(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives one module the mutant's text when it is imported."""

    def __init__(self, name: str, path: Path, text: str) -> None:
        self._name = name
        self._path = path
        self._text = text

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> Any:
        if fullname != self._name:
            return None
        return importlib.util.spec_from_file_location(fullname, self._path, loader=self)

    def create_module(self, spec: Any) -> None:
        return None

    def exec_module(self, module: Any) -> None:
        code: CodeType = compile(self._text, str(self._path), "exec", dont_inherit=True)
        exec(code, module.__dict__)


class FirstFailure:
    """Pytest plugin: writes the name of the first test that fails."""

    def __init__(self, file: Path) -> None:
        self._file = file

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self._file.read_text():
            self._file.write_text(report.nodeid)


class Child:
    """The tests of one mutant, in a fork of this process, which has imported everything but the project.

    Args:
        mutant: the fault.
        tests: their names, and the time that each takes without the fault, s.
        folder: for a file with the name of the first test that fails.
    """

    def __init__(self, mutant: Mutant, tests: Mapping[str, float], folder: Path) -> None:
        self.mutant = mutant
        self.tests = len(tests)
        self._start_s = time.monotonic()
        limit_s = TIMEOUT_FLOOR_S + TIMEOUT_FACTOR * sum(tests.values())
        text = mutant.source()
        with tempfile.NamedTemporaryFile(dir=folder, prefix="failure-", delete=False) as file:
            self._failure = Path(file.name)
        self._pid = os.fork()
        if not self._pid:
            _test(mutant, text, list(tests), self._failure, math.ceil(limit_s))

    @property
    def spent_s(self) -> float:
        return time.monotonic() - self._start_s

    def outcome(self) -> str | None:
        """What became of the mutant; None: its tests are still running."""
        ended, status = os.waitpid(self._pid, os.WNOHANG)
        if not ended and self.spent_s < WAITING_LIMIT_S:
            return None
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._pid, signal.SIGKILL)  # and what the tests have started
        if not ended:
            os.waitpid(self._pid, 0)
            return "timeout"
        if os.WIFSIGNALED(status):
            return "timeout" if os.WTERMSIG(status) == signal.SIGXCPU else "killed"
        return "survived" if os.WEXITSTATUS(status) == pytest.ExitCode.OK else "killed"

    def first_failure(self) -> str:
        name = self._failure.read_text()
        self._failure.unlink()
        return name


def _test(mutant: Mutant, text: str, tests: Sequence[str], failure: Path, limit_s: int) -> NoReturn:
    code = 1
    try:
        os.setsid()
        silent = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(silent, stream)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT_BYTES, MEMORY_LIMIT_BYTES))
        resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s + 5))
        numba.config.DISABLE_JIT = is_plain(mutant.path)
        # mutants stay out of the kernels' cache
        setattr(flightsim.foundation.kernels._CacheFile, "save", lambda *_: None)  # noqa: B010
        sys.meta_path.insert(0, MutatedModule(mutant.module, ROOT / mutant.path, text))
        code = int(
            pytest.main([*PYTEST_OPTIONS, "-x", "--timeout=0", *tests], plugins=[FirstFailure(failure)])
        )
    finally:  # a mutant may raise anything at import
        os._exit(code)


def preload() -> None:
    """Import what all tests need and no mutant changes."""
    for name in (
        "hypothesis",
        "jsbsim",
        "matplotlib",
        "numba",
        "pymap3d",
        "pymavlink.dialects.v20.all",
        "pymavlink.dialects.v20.ardupilotmega",
        "pytest_timeout",
        "scipy.linalg",
        "scipy.optimize",
        "scipy.spatial.transform",
        "scipy.stats",
    ):
        importlib.import_module(name)
    gc.collect()
    gc.freeze()


def run(
    folder: Path, results: Path, *, size: int, seed: int, only: str, again: bool, jobs: int, budget_s: float
) -> None:
    """Test the mutants of the sample that have no result yet, or those that survived so far."""
    done = {row["key"] for row in rows_of(results) if not (again and row["outcome"] == "survived")}
    known = {row["key"] for row in rows_of(results)}
    test_map = TestMap(folder)
    waiting = [
        mutant
        for mutant in sample(size, seed)
        if mutant.key not in done and mutant.path.startswith(only) and (mutant.key in known or not again)
    ]
    waiting.reverse()
    preload()
    running: list[Child] = []
    with results.open("a") as out:

        def write(mutant: Mutant, outcome: str, tests: int = 0, spent_s: float = 0.0, by: str = "") -> None:
            row = asdict(mutant) | {"key": mutant.key, "outcome": outcome, "tests": tests}
            row |= {"spent_s": round(spent_s, 2), "by": by, "diff": mutant.diff()}
            out.write(json.dumps(row) + "\n")
            out.flush()

        while waiting or running:
            while waiting and len(running) < jobs:
                mutant = waiting.pop()
                if tests := test_map.tests_of(mutant, budget_s):
                    running.append(Child(mutant, tests, folder))
                else:
                    write(mutant, "survived")
            time.sleep(0.05)
            for child in list(running):
                if (outcome := child.outcome()) is not None:
                    write(child.mutant, outcome, child.tests, child.spent_s, child.first_failure())
                    running.remove(child)


def rows_of(results: Path) -> list[dict[str, Any]]:
    """The results so far, the newest of each mutant."""
    if not results.exists():
        return []
    rows = map(json.loads, results.read_text().splitlines())
    return list({row["key"]: row for row in rows}.values())


def show(results: Path, equivalent: Path | None) -> None:
    """Print the score for each package, and the survivors."""
    reasons = {} if equivalent is None else json.loads(equivalent.read_text())
    totals: dict[str, Counter[str]] = defaultdict(Counter)
    for row in rows_of(results):
        outcome = "killed" if row["outcome"] == "timeout" else row["outcome"]
        if outcome == "survived" and row["key"] in reasons:
            outcome = "equivalent"
        package = "/".join(row["path"].split("/")[:2])
        totals[package][outcome] += 1
        totals["all"][outcome] += 1
        if outcome == "survived":
            sys.stdout.write(f"{row['key']} ({row['tests']} tests)\n")
            sys.stdout.writelines(f"    {line}\n" for line in row["diff"])
    for package, counts in totals.items():
        tested = counts["killed"] + counts["survived"]
        sys.stdout.write(
            f"{package:32} {tested + counts['equivalent']:4} mutants, {counts['equivalent']:3} equivalent, "
            f"{counts['killed']:4} killed of {tested:4}: {100.0 * counts['killed'] / max(tested, 1):5.1f} %\n"
        )


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("action", choices=("map", "run", "show"))
    parser.add_argument("--folder", type=Path, required=True, help="for the map and the results")
    parser.add_argument("--tests", nargs="+", help="folders of tests to map")
    parser.add_argument("--plain", action="store_true", help="map the modules with kernels, not compiled")
    parser.add_argument("--sample", type=int, default=500)
    parser.add_argument("--seed", type=int, default=12)
    parser.add_argument("--only", default="", help="mutants whose path begins so")
    parser.add_argument("--again", action="store_true", help="test those once more that survived so far")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument(
        "--budget-s", type=float, default=MUTANT_BUDGET_S, help="of test time for each mutant"
    )
    parser.add_argument("--results", default="results.jsonl", help="name of the file in the folder")
    parser.add_argument(
        "--equivalent", type=Path, help="JSON: key of a mutant to the reason why it is equivalent"
    )
    chosen = parser.parse_args(arguments)
    chosen.folder.mkdir(parents=True, exist_ok=True)
    results = chosen.folder.resolve() / chosen.results
    if chosen.action == "map":
        tests = chosen.tests or (PLAIN_TESTS if chosen.plain else TESTS)
        for test_folder in tests:
            pid = os.fork()
            if not pid:
                record(test_folder, chosen.folder.resolve(), plain=chosen.plain)
                os._exit(0)
            os.waitpid(pid, 0)
    elif chosen.action == "run":
        run(
            chosen.folder.resolve(),
            results,
            size=chosen.sample,
            seed=chosen.seed,
            only=chosen.only,
            again=chosen.again,
            jobs=chosen.jobs,
            budget_s=chosen.budget_s,
        )
    else:
        show(results, chosen.equivalent)
    return 0


if __name__ == "__main__":
    sys.exit(main())
