"""What a flight is steered by comes at its rate over a line that does not carry everything."""

from collections import Counter

import pytest

from autopilot_bridge.clock import LoopClock, VirtualTimeLoop, run
from autopilot_bridge.links import MemoryLink
from autopilot_bridge.mavlink import DEFINITIONS, FrameParser
from autopilot_bridge.sitl import Sitl
from flightsim.world_spec import VehicleSpec, WorldSpec
from missions.vehicle.connection import Connection
from missions.vehicle.stream_room import make_room
from missions.vehicle.vehicle import Vehicle

BAUD_57600 = 5760.0
NEEDED_HZ = {"ATTITUDE": 40.0, "VFR_HUD": 20.0, "GLOBAL_POSITION_INT": 10.0}
SECONDS = 10.0


class Line:
    """A memory link that tells what it carries, as a serial one does, and counts what comes."""

    def __init__(self, link: MemoryLink, bytes_per_s: float | None) -> None:
        self._link = link
        if bytes_per_s is not None:
            self.bytes_per_s = bytes_per_s
        self.counts: Counter[str] = Counter()
        self._parser = FrameParser()

    def __getattr__(self, name: str) -> object:
        return getattr(self._link, name)

    @property
    def on_receive(self) -> object:
        return self._link.on_receive

    @on_receive.setter
    def on_receive(self, listener: object) -> None:
        def take(data: bytes) -> None:
            self.counts.update(DEFINITIONS[frame.message_id].name for frame in self._parser.feed(data))
            listener(data)  # type: ignore[operator]

        self._link.on_receive = take


def received(flavour: str, *, reported: bool, room: bool) -> tuple[list[str], Counter[str]]:
    """What was slowed down, and what came in ten seconds after."""
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(autopilot=flavour),)))
    line = Line(sitl.connect(0, bytes_per_s=BAUD_57600), BAUD_57600 if reported else None)

    async def main() -> list[str]:
        async with Connection(line, LoopClock()) as connection:  # type: ignore[arg-type]
            vehicle = Vehicle(connection)
            await vehicle.wait_ready()
            for name, rate_hz in NEEDED_HZ.items():
                await vehicle.commands.set_message_rate(name, rate_hz)
            await vehicle.clock.sleep(3.0)
            slowed = await make_room(vehicle.commands, NEEDED_HZ) if room else []
            await vehicle.clock.sleep(3.0)
            line.counts.clear()
            await vehicle.clock.sleep(SECONDS)
            return slowed

    return run(main(), VirtualTimeLoop(sitl.advance, lambda: sitl.time_us)), line.counts


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.slow
def test_what_is_needed_gets_its_rate(flavour: str) -> None:
    _, before = received(flavour, reported=True, room=False)
    slowed, after = received(flavour, reported=True, room=True)
    assert before["ATTITUDE"] < 0.8 * NEEDED_HZ["ATTITUDE"] * SECONDS  # it was narrow
    for name, rate_hz in NEEDED_HZ.items():
        assert after[name] > 0.9 * rate_hz * SECONDS, name
    assert len(slowed) > 5
    for name in slowed:
        assert after[name] >= 0.9 * SECONDS, name  # slowed down, not stopped
        assert after[name] <= 1.2 * SECONDS, name


def test_a_link_that_does_not_tell_is_left_as_it_is() -> None:
    slowed, _ = received("px4", reported=False, room=True)
    assert slowed == []
