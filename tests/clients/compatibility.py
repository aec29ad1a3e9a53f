"""The page docs/compatibility.md, made from the outcomes of the tests with real clients.

A test says what it is about by `@pytest.mark.compatibility(client=..., feature=...)` and on which vehicle by
its parameter `vehicle` (or another one: `parameter=`; or the marker's `vehicle=`; `plane=True`: aircraft).
What the firmware does not offer is a test, too: it passes when the client gets a refusal, and gives the
reason by `not_offered(request, "...")`.

`python -m pytest tests/clients -m '' --write-compatibility` writes the page; it refuses when a test of the
page was not run. Every other run compares what it has with the page, and fails when they differ.
"""

import contextlib
from collections import defaultdict
from collections.abc import Iterable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final, NamedTuple

import pytest

PAGE: Final = Path(__file__).parents[2] / "docs" / "compatibility.md"
VEHICLES: Final = ("px4", "px4-plane", "ardupilot", "ardupilot-plane")
_TITLES: Final = ("PX4 copter", "PX4 plane", "ArduCopter", "ArduPlane")
_CELL: Final = "compatibility"
_NOTE: Final = "compatibility note"
_PASS: Final = "pass"
_HEAD: Final = """# Compatibility

What other people's clients do with the emulated vehicles, headless, as the tests in `tests/clients` saw it;
`python -m pytest tests/clients -m '' --write-compatibility` writes this page.

"pass": the client's own calls did what its documentation says, seen on the client's side. Other words: what
the firmware does not offer or the client can't do, and the test saw that the client gets a refusal. An empty
cell: not tried there; aircraft fly what MAVSDK's action, offboard and mission plugins have for them in one
flight, and carry the camera.

DroneKit 2.9.2 does not import on Python 3.10 and later (it takes `MutableMapping` from `collections`).
"""
_CLIENTS: Final = ("MAVSDK", "MAVProxy", "pymavlink")


class Cell(NamedTuple):
    """One cell of the page."""

    client: str
    feature: str
    vehicle: str


def not_offered(request: pytest.FixtureRequest, reason: str) -> None:
    """The test passes because the client got the firmware's refusal; `reason` goes onto the page."""
    request.node.user_properties.append((_NOTE, reason))


def rendered(cells: Mapping[Cell, str]) -> str:
    """The page."""
    rows: dict[tuple[str, str], dict[str, str]] = defaultdict(dict)
    for cell, words in cells.items():
        rows[cell.client, cell.feature][cell.vehicle] = words
    lines = [
        _HEAD,
        f"Seen with {', '.join(_versions())}.\n",
        f"| client | feature | {' | '.join(_TITLES)} |",
        "|---" * (2 + len(_TITLES)) + "|",
    ]
    for client, feature in sorted(rows):
        words = (rows[client, feature].get(vehicle, "") for vehicle in VEHICLES)
        lines.append(f"| {client} | {feature} | {' | '.join(words)} |")
    return "\n".join(lines) + "\n"


def _versions() -> list[str]:
    """The installed clients."""
    found = []
    for name in _CLIENTS:
        with contextlib.suppress(PackageNotFoundError):
            found.append(f"{name} {version(name)}")
    return found


def parsed(text: str) -> dict[Cell, str]:
    """The cells of a page."""
    cells: dict[Cell, str] = {}
    for line in text.splitlines():
        columns = [column.strip() for column in line.strip("|").split("|")]
        if not line.startswith("| ") or len(columns) != 2 + len(VEHICLES) or columns[0] == "client":
            continue
        for vehicle, words in zip(VEHICLES, columns[2:], strict=True):
            if words:
                cells[Cell(columns[0], columns[1], vehicle)] = words
    return cells


def merged(outcomes: Iterable[tuple[Cell, str]]) -> dict[Cell, str]:
    """One word for each cell of the outcomes of its tests: "pass" when all passed, else what else."""
    found: dict[Cell, set[str]] = defaultdict(set)
    for cell, words in outcomes:
        found[cell].add(words)
    return {
        cell: _PASS if words == {_PASS} else "; ".join(sorted(words - {_PASS}))
        for cell, words in found.items()
    }


def cell_of(item: pytest.Item) -> Cell | None:
    """The cell that a test fills; None: none."""
    marker = item.get_closest_marker("compatibility")
    if marker is None:
        return None
    given: dict[str, Any] = dict(marker.kwargs)
    callspec = getattr(item, "callspec", None)
    parameters = {} if callspec is None else callspec.params
    vehicle = given.get("vehicle") or parameters[given.get("parameter", "vehicle")]
    if given.get("plane"):
        vehicle = f"{vehicle}-plane"
    client = given.get("client") or parameters["client"]
    if vehicle not in VEHICLES:
        raise pytest.UsageError(f"{item.nodeid}: vehicle {vehicle!r} is none of {', '.join(VEHICLES)}")
    return Cell(client, given["feature"], vehicle)


class CompatibilityPlugin:
    """Collects outcomes; under pytest-xdist they come to the controller with the reports."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._outcomes: list[tuple[Cell, str]] = []
        self._failed: set[Cell] = set()
        self.complaint: str | None = None

    @property
    def _on_worker(self) -> bool:
        return hasattr(self._config, "workerinput")

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        for item in items:
            cell = cell_of(item)
            if cell is not None:
                item.user_properties.append((_CELL, list(cell)))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        properties = dict(report.user_properties)
        if self._on_worker or _CELL not in properties:
            return
        cell = Cell(*properties[_CELL])
        if report.failed:
            self._failed.add(cell)
        elif report.when == "call" and report.passed:
            self._outcomes.append((cell, properties.get(_NOTE, _PASS)))

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if self._on_worker:
            return
        cells = {cell: words for cell, words in merged(self._outcomes).items() if cell not in self._failed}
        known = parsed(PAGE.read_text(encoding="utf-8")) if PAGE.exists() else {}
        if self._config.getoption("--write-compatibility"):
            missing = sorted(set(known) - set(cells))
            if missing:
                self.complaint = f"not written, these did not run or failed: {_listed(missing)}"
            else:
                PAGE.write_text(rendered(cells), encoding="utf-8")
        else:
            other = sorted(cell for cell in cells if cell in known and not _agree(cells[cell], known[cell]))
            if other:
                self.complaint = f"is out of date for: {_listed(other)}; write it with --write-compatibility"
        if self.complaint is not None and session.exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        if self.complaint is not None:
            terminalreporter.write_line(f"{PAGE.name} {self.complaint}", red=True)


def _agree(seen: str, page: str) -> bool:
    """What some of a cell's tests reported is on the page."""
    return seen == page or set(seen.split("; ")) - {_PASS} <= set(page.split("; ")) - {_PASS} != set()


def _listed(cells: list[Cell]) -> str:
    return ", ".join(f"{cell.client} {cell.feature} ({cell.vehicle})" for cell in cells)
