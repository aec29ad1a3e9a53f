"""A link that brings every frame of the mission twice, as mesh radios do, changes nothing that is flown."""

import pytest

from autopilot_bridge.mission_plan import MissionItem
from missions.vehicle.vehicle import Vehicle
from tests.system.flying import Flying

WAYPOINT, COUNT = 16, 300


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_uploads_a_plan(flavour: str) -> None:
    """ArduPilot answers a repeated item with INVALID_SEQUENCE and goes on with the transfer."""
    flying = Flying(flavour)

    async def script(vehicle: Vehicle) -> list[MissionItem]:
        await vehicle.wait_ready()
        home = vehicle.home
        plan = [vehicle.firmware.takeoff_item(home, 10.0)]
        for k in range(COUNT):
            x = home.lat_deg + 1e-6 * k
            plan.append(MissionItem(command=WAYPOINT, x=x, y=home.lon_deg, z=10.0))
        await vehicle.plans.upload_mission(plan)
        return await vehicle.plans.download_mission()

    items = flying.mission(script, sendings=2)
    assert len(items) == COUNT + 1
    place = flying.sitl.spec.place
    assert [item.x for item in items[1:]] == pytest.approx(
        [place.lat_deg + 1e-6 * k for k in range(COUNT)], abs=2e-5
    )


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.sampled(1)
def test_takes_off_and_lands(flavour: str) -> None:
    flying = Flying(flavour)

    async def script(vehicle: Vehicle) -> float:
        await vehicle.wait_ready()
        await vehicle.takeoff(6.0)
        height_m = flying.true_position_m[2] - flying.sitl.spec.place.alt_m
        await vehicle.land()
        return height_m

    assert flying.mission(script, sendings=2) == pytest.approx(6.0, abs=1.0)
    assert not flying.armed
