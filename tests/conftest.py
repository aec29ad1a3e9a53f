"""Settings of the whole suite.

Property tests draw the same examples on every run, so that no run is luckier than another. Ctrl-C works in
the tests and the programs they start, even where the suite runs in the background of a shell.
"""

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


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers", "compatibility(client, feature, vehicle): a cell of docs/compatibility.md"
    )
    config.pluginmanager.register(CompatibilityPlugin(config), "flightstack-compatibility")
