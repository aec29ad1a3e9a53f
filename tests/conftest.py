"""Settings of the whole suite.

Property tests draw the same examples on every run, so that no run is luckier than another. Ctrl-C works in
the tests and the programs they start, even where the suite runs in the background of a shell.
"""

import os
import signal

import pytest
from hypothesis import settings

from tests.clients.compatibility import CompatibilityPlugin

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--write-compatibility",
        action="store_true",
        help="write docs/compatibility.md from the outcomes of the tests with real clients",
    )


def pytest_xdist_auto_num_workers() -> int:
    """One worker more than there are cores: tests with processes and other people's clients mostly wait."""
    return (os.cpu_count() or 1) + 1


SLOW_TO_FINISH = ("test_static_checks.py", "clients", "system", "flights")
"""Files and folders whose tests take longest or wait most; begun first, no worker is left alone with them."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    def rank(item: pytest.Item) -> int:
        return min(
            (SLOW_TO_FINISH.index(part) for part in item.path.parts if part in SLOW_TO_FINISH),
            default=len(SLOW_TO_FINISH),
        )

    items.sort(key=rank)


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers", "compatibility(client, feature, vehicle): a cell of docs/compatibility.md"
    )
    config.pluginmanager.register(CompatibilityPlugin(config), "flightstack-compatibility")
