"""Several clients on one link, several vehicles on one link: who hears what, over UDP and TCP."""

from collections import Counter
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge.links import Reach, open_link, parse_address
from autopilot_bridge.mavlink import Frame, FrameEncoder, FrameParser, LinkSigning, SigningKey, SigningState
from autopilot_bridge.sitl import SigningParameters, Sitl
from flightsim.world_spec import WorldSpec, team

HEARTBEAT, COMMAND, ACK = (
    dialect.MAVLINK_MSG_ID_HEARTBEAT,
    dialect.MAVLINK_MSG_ID_COMMAND_LONG,
    dialect.MAVLINK_MSG_ID_COMMAND_ACK,
)
KEY = SigningKey.from_passphrase("team")
LIMIT_STEPS = 2000


class Client:
    """A ground station or companion on a socket of its own."""

    def __init__(self, url: str, system_id: int, component_id: int = 190) -> None:
        self.link = open_link(url)
        self.encoder = FrameEncoder(system_id, component_id)
        self.ids = system_id, component_id
        self.received: list[Frame] = []
        self._parser = FrameParser()
        self.sign: Callable[[bytes], bytes] = bytes

    def say(self, message: Any) -> None:
        self.link.send(self.sign(self.encoder.encode(message)))

    def say_hello(self) -> None:
        self.say(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))

    def command(self, system: int, component: int = 1, number: int = 31000) -> None:
        self.say(dialect.MAVLink_command_long_message(system, component, number, 0, *[0.0] * 7))

    def listen(self) -> None:
        for _, data in self.link.receive():
            self.received += self._parser.feed(data)

    def senders(self, message_id: int) -> Counter[tuple[int, int]]:
        return Counter(
            (frame.system_id, frame.component_id) for frame in self.received if frame.message_id == message_id
        )


class World:
    """Vehicles, and clients that are distinguished."""

    def __init__(self, count: int = 1, flavour: str = "px4", **signing: Any) -> None:
        vehicles = team(count, model="iris", autopilot=flavour, parameters={})
        self.sitl = Sitl(WorldSpec(vehicles=vehicles), signing=SigningParameters(**signing))
        self.sitl.poll_every(self.sitl.step_us)
        self.clients: list[Client] = []

    def listen(
        self, kind: str, *, shared: bool = False, role: str = "gcs", reach: Reach = Reach.MACHINE
    ) -> str:
        """Open a server; gives the address for clients."""
        link = open_link(parse_address(f"{kind}:127.0.0.1:0"))
        if shared:
            self.sitl.share(link, role=role, reach=reach)
        else:
            self.sitl.vehicles[0].open(link, role=role, reach=reach)
        return f"{'tcp' if kind == 'tcpin' else 'udpout'}:127.0.0.1:{link.port}"  # type: ignore[attr-defined]

    def client(self, url: str, system_id: int, component_id: int = 190) -> Client:
        self.clients.append(Client(url, system_id, component_id))
        return self.clients[-1]

    def until(self, found: Callable[[], Any]) -> None:
        for _ in range(LIMIT_STEPS):
            self.sitl.advance()
            for client in self.clients:
                client.listen()
            if found():
                return
        raise AssertionError("not in eight seconds")

    def on(self, seconds: float) -> None:
        end_us = self.sitl.time_us + round(seconds * 1e6)
        self.until(lambda: self.sitl.time_us >= end_us)

    def close(self) -> None:
        self.sitl.close()
        for client in self.clients:
            client.link.close()


@pytest.fixture
def worlds() -> Iterator[Callable[..., World]]:
    made: list[World] = []

    def make(*arguments: Any, **more: Any) -> World:
        made.append(World(*arguments, **more))
        return made[-1]

    yield make
    for world in made:
        world.close()


# several clients on one link


@pytest.mark.parametrize("kind", ["udpin", "tcpin"])
def test_clients_of_one_link_hear_the_vehicle_and_each_other(kind: str, worlds: Callable[..., World]) -> None:
    world = worlds()
    url = world.listen(kind)
    ground, companion = world.client(url, 255), world.client(url, 1, 191)
    for client in (ground, companion):
        client.say_hello()
    world.until(lambda: all(client.senders(HEARTBEAT)[1, 1] for client in world.clients))
    for client in (ground, companion):
        client.say_hello()
    world.until(lambda: ground.senders(HEARTBEAT)[1, 191] and companion.senders(HEARTBEAT)[255, 190])
    ground.command(1, 191)
    world.until(lambda: companion.senders(COMMAND)[255, 190] == 1)
    companion.say(dialect.MAVLink_command_ack_message(31000, 0, 0, 0, 255, 190))
    world.until(lambda: ground.senders(ACK)[1, 191] == 1)
    ground.command(1, 1)
    world.until(lambda: ground.senders(ACK)[1, 1] == 1)
    world.on(0.5)
    assert companion.senders(COMMAND) == {(255, 190): 1}  # the command to the autopilot is not for it
    assert not ground.senders(HEARTBEAT)[255, 190] and not ground.senders(COMMAND)  # not received


def test_a_frame_for_an_unknown_target_is_not_forwarded(worlds: Callable[..., World]) -> None:
    world = worlds()
    url = world.listen("udpin")
    first, second = world.client(url, 255), world.client(url, 254)
    for _ in range(2):
        first.say_hello()
        second.say_hello()
        world.on(0.1)
    first.command(77)
    first.command(1, 154)
    first.command(254, 1)
    first.command(254, 190)
    world.until(lambda: second.senders(COMMAND))
    world.on(0.5)
    assert second.senders(COMMAND) == {(255, 190): 1}


def test_a_client_that_says_nonsense_is_not_spoken_to(worlds: Callable[..., World]) -> None:
    world = worlds()
    url = world.listen("udpin")
    true, stranger = world.client(url, 255), world.client(url, 66)
    true.say_hello()
    stranger.link.send(b"\xfd\x09 let me in " * 20)
    world.until(lambda: true.senders(HEARTBEAT)[1, 1])
    world.on(1.0)
    assert stranger.received == []


def test_under_a_key_the_unsigned_are_not_spoken_to(worlds: Callable[..., World]) -> None:
    world = worlds(key=KEY)
    url = world.listen("udpin", reach=Reach.NETWORK)
    true, stranger = world.client(url, 255), world.client(url, 66)
    true.sign = LinkSigning(SigningState(KEY, clock=lambda: 1 << 46), link_id=0).sign
    true.say_hello()
    world.until(lambda: true.senders(HEARTBEAT)[1, 1])
    for _ in range(5):
        stranger.say_hello()
        stranger.command(255, 190)
        true.say_hello()
        world.on(0.1)
    assert stranger.received == [] and not true.senders(COMMAND) and not true.senders(HEARTBEAT)[66, 190]


def test_no_client_sends_in_the_vehicles_name(worlds: Callable[..., World]) -> None:
    """What claims to be the autopilot reaches neither the autopilot nor other clients."""
    world = worlds()
    url = world.listen("udpin")
    ground, impostor = world.client(url, 255), world.client(url, 1, 1)
    hello = world.client(url, 66)
    for client in (ground, hello, impostor):
        client.say_hello()
    world.until(lambda: ground.senders(HEARTBEAT)[1, 1])
    before = ground.senders(HEARTBEAT)[1, 1]
    for _ in range(50):
        impostor.say(dialect.MAVLink_heartbeat_message(2, 12, 0x81, 0x00060000, 5, 3))
    world.on(0.5)
    assert ground.senders(HEARTBEAT)[1, 1] <= before + 1
    assert world.sitl.vehicles[0].echoes == 51


# several vehicles on one link


@pytest.mark.parametrize("kind", ["udpin", "tcpin"])
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.sampled(2)
def test_five_vehicles_on_one_link(kind: str, flavour: str, worlds: Callable[..., World]) -> None:
    world = worlds(5, flavour)
    url = world.listen(kind, shared=True)
    ground = world.client(url, 255)
    ground.say_hello()
    vehicles = {(number, 1) for number in range(1, 6)}
    world.until(lambda: vehicles <= set(ground.senders(HEARTBEAT)))
    ground.command(3)
    world.until(lambda: ground.senders(ACK))
    world.on(0.2)
    assert ground.senders(ACK) == {(3, 1): 1}
    ground.received.clear()
    ground.say(dialect.MAVLink_param_request_read_message(4, 1, b"SYSID_THISMAV", -1))
    ground.say(dialect.MAVLink_param_request_read_message(4, 1, b"MAV_SYS_ID", -1))
    world.until(lambda: ground.senders(dialect.MAVLINK_MSG_ID_PARAM_VALUE))
    assert set(ground.senders(dialect.MAVLINK_MSG_ID_PARAM_VALUE)) == {(4, 1)}


def test_clients_of_a_shared_link_hear_each_other_once(worlds: Callable[..., World]) -> None:
    world = worlds(3)
    url = world.listen("udpin", shared=True)
    first, second = world.client(url, 255), world.client(url, 254)
    for _ in range(2):
        first.say_hello()
        second.say_hello()
        world.on(0.1)
    before = second.senders(HEARTBEAT)[255, 190]
    first.say_hello()
    first.command(254, 190)
    world.until(lambda: second.senders(COMMAND))
    world.on(0.5)
    assert second.senders(HEARTBEAT)[255, 190] == before + 1
    assert second.senders(COMMAND) == {(255, 190): 1}


def test_between_two_shared_links_a_frame_passes_once(worlds: Callable[..., World]) -> None:
    world = worlds(3)
    first = world.client(world.listen("udpin", shared=True), 255)
    second = world.client(world.listen("udpin", shared=True, role="onboard"), 254)
    for _ in range(2):
        first.say_hello()
        second.say_hello()
        world.on(0.1)
    assert second.senders(HEARTBEAT)[255, 190] <= 2 and first.senders(HEARTBEAT)[254, 190] <= 2
    first.command(254, 190)
    first.command(2, 1)
    world.until(lambda: second.senders(COMMAND) and first.senders(ACK))
    world.on(0.5)
    assert second.senders(COMMAND) == {(255, 190): 1}
    assert first.senders(ACK) == {(2, 1): 1}


def test_a_shared_link_under_a_key(worlds: Callable[..., World]) -> None:
    world = worlds(2, key=KEY)
    url = world.listen("udpin", shared=True, reach=Reach.NETWORK)
    true, stranger = world.client(url, 255), world.client(url, 66)
    true.sign = LinkSigning(SigningState(KEY, clock=lambda: 1 << 46), link_id=0).sign
    for client in (true, stranger):
        client.say_hello()
        client.command(2)
    world.until(lambda: true.senders(ACK)[2, 1])
    world.on(1.0)
    assert stranger.received == []
    assert true.senders(ACK) == {(2, 1): 1}
    checking = LinkSigning(SigningState(KEY, clock=lambda: 0), link_id=0)
    assert len(checking.admit(true.received)) == len(true.received)


def test_impostors_on_a_shared_link(worlds: Callable[..., World]) -> None:
    world = worlds(2)
    url = world.listen("udpin", shared=True)
    ground, impostor = world.client(url, 255), world.client(url, 2, 1)
    ground.say_hello()
    world.client(url, 66).say_hello()
    world.until(lambda: ground.senders(HEARTBEAT)[2, 1])
    before = ground.senders(HEARTBEAT)[2, 1]
    for _ in range(50):
        impostor.say_hello()
    world.on(0.5)
    assert ground.senders(HEARTBEAT)[2, 1] <= before + 1
    assert world.sitl.shared_links[0].echoes == 50


@pytest.mark.parametrize("odd", [b"\n", b"\xfd\x09", "echo"])
def test_a_client_is_kept_on_a_shared_link_whatever_else_it_sends(
    odd: bytes | str, worlds: Callable[..., World]
) -> None:
    """A line's end, half a frame, a vehicle's frame brought back: once accepted, a client is sent to."""
    world = worlds(2)
    ground = world.client(world.listen("udpin", shared=True), 255)
    ground.say_hello()
    vehicles = {(1, 1), (2, 1)}
    world.until(lambda: vehicles <= set(ground.senders(HEARTBEAT)))
    ground.link.send(odd if isinstance(odd, bytes) else ground.received[0].raw)
    world.on(0.1)
    ground.received.clear()
    world.until(lambda: vehicles <= set(ground.senders(HEARTBEAT)))


def test_strangers_on_a_shared_link_are_not_spoken_to(worlds: Callable[..., World]) -> None:
    world = worlds(2)
    url = world.listen("udpin", shared=True)
    ground, stranger = world.client(url, 255), world.client(url, 66)
    ground.say_hello()
    stranger.link.send(b"\xfd\x09 let me in " * 20)
    world.until(lambda: ground.senders(HEARTBEAT)[2, 1])
    stranger.link.send(ground.received[0].raw)
    world.on(1.0)
    assert stranger.received == []
