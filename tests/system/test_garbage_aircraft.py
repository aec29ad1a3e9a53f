"""Garbage into a flying aircraft and its payload: it flies on, and every byte is accounted for."""

import random

import numpy as np
import pytest

from autopilot_bridge.mavlink import DEFINITIONS, FrameEncoder, FrameParser, dialect
from autopilot_bridge.payload import CAMERA_COMPONENT, GIMBAL_COMPONENT, SURVEY_MAGNETOMETER_COMPONENT
from flightsim import truth as t
from flightsim.environment import Environment
from flightsim.payload import (
    CameraParameters,
    GimbalParameters,
    MagneticField,
    MagneticMap,
    PayloadParameters,
    SurveyMagnetometerParameters,
)
from flightsim.world_spec import HOMES
from tests.slow import slow_after
from tests.system.flying import Flying
from tests.system.hostile import commands, damaged, parameter_sets, random_bytes, valid_frames
from tests.system.test_garbage import COMMAND_INT, COMMAND_LONG, TERMINATING, check_accounts, feed, memory

RANDOM_BYTES = 2_000_000
DAMAGED_FRAMES = 100_000
COMPONENTS = (0, 1, CAMERA_COMPONENT, GIMBAL_COMPONENT, SURVEY_MAGNETOMETER_COMPONENT)
UNTARGETED = [
    number
    for number, item in DEFINITIONS.items()
    if "target_component" not in {field.name for field in item.wire_fields}
]
ALL_PAYLOAD = (CAMERA_COMPONENT, GIMBAL_COMPONENT, SURVEY_MAGNETOMETER_COMPONENT)
LINES = np.linspace(-500.0, 500.0, 11)
CARRIED = PayloadParameters(
    gimbal=GimbalParameters(), camera=CameraParameters(), magnetometer=SurveyMagnetometerParameters()
)


def circling(flavour: str) -> Flying:
    """An aircraft with all payloads, holding in wind."""
    field = MagneticMap(
        north_m=LINES,
        east_m=LINES,
        total_field_nt=np.full((11, 11), 48_000.0),
        height_m=80.0,
        home=HOMES[flavour],
    )
    flying = Flying(
        flavour,
        model="aerosonde",
        environment=Environment.from_wind(speed_m_s=4.0, from_deg=200.0, turbulence="none"),
        payload=CARRIED,
        magnetic_field=MagneticField(field),
    )
    flying.take_off(60.0)
    flying.sitl.poll_every(flying.sitl.step_us)
    flying.step(10.0)
    return flying


class Watch:
    """What must not change while garbage comes in: it circles in its mode at its height."""

    def __init__(self, flying: Flying) -> None:
        self.flying = flying
        self.mode = flying.mode
        self.position_m = np.array(flying.true_position_m)

    def check(self) -> None:
        position_m = np.array(self.flying.true_position_m)
        assert self.flying.armed
        assert self.flying.mode is self.mode
        assert abs(position_m[2] - self.position_m[2]) < 10.0
        assert np.linalg.norm(position_m[:2] - self.position_m[:2]) < 400.0
        assert np.isfinite(self.flying.vehicle.vehicle.truth).all()
        assert self.flying.vehicle.vehicle.truth[t.AIRSPEED_TRUE_M_S] > 18.0


@pytest.fixture(scope="module")
def damage() -> list[bytes]:
    third = DAMAGED_FRAMES // 3
    frames = valid_frames(2, third, target=1, components=COMPONENTS)
    frames += commands(3, third, target=1, without=(), components=COMPONENTS)
    names = ["FW_AIRSPD_TRIM", "FW_R_LIM", "AIRSPEED_CRUISE", "ROLL_LIMIT_DEG"]
    frames += parameter_sets(4, DAMAGED_FRAMES - 2 * third, names, target=1)
    return damaged(5, frames)


@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
@pytest.mark.slow
def test_random_bytes_and_damaged_frames(flavour: str, damage: list[bytes]) -> None:
    flying = circling(flavour)
    watch = Watch(flying)
    before = flying.autopilot.parameters.as_dict()
    noise = random_bytes(1, RANDOM_BYTES)
    pieces = [noise[start : start + 1000] for start in range(0, RANDOM_BYTES, 1000)]
    with memory(flying) as (channel, write):
        sent = feed(flying, channel, write, damage)
        watch.check()
        assert channel.counters.bad_crc > 50_000
        sent += feed(flying, channel, write, pieces)
        watch.check()
        check_accounts(channel, sent)
        assert channel.counters.frames < 15  # by chance
    assert flying.autopilot.parameters.as_dict() == before


@pytest.mark.slow
def test_garbage_on_the_payloads_own_line(damage: list[bytes]) -> None:
    """The components count it, and answer afterwards."""
    flying = circling("px4")
    watch, station = Watch(flying), flying.vehicle.station
    assert station is not None
    before = station.parser.counters.bytes_in
    sent = 0
    pieces = [*damage[:40_000], random_bytes(6, 500_000)]
    for start in range(0, len(pieces), 40):
        for piece in pieces[start : start + 40]:
            station.receive(piece)
            sent += len(piece)
        flying.sitl.advance()
    counters = station.parser.counters
    assert counters.bytes_in - before >= sent
    assert counters.bytes_in == counters.bytes_framed + counters.bytes_dropped + station.parser.pending_bytes
    assert counters.bad_crc > 20_000
    station.receive(bytes(300))  # what was left of a frame ends
    watch.check()
    assert answering(flying) == set(ALL_PAYLOAD)


def answering(flying: Flying) -> set[int]:
    """The payload components that answer a request, and send a heartbeat."""
    link, parser = flying.sitl.connect(0), FrameParser()
    for component in ALL_PAYLOAD:
        request = dialect.MAVLink_command_long_message(
            1, component, dialect.MAV_CMD_REQUEST_MESSAGE, 0, 0.0, *(0.0,) * 6
        )
        link.send(FrameEncoder(255, 190).encode(request))
    frames = []
    for _ in range(500):
        flying.sitl.advance()
        frames += [frame for _, data in link.receive() for frame in parser.feed(data)]
    heartbeats = {frame.component_id for frame in frames if frame.message_id == 0}
    acks = {frame.component_id for frame in frames if frame.message_id == 77}
    return heartbeats & acks & set(ALL_PAYLOAD)


@pytest.mark.parametrize("seed", slow_after(1, range(2)))
@pytest.mark.slow
def test_any_message_with_any_content_to_the_payload(seed: int) -> None:
    """Absurd messages and commands that are whole: the aircraft flies on, and the devices stay finite."""
    flying = circling("px4" if seed else "ardupilot")
    watch = Watch(flying)
    addressed = valid_frames(10 + seed, 8000, target=1, components=ALL_PAYLOAD, without=UNTARGETED)
    frames = addressed + commands(20 + seed, 8000, target=1, without=(), components=ALL_PAYLOAD)
    random.Random(seed).shuffle(frames)
    with memory(flying) as (channel, write):
        sent = feed(flying, channel, write, frames)
        check_accounts(channel, sent)
        assert channel.counters.frames == len(frames)
    watch.check()
    assert answering(flying) == set(ALL_PAYLOAD)


@pytest.mark.parametrize("seed", slow_after(1, range(4)))
@pytest.mark.parametrize("flavour", slow_after(1, ["px4", "ardupilot"]))
def test_any_message_with_any_content_to_the_aircraft(flavour: str, seed: int) -> None:
    """It may go anywhere and refuse anything, but nothing raises, and all actuator commands are numbers."""
    flying = circling(flavour)
    names = [item.name for item in flying.autopilot.parameters.definitions]
    frames = valid_frames(
        30 + seed, 1500, target=1, components=COMPONENTS, without=(COMMAND_LONG, COMMAND_INT)
    )
    frames += commands(40 + seed, 800, target=1, without=TERMINATING, components=COMPONENTS)
    frames += parameter_sets(50 + seed, 500, names, target=1)
    random.Random(seed).shuffle(frames)
    with memory(flying) as (channel, write):
        for start in range(0, len(frames), 4):
            for frame in frames[start : start + 4]:
                write(frame)
            flying.sitl.advance()
            assert (np.abs(flying.autopilot.actuators) <= 1.0).all()
        assert np.isfinite(flying.vehicle.vehicle.truth).all()
        check_accounts(channel, sum(map(len, frames)))
        assert channel.counters.frames == len(frames)
