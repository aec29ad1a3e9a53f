"""One vehicle's crash is its own: clients get a text, the autopilot of the wreck sends on, the others fly."""

import math

import pytest

from autopilot_bridge.mavlink import FrameParser, decode
from autopilot_bridge.mavlink.components import SIMULATOR_COMPONENT
from autopilot_bridge.sitl import Sitl
from flightsim import truth as t
from flightsim.initial_state import InitialState
from flightsim.world_spec import WorldSpec, team

DIVE = InitialState(
    height_m=15.0,
    vel_ned_m_s=(30.0 * math.cos(1.5), 0.0, 30.0 * math.sin(1.5)),
    roll_rad=math.pi,
    pitch_rad=-1.5,
    yaw_rad=0.0,
)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.sampled(1)
def test_a_crash_ends_nothing_but_the_aircraft(flavour: str) -> None:
    def fly(*, crash: bool) -> tuple[Sitl, list[bytes]]:
        vehicles = team(2, model=["aerosonde", "iris"], autopilot=flavour, parameters={})
        sitl = Sitl(WorldSpec(vehicles=vehicles, seed=4))
        received: list[bytes] = []
        sitl.connect(0).on_receive = received.append
        if crash:
            sitl.vehicles[0].vehicle.reset(DIVE)
        for _ in range(1500):
            sitl.advance()
        return sitl, received

    sitl, received = fly(crash=True)
    wrecked, other = sitl.vehicles
    assert wrecked.crashed and not other.crashed
    frames = FrameParser().feed(b"".join(received))
    texts = [
        (frame.component_id, decode(frame).text)  # type: ignore[attr-defined]
        for frame in frames
        if frame.message_id == 253 and "Simulator" in decode(frame).text  # type: ignore[attr-defined]
    ]
    assert [component for component, _ in texts] == [SIMULATOR_COMPONENT]
    assert "hit the ground at" in texts[0][1]
    heartbeats = [frame for frame in frames if frame.message_id == 0 and frame.component_id == 1]
    assert len(heartbeats) >= 4
    assert wrecked.vehicle.truth[t.ON_GROUND] == 1.0
    alone, _ = fly(crash=False)
    assert other.vehicle.truth.tobytes() == alone.vehicles[1].vehicle.truth.tobytes()
