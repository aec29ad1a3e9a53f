"""Frames that are handed over within a process are those that the bytes of the same link contain."""

import asyncio

import pytest

from autopilot_bridge.clock import LoopClock, run
from autopilot_bridge.mavlink import FrameParser
from flightsim.world_spec import WorldSpec
from missions.embedded import EmbeddedSitl
from missions.vehicle.connection import Connection


class Recorded:
    acts = False

    def __init__(self):
        self.frames = []

    def record(self, packet, time_us):
        self.frames += [(time_us, frame) for frame in packet]


def recorded(flavour, *, by_id):
    """Frames of the first seconds of a vehicle, as a connection records them."""
    sitl = EmbeddedSitl(WorldSpec.of_team(autopilot=flavour, seed=4))
    records = Recorded()

    async def listen():
        async with Connection(sitl.links[0], LoopClock(), records):
            if not by_id:
                sitl.links[0].on_packet = None  # type: ignore[attr-defined]
            await asyncio.sleep(6.0)

    run(listen(), sitl.loop)
    sitl.close()
    return records.frames


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_the_same_frames_at_the_same_times(flavour):
    handed_over, parsed = (recorded(flavour, by_id=by_id) for by_id in (True, False))
    assert len(handed_over) > 10
    assert handed_over == parsed
    for _, frame in handed_over[::20]:
        assert FrameParser().feed(frame.raw) == [frame]
