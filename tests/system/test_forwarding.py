"""What a vehicle forwards between its links: to whom it is meant for, and never round in circles."""

from collections.abc import Callable

import pytest

from autopilot_bridge.links import MemoryLink
from autopilot_bridge.mavlink import Frame, FrameEncoder, FrameParser, dialect
from autopilot_bridge.sitl import Sitl
from flightsim.world_spec import WorldSpec


class Client:
    """One end of a link: says things as some component, keeps what others said."""

    def __init__(self, sitl: Sitl, system_id: int, component_id: int) -> None:
        self.encoder = FrameEncoder(system_id, component_id)
        self.received: list[Frame] = []
        self.parser = FrameParser()
        self.link: MemoryLink = sitl.connect(0)
        self.link.on_receive = self.receive

    def receive(self, data: bytes) -> None:
        self.received += [
            frame for frame in self.parser.feed(data) if frame.system_id != 1 or frame.component_id != 1
        ]

    def say_hello(self) -> None:
        self.link.send(self.encoder.encode(dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 0, 3)))

    def command(self, system: int, component: int) -> None:
        message = dialect.MAVLink_command_long_message(system, component, 31000, 0, *[0.0] * 7)
        self.link.send(self.encoder.encode(message))

    def commands_received(self) -> int:
        return sum(frame.message_id == dialect.MAVLINK_MSG_ID_COMMAND_LONG for frame in self.received)


@pytest.fixture
def sitl() -> Sitl:
    return Sitl(WorldSpec())


@pytest.mark.parametrize(
    ("target", "forwarded"),
    [((1, 0), 1), ((1, 100), 1), ((0, 0), 1), ((1, 1), 0), ((1, 154), 0), ((9, 0), 0)],
)
def test_commands_reach_the_component_they_are_for(
    sitl: Sitl, target: tuple[int, int], forwarded: int
) -> None:
    ground, camera = Client(sitl, 255, 190), Client(sitl, 1, 100)
    camera.say_hello()
    ground.command(*target)
    assert camera.commands_received() == forwarded
    assert ground.commands_received() == 0


def test_a_sender_of_addressed_frames_is_learnt(sitl: Sitl) -> None:
    ground, camera = Client(sitl, 255, 190), Client(sitl, 1, 100)
    ground.command(1, 1)
    camera.command(255, 190)
    assert ground.commands_received() == 1


def test_own_words_are_not_passed_on(sitl: Sitl) -> None:
    one, other = Client(sitl, 255, 190), Client(sitl, 254, 190)
    echo = FrameEncoder(1, 1).encode(dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 0, 3))
    received: list[bytes] = []
    other.link.on_receive = received.append
    one.link.send(echo)
    assert received == []
    assert sitl.vehicles[0].echoes == 1


def test_a_bridge_between_two_links_makes_no_storm(sitl: Sitl) -> None:
    ground, first, second = Client(sitl, 255, 190), Client(sitl, 254, 190), Client(sitl, 253, 190)
    passed = [0]

    def bridge(to: MemoryLink) -> Callable[[bytes], None]:
        def forward(data: bytes) -> None:
            passed[0] += 1
            assert passed[0] < 10_000, "the frame goes round and round"
            to.send(data)

        return forward

    first.link.on_receive, second.link.on_receive = bridge(second.link), bridge(first.link)
    for _ in range(20):
        ground.say_hello()
    assert passed[0] <= 20 * 4
    while sitl.time_us < 3_000_000:
        sitl.advance()
    assert passed[0] < 5_000
