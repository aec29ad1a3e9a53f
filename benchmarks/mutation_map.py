"""Which tests execute which line, and how long each takes: what a mutant is tested with."""

import json
import time
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
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
    "tests/estimators/test_vehicle_time.py",
    "tests/estimators/tracking",
    "tests/navigation/test_jacobians.py",
    "tests/navigation/test_mechanisation.py",
    "tests/navigation/test_pitot.py",
    "tests/navigation/test_updates.py",
)
"""What modules with kernels are tested with, as plain Python: without minutes of flight."""

TEST_LIMIT_S: Final = 30.0
"""A test that takes more processor time is left out of the map."""
WAITING_LIMIT_S: Final = 600.0
"""By the wall clock, of which a busy machine takes much more."""


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
        return {
            test: spent
            for test, spent in self.times_s.items()
            if test not in self._failed and spent <= TEST_LIMIT_S
        }


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
        [*PYTEST_OPTIONS, f"--timeout={WAITING_LIMIT_S}", str(ROOT / test_folder)], plugins=[recorder]
    )
    coverage.stop()
    if code not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
        raise SystemExit(f"{test_folder}: pytest ended with {code!r}, no map was made")
    data = coverage.get_data()
    passed_s = recorder.passed_s()
    executed = {
        path: data.contexts_by_lineno(str(ROOT / path)) for path in modules() if is_plain(path) is plain
    }
    lines = {
        path: {line: sorted(set(contexts) & passed_s.keys()) for line, contexts in found.items()}
        for path, found in executed.items()
    }
    imported = {
        path: sorted(line for line, contexts in found.items() if "" in contexts)
        for path, found in executed.items()
    }
    name = ("plain-" if plain else "compiled-") + test_folder.replace("/", "-")
    (folder / f"map-{name}.json").write_text(
        json.dumps({"times_s": passed_s, "lines": lines, "imported": imported})
    )


class TestMap:
    """Which tests a mutant has to pass."""

    def __init__(self, folder: Path) -> None:
        self._times_s: dict[bool, dict[str, float]] = {True: {}, False: {}}
        self._lines: dict[str, dict[int, set[str]]] = defaultdict(lambda: defaultdict(set))
        self._imported: dict[str, set[int]] = defaultdict(set)
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
            for path, imported in data.get("imported", {}).items():
                self._imported[path].update(imported)

    def tests_of(self, mutant: Mutant, budget_s: float) -> dict[str, float]:
        """The tests of a mutant and how long each takes: first those of the module's package, then the
        others, the quickest first in both, as long as their times fit into the budget.

        Inside a function these are the tests that execute the line; in the middle of a long statement, those
        that execute anything of the statement or of the function. A constant, a field and its default, and a
        function that only makes a constant, are executed at import, by every test: half of the budget is for
        the tests that execute a line that names it (where there is none: a function of the module), the rest
        for the quickest of the package."""
        if mutant.in_function():
            found = next(filter(None, self._in_function(mutant)), set())
            if found or mutant.line not in self._imported[mutant.path]:
                return self._quickest(found, mutant, budget_s)
        chosen = self._quickest(next(filter(None, self._at_import(mutant)), set()), mutant, 0.5 * budget_s)
        folder, times_s = self._folder_of_package(mutant), self._times_s[is_plain(mutant.path)]
        package = {test for test in times_s if test.startswith(folder)} - chosen.keys()
        return chosen | self._quickest(package, mutant, budget_s - sum(chosen.values()))

    def _quickest(self, tests: set[str], mutant: Mutant, budget_s: float) -> dict[str, float]:
        times_s = self._times_s[is_plain(mutant.path)]
        folder = self._folder_of_package(mutant)
        chosen: dict[str, float] = {}
        left_s = budget_s
        for test in sorted(tests & times_s.keys(), key=lambda t: (not t.startswith(folder), times_s[t], t)):
            left_s -= times_s[test]
            if chosen and left_s < 0.0:
                break
            chosen[test] = times_s[test]
        return chosen

    def _in_function(self, mutant: Mutant) -> Iterator[set[str]]:
        yield self._that_execute(mutant.path, mutant.line, mutant.line)
        node = _leaf(mutant)
        while node.parent is not None:
            if node.type in ("simple_stmt", "expr_stmt", "return_stmt"):
                yield self._that_execute(mutant.path, node.start_pos[0], node.end_pos[0])
            if node.type == "funcdef":
                yield self._that_execute(mutant.path, node.start_pos[0] + 1, node.end_pos[0])
                return  # in a function that no test calls
            node = node.parent

    def _at_import(self, mutant: Mutant) -> Iterator[set[str]]:
        if names := _defined_names(mutant):
            yield self._that_name(names, mutant)
        yield set().union(
            *(self._that_execute(mutant.path, first, last) for first, last in _functions(mutant.path))
        )

    def _that_name(self, names: set[str], mutant: Mutant) -> set[str]:
        """Tests that execute, in a function of any module, a line that names one of these."""
        found: set[str] = set()
        plain, private = is_plain(mutant.path), all(name.startswith("_") for name in names)
        for path, lines in self._lines.items():
            if is_plain(path) is not plain or (private and path != mutant.path):
                continue
            named = _lines_that_name(path, names)
            if path == mutant.path:
                named.discard(mutant.line)
            for first, last in _functions(path):
                found.update(*(lines[line] for line in named if first <= line <= last and line in lines))
        return found

    def _that_execute(self, path: str, first: int, last: int) -> set[str]:
        lines = self._lines[path]
        return set().union(*(lines[line] for line in range(first, last + 1) if line in lines))

    @staticmethod
    def _folder_of_package(mutant: Mutant) -> str:
        package, part = mutant.path.split("/")[:2]
        return "tests/estimators/" if package == "estimators" else f"tests/{part}/"


@cache
def _tree(path: str) -> Any:
    return parso.parse((ROOT / path).read_text(encoding="utf-8"))


def _leaf(mutant: Mutant) -> Any:
    return _tree(mutant.path).get_leaf_for_position((mutant.line, mutant.column))


@cache
def _functions(path: str) -> tuple[tuple[int, int], ...]:
    """First and last line of the body of each function of a module."""

    def walk(node: Any) -> Iterator[tuple[int, int]]:
        if node.type in ("funcdef", "lambdef"):
            yield node.children[-1].start_pos[0], node.end_pos[0]
            return
        for child in getattr(node, "children", ()):
            yield from walk(child)

    return tuple(walk(_tree(path)))


def _defined_names(mutant: Mutant) -> set[str]:
    """What the statement around the mutant assigns: a constant, a class attribute, a field."""
    node = _leaf(mutant)
    while node.parent is not None and node.type != "expr_stmt":
        node = node.parent
    return {name.value for name in node.get_defined_names()} if node.type == "expr_stmt" else set()


def _lines_that_name(path: str, names: set[str]) -> set[int]:
    return {line for name in names for line in _words(path).get(name, ())}


@cache
def _words(path: str) -> dict[str, set[int]]:
    """The lines on which each name of a module is."""
    found: dict[str, set[int]] = defaultdict(set)
    leaf = _tree(path).get_first_leaf()
    while leaf is not None:
        if leaf.type == "name":
            found[leaf.value].add(leaf.start_pos[0])
        leaf = leaf.get_next_leaf()
    return found
