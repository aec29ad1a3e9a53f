"""What clients may do to a vehicle in the air, short of flying it: storms, sessions left open, crowds.

Work is counted, not timed: so many frames are looked at, and so many are sent, whatever is requested.
"""

from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.links import Link, open_link, parse_address
from autopilot_bridge.mavlink import DEFINITIONS, Frame, FrameEncoder, FrameParser
from autopilot_bridge.navigation import layout as nav
from tests.system.flying import Flying

FLAVOURS = ("px4", "ardupilot")
POLL_FRAMES = 60
"""At most so many frames are looked at in one poll, as shares of work are."""


class Client:
    """A client on a UDP socket."""

    def __init__(self, port: int, system_id: int = 255) -> None:
        self.link: Link = open_link(f"udpout:127.0.0.1:{port}")
        self.encoder = FrameEncoder(system_id, 190)
        self.parser = FrameParser()
        self.received: list[Frame] = []

    def say(self, message: Any) -> None:
        self.link.send(self.encoder.encode(message))

    def command(self, number: int, *parameters: float) -> None:
        values = (*parameters, *(0.0,) * (7 - len(parameters)))
        self.say(dialect.MAVLink_command_long_message(1, 1, number, 0, *values))

    def listen(self) -> None:
        for _, data in self.link.receive():
            self.received += self.parser.feed(data)

    def count(self, name: str) -> int:
        return sum(frame.definition.name == name for frame in self.received)


class Scene:
    """A vehicle that holds its place in the air, with a port for any client."""

    def __init__(self, flavour: str, stack: ExitStack) -> None:
        self.flying = Flying(flavour)
        self.flying.take_off(10.0)
        self.flying.sitl.poll_every(self.flying.sitl.step_us)
        self.before = self.flying.true_position_m, self.flying.mode
        link = open_link(parse_address("udpin:127.0.0.1:0"))
        self.channel = self.flying.vehicle.open(link)
        self.port = link.port  # type: ignore[attr-defined, union-attr]
        self._stack = stack
        stack.callback(link.close)
        self.frames_of_step: list[int] = []

    def client(self, system_id: int = 255) -> Client:
        made = Client(self.port, system_id)
        self._stack.callback(made.link.close)
        return made

    def on(self, seconds: float, *clients: Client) -> None:
        for _ in range(round(seconds * 1e6) // self.flying.sitl.step_us):
            before = self.channel.counters.frames
            self.flying.sitl.advance()
            self.frames_of_step.append(self.channel.counters.frames - before)
            for client in clients:
                client.listen()

    def check(self) -> None:
        """It flies on as before, and no step had more to do than it may."""
        (north_m, east_m, alt_m), mode = self.before
        now = self.flying.true_position_m
        assert self.flying.armed and self.flying.mode is mode
        assert max(abs(now[0] - north_m), abs(now[1] - east_m), abs(now[2] - alt_m)) < 1.0
        assert max(self.frames_of_step) <= POLL_FRAMES


@contextmanager
def scene(flavour: str) -> Iterator[Scene]:
    with ExitStack() as stack:
        made = Scene(flavour, stack)
        yield made
        made.check()


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_every_message_at_a_kilohertz(flavour: str) -> None:
    with scene(flavour) as there:
        client = there.client()
        for number in DEFINITIONS:
            client.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, number, 1000)
        there.on(3.0, client)
        client.received.clear()
        there.on(1.0, client)
        received = Counter(frame.message_id for frame in client.received)
        assert max(received.values()) <= 250  # nothing is faster than the physics


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.slow
def test_storms_of_requests(flavour: str) -> None:
    with scene(flavour) as there:
        client, other = there.client(), there.client(254)
        for number in range(1000):
            client.command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 30, 4000 + number)
            client.command(dialect.MAV_CMD_REQUEST_MESSAGE, 435, 0)
            client.say(dialect.MAVLink_param_request_list_message(1, 1))
            if number % 20 == 0:
                there.on(0.02, client, other)
        other.command(dialect.MAV_CMD_REQUEST_MESSAGE, dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        there.on(1.0, client, other)
        assert other.count("AUTOPILOT_VERSION") == 1  # the storm didn't hold the other up


def test_the_same_request_again_and_again_is_answered_once_a_tick() -> None:
    with scene("px4") as there:
        client = there.client()
        for _ in range(100):
            client.command(dialect.MAV_CMD_REQUEST_MESSAGE, dialect.MAVLINK_MSG_ID_AVAILABLE_MODES, 0)
        there.on(0.5, client)
        modes = len(there.flying.autopilot.flavour.modes.listed)
        assert client.count("COMMAND_ACK") == 100
        assert modes <= client.count("AVAILABLE_MODES") <= 12 * modes


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_parameters_set_faster_than_they_can_be(flavour: str) -> None:
    name = b"MPC_LAND_SPEED" if flavour == "px4" else b"LAND_SPEED_HIGH"
    with scene(flavour) as there:
        client = there.client()
        first, step = (0.6, 1e-3) if flavour == "px4" else (100.0, 1.0)
        for number in range(200):
            client.say(dialect.MAVLink_param_set_message(1, 1, name, first + step * number, 9))
        there.on(0.1, client)
        assert max(there.frames_of_step) <= 4
        there.on(2.0, client)
        assert there.flying.autopilot.parameters.get(name.decode()) == pytest.approx(first + 199 * step)


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
def test_an_upload_left_open_is_given_up(flavour: str) -> None:
    with scene(flavour) as there:
        rude, true = there.client(66), there.client()
        rude.say(dialect.MAVLink_mission_count_message(1, 1, 300))
        there.on(12.0, rude, true)
        requests = rude.count("MISSION_REQUEST") + rude.count("MISSION_REQUEST_INT")
        assert 1 <= requests <= 40
        true.say(dialect.MAVLink_mission_count_message(1, 1, 1))
        there.on(0.5, true)
        assert true.count("MISSION_REQUEST") + true.count("MISSION_REQUEST_INT") >= 1


@pytest.mark.slow
def test_a_thousand_ports() -> None:
    with scene("px4") as there:
        true = there.client()
        true.command(dialect.MAV_CMD_REQUEST_MESSAGE, dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        there.on(0.2, true)
        for number in range(1000):
            stranger = Client(there.port, 66)
            stranger.say(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
            stranger.link.close()
            if number % 10 == 0:
                there.on(0.004, true)
        assert len(there.channel.link.peers) <= 32
        true.received.clear()
        true.command(dialect.MAV_CMD_REQUEST_MESSAGE, dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        there.on(1.0, true)
        assert true.count("AUTOPILOT_VERSION") == 1 and true.count("ATTITUDE") > 90


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
def test_who_speaks_in_the_vehicles_name_is_not_listened_to(flavour: str) -> None:
    with scene(flavour) as there:
        impostor = there.client(1)
        impostor.encoder = FrameEncoder(1, 1)
        for _ in range(50):
            impostor.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0, 21196)
            impostor.say(dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 0, 3))
            impostor.say(dialect.MAVLink_set_mode_message(1, 1, 9))
        there.on(1.0, impostor)
        assert there.flying.vehicle.echoes == 150


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.sampled(1)
def test_a_stranger_does_not_disarm_in_the_air_unless_by_force(flavour: str) -> None:
    """As the firmware does: without the magic number it is denied; that client gets the denial."""
    with scene(flavour) as there:
        stranger = there.client(66)
        stranger.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 0)
        there.on(1.0, stranger)
        (ack,) = [frame for frame in stranger.received if frame.definition.name == "COMMAND_ACK"]
        assert ack.payload[2] != dialect.MAV_RESULT_ACCEPTED


@pytest.mark.slow
def test_setpoints_of_two_senders_are_followed_as_they_come() -> None:
    """As PX4 does: the newest setpoint counts, whoever sent it; OFFBOARD goes on while either sends."""
    with ExitStack() as stack:
        there = Scene("px4", stack)
        first, second = there.client(255), there.client(254)
        for tick in range(120):
            sender, north_m_s = (first, 1.0) if tick < 80 else (second, -1.0)
            sender.say(
                dialect.MAVLink_set_position_target_local_ned_message(
                    0, 1, 1, 1, 0b110111000111, 0, 0, 0, north_m_s, 0, 0, 0, 0, 0, 0, 0
                )
            )
            if tick == 10:
                first.command(dialect.MAV_CMD_DO_SET_MODE, 1, 6)
            there.on(0.1, first, second)
        assert there.flying.mode is FlightMode.OFFBOARD
        assert there.flying.autopilot.navigation.state[nav.VEL_NED_M_S][0] == pytest.approx(-1.0, abs=0.3)
