"""Fixtures of the tests of MAVSDK's plugins: in each module a SITL of every vehicle, a session by both APIs.

What takes long is left to the slow tests: the synchronous interface, and aircraft.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from tests.clients.mavsdk_session import Session
    from tests.clients.plugin_sitl import PluginSitl

COPTERS = ("px4", "ardupilot")
AIRCRAFT = ("px4-plane", "ardupilot-plane")


@pytest.fixture(
    scope="module", params=[*COPTERS, *(pytest.param(name, marks=pytest.mark.slow) for name in AIRCRAFT)]
)
def vehicle(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def sitl(vehicle: str, tmp_path_factory: pytest.TempPathFactory) -> "Iterator[PluginSitl]":
    pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")
    from tests.clients.plugin_sitl import plugin_sitl

    with plugin_sitl(vehicle, tmp_path_factory.mktemp("parameters")) as made:
        yield made


@pytest.fixture(
    scope="module", params=["MAVSDK asyncio", pytest.param("MAVSDK synchronous", marks=pytest.mark.slow)]
)
def client(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def mavsdk(sitl: "PluginSitl", client: str) -> "Iterator[Session]":
    session = sitl.session(client)
    try:
        yield session
    finally:
        session.close()
