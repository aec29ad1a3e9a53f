"""Settings of the whole suite.

Property tests draw the same examples on every run, so that no run is luckier than another. Ctrl-C works in
the tests and the programs they start, even where the suite runs in the background of a shell. Byte code is
kept, as kernels are.
"""

import gc
import os
import signal
import sys
from typing import Final

import pytest
from hypothesis import settings

from missions.cli.main import YOUNG_OBJECTS
from tests.clients.compatibility import CompatibilityPlugin

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

signal.signal(signal.SIGINT, signal.default_int_handler)
gc.set_threshold(YOUNG_OBJECTS)  # the collection of tests makes millions of objects that stay

# Workers and programs that are started each would compile every module they import, wherever this is set.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


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


ORDER: Final = (
    ("test_static_checks.py",),
    # In a fresh clone this compiles the flight code. Meanwhile the others run what needs none of it, so that
    # not every process compiles everything.
    ("test_warm_up.py",),
    ("bridge", "logs", "preflight", "storage", "vehicle_client", "test_architecture.py"),
    # These take longest or wait most: begun early, no worker is left alone with them.
    ("clients", "test_tutorial.py", "test_examples.py"),
    ("system",),
    ("flights",),
)
"""Files and folders whose tests are begun first."""


def pytest_collection_finish() -> None:
    """The modules and tests stay until the end: the collector need not look through them again and again."""
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    def rank(item: pytest.Item) -> int:
        parts = item.path.parts
        return next((k for k, names in enumerate(ORDER) if set(names) & set(parts)), len(ORDER))

    items.sort(key=rank)


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers", "compatibility(client, feature, vehicle): a cell of docs/compatibility.md"
    )
    config.pluginmanager.register(CompatibilityPlugin(config), "flightstack-compatibility")
