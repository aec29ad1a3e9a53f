"""Which tests execute which line, and how long each takes: what a mutant is tested with."""

import json
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numba
import parso
import pytest
from coverage import Coverage

from benchmarks.mutants import ROOT, Mutant, is_plain, modules

TESTS: Final = (
    "tests/commander",
    "tests/control",
    "tests/estimators",
    "tests/flight",
    "tests/flights",
    "tests/navigation",
    "tests/payload",
    "tests/services",
    "tests/storage",
    "tests/telemetry",
)
PLAIN_TESTS: Final = (
    "tests/control",
    "tests/estimators/attitude",
    "tests/estimators/lissajous",
    "tests/estimators/logs",
    "tests/estimators/target_fusion",
    "tests/navigation/test_jacobians.py",
    "tests/navigation/test_mechanisation.py",
    "tests/navigation/test_pitot.py",
)
"""What modules with kernels are tested with, as plain Python: without minutes of flight."""

TEST_LIMIT_S: Final = 30.0
"""A test that takes longer is left out of the map."""


PYTEST_OPTIONS: Final = (
    "-q",
    "-p",
    "no:cacheprovider",
    "-n",
    "0",
    "-o",
    "addopts=--import-mode=importlib --strict-markers -m 'not slow'",
)


class Recorder:
    """Pytest plugin: which test executes which line, and the processor time of each test that passes."""

    def __init__(self, coverage: Any) -> None:
        self._coverage = coverage
        self._failed: set[str] = set()
        self.times_s: dict[str, float] = {}

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        self._coverage.switch_context(item.nodeid)
        start_s = time.process_time()
        yield
        self.times_s[item.nodeid] = time.process_time() - start_s
        self._coverage.switch_context("")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if not report.passed:  # a skipped test checks nothing either
            self._failed.add(report.nodeid)

    def passed_s(self) -> dict[str, float]:
        return {test: spent for test, spent in self.times_s.items() if test not in self._failed}


def record(test_folder: str, folder: Path, *, plain: bool) -> None:
    """Write the map of one folder of tests."""
    numba.config.DISABLE_JIT = plain
    coverage = Coverage(
        data_file=None,
        include=[str(ROOT / path) for path in modules() if is_plain(path) is plain],
        config_file=False,
    )
    recorder = Recorder(coverage)
    coverage.start()
    code = pytest.main(
        [*PYTEST_OPTIONS, f"--timeout={TEST_LIMIT_S}", str(ROOT / test_folder)], plugins=[recorder]
    )
    coverage.stop()
    if code not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
        raise SystemExit(f"{test_folder}: pytest ended with {code!r}, no map was made")
    data = coverage.get_data()
    passed_s = recorder.passed_s()
    lines = {
        path: {
            line: sorted(set(contexts) & passed_s.keys())
            for line, contexts in data.contexts_by_lineno(str(ROOT / path)).items()
        }
        for path in modules()
        if is_plain(path) is plain
    }
    name = ("plain-" if plain else "compiled-") + test_folder.replace("/", "-")
    (folder / f"map-{name}.json").write_text(json.dumps({"times_s": passed_s, "lines": lines}))


class TestMap:
    """Which tests a mutant has to pass."""

    def __init__(self, folder: Path) -> None:
        self._times_s: dict[bool, dict[str, float]] = {True: {}, False: {}}
        self._lines: dict[str, dict[int, set[str]]] = defaultdict(lambda: defaultdict(set))
        files = sorted(folder.glob("map-*.json"))
        if not files:
            raise SystemExit(
                f"{folder}: holds no map of tests; run first: mutation_score map --folder {folder}"
            )
        for file in files:
            data = json.loads(file.read_text())
            self._times_s["-plain-" in file.name].update(data["times_s"])
            for path, lines in data["lines"].items():
                for line, tests in lines.items():
                    self._lines[path][int(line)].update(tests)

    def tests_of(self, mutant: Mutant, budget_s: float) -> dict[str, float]:
        """Those that execute the line: first those of the module's package, then the others, the quickest
        first in both. For what is executed at import, and in the middle of long statements, those that
        execute anything of the statement, the function or the module; where a module executes nothing but
        definitions, those of the package."""
        lines = self._lines[mutant.path]
        for first, last in self._places(mutant):
            found = set().union(*(lines[line] for line in range(first, last + 1) if line in lines))
            if found:
                break
        else:
            found = set() if mutant.in_function() else self._tests_of_package(mutant)
        times_s = self._times_s[is_plain(mutant.path)]
        chosen: dict[str, float] = {}
        own_folder = self._folder_of_package(mutant)
        for test in sorted(found, key=lambda test: (not test.startswith(own_folder), times_s[test], test)):
            if chosen and sum(chosen.values()) + times_s[test] > budget_s:
                break
            chosen[test] = times_s[test]
        return chosen

    def _tests_of_package(self, mutant: Mutant) -> set[str]:
        """For modules that execute nothing but definitions."""
        folder = self._folder_of_package(mutant)
        return {test for test in self._times_s[is_plain(mutant.path)] if test.startswith(folder)}

    @staticmethod
    def _folder_of_package(mutant: Mutant) -> str:
        package, part = mutant.path.split("/")[:2]
        return "tests/estimators/" if package == "estimators" else f"tests/{part}/"

    @staticmethod
    def _places(mutant: Mutant) -> Iterator[tuple[int, int]]:
        yield mutant.line, mutant.line
        tree = parso.parse((ROOT / mutant.path).read_text(encoding="utf-8"))
        node = tree.get_leaf_for_position((mutant.line, mutant.column))
        while node.parent is not None:
            if node.type in ("simple_stmt", "expr_stmt", "return_stmt"):
                yield node.start_pos[0], node.end_pos[0]
            if node.type == "funcdef":
                yield node.start_pos[0] + 1, node.end_pos[0]
                return  # in a function that no test calls
            node = node.parent
        yield 1, node.end_pos[0]
