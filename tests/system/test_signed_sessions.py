"""Signed sessions: they fly, and who has no key changes nothing. On virtual time."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as dialect

from autopilot_bridge.links import Reach
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, LinkSigning, SigningKey, SigningState, decode
from autopilot_bridge.mavlink.signing import MINUTE, Refusal
from autopilot_bridge.sitl import SigningParameters, SigningStore, Sitl, UnsignedFrom
from autopilot_bridge.tlog import TlogReader, TlogWriter
from flightsim.payload import CameraParameters, GimbalParameters, PayloadParameters
from flightsim.world_spec import VehicleSpec, WorldSpec
from missions.vehicle import Vehicle
from tests.system.flying import Flying, WrappedLink
from tests.system.hostile import commands, parameter_sets, valid_frames

KEY, OTHER_KEY = SigningKey.from_passphrase("ours"), SigningKey.from_passphrase("theirs")
NOTHING = bytes(32)


def signer(key: SigningKey, timestamp: int, link_id: int = 9) -> Callable[[bytes], bytes]:
    """Signs frames, one unit of time apart."""
    ticks = iter(range(timestamp, timestamp + (1 << 40)))
    return LinkSigning(SigningState(key, clock=lambda: next(ticks)), link_id=link_id).sign_again


def attacks() -> list[bytes]:
    """What an attacker would like the vehicle to do: everything there is."""
    encoder = FrameEncoder(255, 190)
    wanted = [
        dialect.MAVLink_command_long_message(1, 1, 400, 0, 0, 21196, 0, 0, 0, 0, 0),  # disarm by force
        dialect.MAVLink_command_long_message(1, 1, 176, 0, 1, 4, 6, 0, 0, 0, 0),
        dialect.MAVLink_command_long_message(1, 1, 511, 0, 30, 1e6, 0, 0, 0, 0, 0),
        dialect.MAVLink_command_long_message(1, 1, 185, 0, 1, 0, 0, 0, 0, 0, 0),  # terminate
        dialect.MAVLink_set_mode_message(1, 1, 0x05040000),
        dialect.MAVLink_param_set_message(1, 1, b"MPC_XY_VEL_MAX", 1.0, 9),
        dialect.MAVLink_mission_clear_all_message(1, 1),
        dialect.MAVLink_mission_count_message(1, 1, 2),
        dialect.MAVLink_setup_signing_message(1, 1, list(OTHER_KEY.secret), 1 << 47),
        dialect.MAVLink_setup_signing_message(1, 1, [0] * 32, 0),
    ]
    frames = [encoder.encode(message) for message in wanted]
    frames += commands(11, 2000, target=1, without=())
    frames += valid_frames(12, 2000, target=1)
    return frames + parameter_sets(13, 500, ["MPC_XY_VEL_MAX", "COM_RCL_EXCEPT"], target=1)


class _Tapped(WrappedLink):
    """A client's link, and whoever listens."""

    def send(self, data: bytes) -> None:
        self._sent.append(data)
        self._link.send(data)


@pytest.fixture(scope="module")
def recorded() -> tuple[list[bytes], int]:
    """What the true client of a flight sent, signed, and when it ended."""
    flying = Flying(key=KEY, reach=Reach.NETWORK)
    sent: list[bytes] = []
    flying.link = _Tapped(flying.link, _sent=sent)  # type: ignore[assignment]
    flying.take_off(10.0)
    return sent, flying.now()


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.sampled(1)
def test_a_signed_session_flies(flavour: str) -> None:
    flying = Flying(flavour, key=KEY, reach=Reach.NETWORK)
    flying.take_off(10.0)
    assert flying.armed and flying.true_position_m[2] - flying.sitl.spec.place.alt_m > 9.0

    async def script(vehicle: Vehicle) -> None:
        await vehicle.return_to_launch()

    flying.mission(script)
    assert not flying.armed
    counters = flying.vehicle.channels[0].signing.counters  # type: ignore[union-attr]
    assert counters.refused_frames == counters.tolerated == 0
    assert counters.verified > 40 and counters.sent > 1000
    assert flying.signing is not None
    assert flying.signing.counters.refused_frames == flying.signing.counters.tolerated == 0


def test_the_same_session_twice_is_the_same_bytes() -> None:
    def received() -> list[bytes]:
        flying = Flying(key=KEY, reach=Reach.NETWORK)
        received: list[bytes] = []
        flying.link.on_receive = received.append
        flying.step(3.0)
        return received

    first = received()
    assert first == received() and len(first) > 100
    assert all(packet[2] == 1 for packet in first)


UNSIGNED, WRONG, OLD, REPLAY = "unsigned", "wrong key", "old", "replay"
REASONS = {
    UNSIGNED: Refusal.UNSIGNED,
    WRONG: Refusal.BAD_SIGNATURE,
    OLD: Refusal.OLD,
    REPLAY: Refusal.REPLAYED,
}


class Attacked:
    """A signed flight with a second link, left alone from 10 m height on."""

    def __init__(self) -> None:
        self.flying = Flying(key=KEY, reach=Reach.NETWORK)
        self.other = self.flying.sitl.connect(0, reach=Reach.NETWORK)
        self.flying.take_off(10.0)
        self.received: list[bytes] = []
        self.flying.link.on_receive = self.received.append

    @property
    def outcome(self) -> tuple[bytes, dict[str, float], SigningKey | None]:
        vehicle = self.flying.vehicle
        parameters = self.flying.autopilot.parameters.as_dict()
        return vehicle.vehicle.truth.tobytes(), parameters, vehicle.links.signing.state.key


@pytest.fixture(scope="module")
def left_alone() -> Attacked:
    flight = Attacked()
    flight.flying.step(5.0)
    assert flight.flying.armed
    return flight


@pytest.mark.parametrize("same_link", [True, False], ids=["same link", "other link"])
@pytest.mark.parametrize("attack", REASONS)
@pytest.mark.sampled(1)
def test_an_attacker_changes_nothing_at_all(
    attack: str, same_link: bool, recorded: tuple[list[bytes], int], left_alone: Attacked
) -> None:
    """The flight is the same to the last bit as one without the attack, and so is what the client hears."""
    flight = Attacked()
    frames, now = attacks(), flight.flying.now()
    if attack == WRONG:
        frames = [signer(OTHER_KEY, now + index)(raw) for index, raw in enumerate(frames)]
    elif attack == OLD:
        frames = [signer(KEY, now - 2 * MINUTE + index)(raw) for index, raw in enumerate(frames)]
    elif attack == REPLAY:
        frames = recorded[0] * 20
        assert recorded[1] == now
    for raw in frames:
        (flight.flying.link if same_link else flight.other).send(raw)
    counters = flight.flying.vehicle.channels[0 if same_link else 1].signing.counters  # type: ignore[union-attr]
    assert counters.refused[REASONS[attack]] >= len(frames) > 300
    flight.flying.step(5.0)
    assert flight.outcome == left_alone.outcome
    assert (
        flight.received == left_alone.received and len(flight.received) > 100
    )  # no answer, no text, no faster stream


@pytest.mark.parametrize(
    ("reach", "accepted"), [(Reach.CABLE, True), (Reach.MACHINE, False), (Reach.NETWORK, False)]
)
def test_whoever_gives_a_key_has_it_required_everywhere_but_on_a_cable(reach: Reach, accepted: bool) -> None:
    sitl = Sitl(WorldSpec(), signing=SigningParameters(key=KEY))
    link = sitl.connect(0, reach=reach)
    setting = dialect.MAVLink_param_set_message(1, 1, b"MIS_TAKEOFF_ALT", 7.0, 9)
    link.send(FrameEncoder(255, 190).encode(setting))
    taken = sitl.vehicles[0].autopilot.parameters.as_dict()["MIS_TAKEOFF_ALT"]
    assert taken == (7.0 if accepted else 2.5)


def test_a_radio_on_the_line_passes_unsigned() -> None:
    sitl = Sitl(WorldSpec(), signing=SigningParameters(key=KEY, unsigned_from=UnsignedFrom.NONE))
    for reach, tolerated in ((Reach.CABLE, 1), (Reach.MACHINE, 0), (Reach.NETWORK, 0)):
        link = sitl.connect(0, reach=reach)
        link.send(FrameEncoder(51, 68).encode(dialect.MAVLink_radio_status_message(9, 9, 90, 1, 1, 0, 0)))
        counters = sitl.vehicles[0].channels[-1].signing.counters  # type: ignore[union-attr]
        assert (counters.tolerated, counters.refused_frames) == (tolerated, 1 - tolerated)


def test_payload_speaks_under_the_vehicles_key() -> None:
    carried = PayloadParameters(gimbal=GimbalParameters(), camera=CameraParameters())
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(payload=carried),)), signing=SigningParameters(key=KEY))
    link, mine = sitl.connect(0, reach=Reach.NETWORK), sitl.connect(0)
    checking = LinkSigning(SigningState(KEY, clock=lambda: 0), link_id=0)
    parser, components = FrameParser(), set()
    unsigned = FrameParser()

    def receive(data: bytes) -> None:
        components.update(frame.component_id for frame in checking.admit(parser.feed(data)))

    link.on_receive = receive
    mine.on_receive = lambda data: (unsigned.feed(data), None)[1]
    while sitl.time_us < 3_000_000:
        sitl.advance()
    assert components == {1, 100, 154} and checking.counters.refused_frames == 0
    assert unsigned.counters.frames_signed == 0  # parts of the vehicle know each other


# keys by message


class Keys:
    """A vehicle on the ground, and a client that brings keys."""

    def __init__(self, reach: Reach, **parameters: Any) -> None:
        self.sitl = Sitl(WorldSpec(), signing=SigningParameters(**parameters))
        self.link = self.sitl.connect(0, reach=reach)
        self.other = self.sitl.connect(0)
        self.texts: list[str] = []
        self.elsewhere: list[int] = []
        self.parser, self.other_parser = FrameParser(), FrameParser()
        self.link.on_receive = self.receive
        self.other.on_receive = lambda data: self.elsewhere.extend(
            frame.message_id for frame in self.other_parser.feed(data)
        )
        self.encoder = FrameEncoder(255, 190)

    def receive(self, data: bytes) -> None:
        self.texts += [
            decode(frame).text  # type: ignore[attr-defined]
            for frame in self.parser.feed(data)
            if frame.definition.name == "STATUSTEXT"  # type: ignore[attr-defined]
        ]

    @property
    def key(self) -> SigningKey | None:
        return self.sitl.vehicles[0].links.signing.state.key

    def bring(self, secret: bytes, sign: Callable[[bytes], bytes] = bytes, target: int = 1) -> None:
        message = dialect.MAVLink_setup_signing_message(target, 1, list(secret), 0)
        self.link.send(sign(self.encoder.encode(message)))


@pytest.mark.parametrize(("reach", "taken"), [(Reach.MACHINE, True), (Reach.NETWORK, False)])
def test_the_first_key_comes_by_a_trusted_link(reach: Reach, taken: bool) -> None:
    keys = Keys(reach)
    keys.bring(KEY.secret)
    assert keys.key == (KEY if taken else None)
    assert keys.texts == ["Signing key set" if taken else "Signing key refused: link not trusted"]
    assert dialect.MAVLINK_MSG_ID_SETUP_SIGNING not in keys.elsewhere  # never passed on


@pytest.mark.parametrize("unsigned_from", UnsignedFrom)
@pytest.mark.parametrize("reach", [Reach.CABLE, Reach.MACHINE, Reach.NETWORK])
def test_the_next_key_comes_from_the_holder_of_the_old_one(reach: Reach, unsigned_from: UnsignedFrom) -> None:
    for sign, holder in ((bytes, False), (signer(OTHER_KEY, 1 << 46), False), (signer(KEY, 1 << 46), True)):
        keys = Keys(reach, key=KEY, unsigned_from=unsigned_from)
        keys.bring(OTHER_KEY.secret, sign)
        trusted = reach is Reach.CABLE or (
            reach is Reach.MACHINE and unsigned_from in (UnsignedFrom.LOCAL, UnsignedFrom.ALL)
        )
        trusted = trusted and unsigned_from is not UnsignedFrom.NONE
        assert keys.key == (OTHER_KEY if holder or trusted else KEY)


def test_a_key_for_another_vehicle_is_not_taken() -> None:
    keys = Keys(Reach.MACHINE)
    keys.bring(KEY.secret, target=2)
    assert keys.key is None and keys.texts == [] and keys.elsewhere == []


@pytest.mark.parametrize(("removable", "left"), [(True, None), (False, KEY)])
def test_zeros_switch_signing_off_where_that_is_allowed(removable: bool, left: SigningKey | None) -> None:
    keys = Keys(Reach.NETWORK, key=KEY, removable=removable)
    keys.bring(NOTHING)
    assert keys.key == KEY
    keys.bring(NOTHING, signer(KEY, 1 << 46))
    assert keys.key == left


def test_no_key_is_taken_while_armed() -> None:
    flying = Flying()
    flying.take_off(5.0)
    link = flying.sitl.connect(0, reach=Reach.MACHINE)
    setup = dialect.MAVLink_setup_signing_message(1, 1, list(KEY.secret), 0)
    link.send(FrameEncoder(255, 190).encode(setup))
    assert flying.vehicle.links.signing.state.key is None


def test_keys_are_in_no_log(tmp_path: Path) -> None:
    keys = Keys(Reach.MACHINE)
    with TlogWriter(tmp_path / "log.tlog") as log:
        keys.sitl.record(log)
        keys.bring(KEY.secret)
        while keys.sitl.time_us < 2_000_000:
            keys.sitl.advance()
    assert keys.key == KEY
    assert KEY.secret not in (tmp_path / "log.tlog").read_bytes()
    assert sum(1 for _ in TlogReader(tmp_path / "log.tlog")) > 100


# over a restart


def test_a_store_keeps_key_and_time(tmp_path: Path) -> None:
    path = tmp_path / "keys"
    first = Keys(Reach.MACHINE, store=SigningStore(path))
    first.bring(KEY.secret)
    state = first.sitl.vehicles[0].links.signing.state
    late = state.timestamp + 500 * MINUTE
    first.link.send(
        signer(KEY, late)(first.encoder.encode(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3)))
    )
    while first.sitl.time_us < 2_000_000:  # it speaks, with later times than any clock's
        first.sitl.advance()
    assert path.stat().st_mode & 0o077 == 0
    again = Keys(Reach.MACHINE, store=SigningStore(path)).sitl.vehicles[0].links.signing.state
    assert again.key == KEY and again.timestamp > state.timestamp


@pytest.mark.parametrize("content", ["nonsense", "1 2 xyz\n", "1 5 " + "00" * 32 + "\n", "1 2 3 4 5\n"])
def test_a_store_that_is_none_is_reported(tmp_path: Path, content: str) -> None:
    path = tmp_path / "keys"
    path.write_text(content)
    with pytest.raises(ValueError, match="is not a store of signing keys"):
        SigningStore(path)


def test_a_store_that_can_not_be_written_is_reported_when_it_is_opened(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"can't write .*keys: No such file or directory"):
        SigningStore(tmp_path / "nowhere" / "keys")
    SigningStore(tmp_path / "keys")
    assert list(tmp_path.iterdir()) == []  # trying leaves nothing


def test_a_store_that_can_not_be_written_any_more_is_reported_and_the_key_works(tmp_path: Path) -> None:
    folder, reported = tmp_path / "stored", []
    folder.mkdir()
    store = SigningStore(folder / "keys", reported.append)
    keys = Keys(Reach.MACHINE, store=store)
    folder.rmdir()
    keys.bring(KEY.secret)
    keys.bring(OTHER_KEY.secret, signer(KEY, 1 << 46))
    assert keys.key == OTHER_KEY
    assert keys.texts == ["Signing key set, but can't be stored"] * 2
    assert reported == [store.failure] and "No such file or directory" in store.failure
    folder.mkdir()
    keys.bring(KEY.secret, signer(OTHER_KEY, 1 << 47))
    assert keys.texts[2:] == ["Signing key set"] and not store.failure
    stored = SigningStore(folder / "keys").load(1)
    assert stored is not None and stored[1] == KEY
    assert [path.name for path in folder.iterdir()] == ["keys"]
