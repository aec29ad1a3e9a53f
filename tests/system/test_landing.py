"""A landing ends: the autopilot notices the ground and disarms, on both firmwares."""

import pytest

from flightsim import truth as t
from missions.vehicle.vehicle import Vehicle
from tests.system.flying import Flying


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_disarms_soon_after_touchdown(flavour: str) -> None:
    """Thrust that winds down on the ground is not taken for hover thrust: that would hide the landing."""
    flying = Flying(flavour)
    flying.take_off(6.0)
    hover_thrust = flying.autopilot.controller.hover_thrust
    touchdown_us: list[int] = []

    async def land(vehicle: Vehicle) -> None:
        await vehicle.land(wait=False)
        while vehicle.armed:
            if flying.vehicle.vehicle.truth[t.ON_GROUND] and not touchdown_us:
                touchdown_us.append(vehicle.clock.time_us)
            await vehicle.clock.sleep(0.1)

    flying.mission(land)
    assert flying.sitl.time_us - touchdown_us[0] < 12e6
    assert flying.autopilot.controller.hover_thrust == pytest.approx(hover_thrust, rel=0.1)
