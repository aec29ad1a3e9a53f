"""Vehicles of both firmwares that speak the mission protocol."""

import pytest

from tests.services.mission_rig import Vehicle


@pytest.fixture
def px4() -> Vehicle:
    return Vehicle("px4")


@pytest.fixture
def ardupilot() -> Vehicle:
    return Vehicle("ardupilot")


@pytest.fixture(params=["px4", "ardupilot"])
def vehicle(request: pytest.FixtureRequest) -> Vehicle:
    return Vehicle(request.param)
