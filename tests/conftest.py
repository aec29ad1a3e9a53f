"""Settings of the whole suite.

Property tests draw the same examples on every run, so that no run is luckier than another. Ctrl-C works in
the tests and the programs they start, even where the suite runs in the background of a shell. Byte code is
kept, as kernels are.
"""

import gc
import os
import signal
import sys
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import pytest
from hypothesis import settings

from missions.cli.main import YOUNG_OBJECTS
from tests.clients.compatibility import CompatibilityPlugin

settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("repeatable")

signal.signal(signal.SIGINT, signal.default_int_handler)
gc.set_threshold(YOUNG_OBJECTS)  # the collection of tests makes millions of objects that stay

# Workers and programs that are started each would compile every module they import, wherever this is set.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# Flights of the command line write no page: it takes two seconds. Tests of the page ask for it.
os.environ["FLIGHTSTACK_NO_REPORT"] = "1"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--write-compatibility",
        action="store_true",
        help="write docs/compatibility.md from the outcomes of the tests with real clients",
    )


def pytest_xdist_auto_num_workers() -> int:
    """One worker more than there are cores: tests with processes and other people's clients mostly wait. Two
    more take longer: each compiles what another one is compiling."""
    return (os.cpu_count() or 1) + 1


BEGUN_FIRST: Final = (
    "test_static_checks.py",
    # In a fresh clone this compiles the flight code. Meanwhile the others run what needs none of it, so that
    # not every process compiles everything.
    "test_warm_up.py",
    *("bridge", "logs", "preflight", "storage", "vehicle_client", "test_architecture.py"),
)
"""Files and folders whose tests are begun first, in this order."""
WAITING: Final = ("test_tutorial.py", "test_examples.py", "test_live.py", "test_ray.py", "clients", "studies")
"""Files and folders whose tests mostly wait for processes, what takes longest first. They are begun one by
one among the others, so that some worker always computes."""


def pytest_collection_finish() -> None:
    """The modules and tests stay until the end: the collector need not look through them again and again."""
    gc.freeze()


def leave_samples(items: Sequence[pytest.Item]) -> None:
    """Mark as slow what is left out of the `sampled` tests.

    The cases of a test are mostly the flavours, vehicles or links for which the same is shown. Where the
    sample begins follows from the test's name, so each flavour is in the samples of half of the tests.
    """
    tests: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("sampled") and not item.get_closest_marker("slow"):
            tests.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for name, cases in tests.items():
        (count,) = next(cases[0].iter_markers("sampled")).args
        begin = zlib.crc32(name.encode())
        sample = {(begin + k * len(cases) // count) % len(cases) for k in range(count)}
        for index, item in enumerate(cases):
            if index not in sample:
                item.add_marker("slow")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    leave_samples(items)
    files: dict[Path, list[pytest.Item]] = {}
    for item in items:
        files.setdefault(item.path, []).append(item)

    def in_order(names: Sequence[str]) -> list[Path]:
        """The files of these names or in folders of these names, in the order of the names."""
        return list(dict.fromkeys(path for name in names for path in files if name in path.parts))

    first, waiting = in_order(BEGUN_FIRST), in_order(WAITING)
    others = [path for path in files if path not in {*first, *waiting}]
    between = -(-len(others) // max(1, len(waiting)))
    order = first
    for k in range(max(1, len(waiting))):
        order += [*waiting[k : k + 1], *others[k * between : (k + 1) * between]]
    items[:] = [item for path in order for item in files[path]]


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers", "compatibility(client, feature, vehicle): a cell of docs/compatibility.md"
    )
    config.pluginmanager.register(CompatibilityPlugin(config), "flightstack-compatibility")
