"""The parameter protocol of both flavours.

Expected: docs/firmware/px4.md, section 11, and docs/firmware/ardupilot.md, section 4.
"""

import math
import struct
import zlib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware.ardupilot import services as ardupilot_services
from autopilot_bridge.firmware.ardupilot.copter.parameters import ARDUPILOT_PARAMETERS
from autopilot_bridge.firmware.px4 import services as px4_services
from autopilot_bridge.firmware.px4.copter.parameters import PX4_PARAMETERS
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.parameters.protocol import ParameterService
from autopilot_bridge.sitl import Sitl
from flightsim.world_spec import VehicleSpec, WorldSpec
from tests.services.dispatch import deliver


class Recorder:
    def __init__(self, name: str) -> None:
        self.name = name
        self.congested = False
        self.sent: list[Any] = []

    def send(self, message: Any, /) -> None:
        self.sent.append(message)

    def take(self) -> list[Any]:
        sent, self.sent = self.sent, []
        return sent


class Vehicle:
    def __init__(self, flavour: str) -> None:
        table, policy = {
            "px4": (PX4_PARAMETERS, px4_services.PARAMETER_POLICY),
            "ardupilot": (ARDUPILOT_PARAMETERS, ardupilot_services.PARAMETER_POLICY),
        }[flavour]
        self.asking = Recorder("asking")
        self.other = Recorder("other")
        self.channels = (self.asking, self.other)
        self.store = ParameterStore(table)
        self.listed_by: list[Any] = []
        self.service = ParameterService(self.store, policy, self, on_list=self.listed_by.append)
        self.time_us = 0

    def deliver(self, message: Any) -> list[Any]:
        assert deliver(message, Source(self.asking, 255, 190), self.time_us, self.service)
        return self.asking.take()

    def read(self, name: str = "", index: int = -1) -> list[Any]:
        return self.deliver(mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), index))

    def write(self, name: str, value: float, kind: int) -> list[Any]:
        return self.deliver(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, kind))

    def tick(self, times: int = 1) -> None:
        for _ in range(times):
            self.time_us += 20_000
            self.service.tick(self.time_us)


@pytest.fixture
def px4() -> Vehicle:
    return Vehicle("px4")


@pytest.fixture
def ardupilot() -> Vehicle:
    return Vehicle("ardupilot")


def as_float(value: int) -> float:
    return struct.unpack("<f", struct.pack("<i", value))[0]


def as_int(value: float) -> int:
    return struct.unpack("<i", struct.pack("<f", value))[0]


def test_px4_sends_integers_as_bit_patterns(px4: Vehicle) -> None:
    (reply,) = px4.read("COM_FLTMODE1")
    assert (reply.param_id, reply.param_type) == ("COM_FLTMODE1", mavlink.MAV_PARAM_TYPE_INT32)
    assert as_int(reply.param_value) == -1
    assert reply.param_index == px4.store.index_of("COM_FLTMODE1")
    assert reply.param_count == px4.store.count


def test_ardupilot_sends_integers_as_floats(ardupilot: Vehicle) -> None:
    (reply,) = ardupilot.read("ARMING_CHECK")
    assert (reply.param_value, reply.param_type, reply.param_index) == (1.0, 6, 65535)
    assert reply.param_count == ardupilot.store.count


def test_read_by_index(px4: Vehicle, ardupilot: Vehicle) -> None:
    for vehicle in (px4, ardupilot):
        for index in (0, 7, vehicle.store.count - 1):
            (reply,) = vehicle.read(index=index)
            assert (reply.param_index, reply.param_id) == (index, vehicle.store.by_index(index).name)


def test_unknown_names_and_indices_are_met_with_silence(px4: Vehicle, ardupilot: Vehicle) -> None:
    for vehicle in (px4, ardupilot):
        assert vehicle.read("NO_SUCH_NAME") == []
        assert vehicle.read(index=vehicle.store.count) == []
        assert vehicle.read(index=32767) == []
        assert vehicle.write("NO_SUCH_NAME", 1.0, 9) == []
    assert px4.read("com_of_loss_t") == []


def test_ardupilot_names_in_any_case_are_echoed_as_asked(ardupilot: Vehicle) -> None:
    (reply,) = ardupilot.read("wpnav_Speed")
    assert (reply.param_id, reply.param_value) == ("wpnav_Speed", 1000.0)


def test_px4_set_replies_and_announces_a_change(px4: Vehicle) -> None:
    replies = px4.write("COM_OF_LOSS_T", 3.0, mavlink.MAV_PARAM_TYPE_REAL32)
    assert [message.param_value for message in replies] == [3.0, 3.0]
    assert [message.param_value for message in px4.other.take()] == [3.0]
    assert [message.param_value for message in px4.write("COM_OF_LOSS_T", 3.0, 9)] == [3.0]
    assert px4.other.take() == []


def test_px4_set_of_an_integer(px4: Vehicle) -> None:
    replies = px4.write("NAV_DLL_ACT", as_float(2), mavlink.MAV_PARAM_TYPE_INT32)
    assert px4.store.get("NAV_DLL_ACT") == 2
    assert [as_int(message.param_value) for message in replies] == [2, 2]


@pytest.mark.parametrize(
    ("name", "value", "kind"),
    [
        ("COM_OF_LOSS_T", as_float(3), 6),
        ("NAV_DLL_ACT", 2.0, 9),
        ("COM_OF_LOSS_T", math.nan, 9),
        ("COM_OF_LOSS_T", math.inf, 9),
    ],
)
def test_px4_silently_refuses_wrong_types_and_nan(px4: Vehicle, name: str, value: float, kind: int) -> None:
    before = px4.store.as_dict()
    assert px4.write(name, value, kind) == []
    assert px4.other.take() == []
    assert px4.store.as_dict() == before
    px4.write("MPC_XY_CRUISE", 6.0, 9)
    px4.asking.take()
    px4.deliver(mavlink.MAVLink_param_request_list_message(1, 1))
    px4.tick(60)
    assert len(px4.asking.take()) == px4.store.count + 1


def test_out_of_range_values_are_stored_and_echoed(px4: Vehicle, ardupilot: Vehicle) -> None:
    assert px4.write("MPC_XY_CRUISE", 500.0, 9)[0].param_value == 500.0
    assert ardupilot.write("WPNAV_SPEED", 1e6, 9)[0].param_value == 1e6


def test_ardupilot_set_is_echoed_once_to_everybody(ardupilot: Vehicle) -> None:
    for _ in range(2):
        (reply,) = ardupilot.write("WPNAV_SPEED", 800.0, 9)
        assert (reply.param_id, reply.param_value, reply.param_index) == ("WPNAV_SPEED", 800.0, 65535)
        (received,) = ardupilot.other.take()
        assert received.param_value == 800.0


@pytest.mark.parametrize(
    ("value", "stored"), [(255.7, 255), (-255.7, -255), (3.995, 4), (1e9, 32767), (-1e9, -32768)]
)
def test_ardupilot_truncates_integers(ardupilot: Vehicle, value: float, stored: int) -> None:
    (reply,) = ardupilot.write("LAND_SPEED", value, 9)  # INT16; the type code requested is ignored
    assert (reply.param_value, reply.param_type) == (stored, mavlink.MAV_PARAM_TYPE_INT16)


def test_ardupilot_ignores_nan(ardupilot: Vehicle) -> None:
    assert ardupilot.write("WPNAV_SPEED", math.nan, 9) == []
    assert ardupilot.store.get("WPNAV_SPEED") == 1000.0


def test_px4_list_starts_with_the_hash(px4: Vehicle) -> None:
    px4.deliver(mavlink.MAVLink_param_request_list_message(1, 1))
    px4.tick()
    first = px4.asking.take()
    assert 1 < len(first) < px4.store.count  # not in one burst
    px4.tick(60)
    messages = first + px4.asking.take()
    head, rest = messages[0], messages[1:]
    assert (head.param_id, head.param_index, head.param_type) == ("_HASH_CHECK", 65535, 5)
    assert [message.param_index for message in rest] == list(range(px4.store.count))
    assert px4.other.take() == []
    (again,) = px4.read("_HASH_CHECK")
    assert as_int(again.param_value) == as_int(head.param_value)


def test_px4_hash_follows_the_values(px4: Vehicle) -> None:
    before = px4.service.hash_check
    px4.store.set("MPC_XY_CRUISE", 6.0)
    assert px4.service.hash_check != before
    px4.store.set("MPC_XY_CRUISE", 5.0)
    assert px4.service.hash_check == before


def test_px4_hash_is_the_crc_of_names_and_raw_values(px4: Vehicle) -> None:
    crc = 0
    for definition in px4.store.definitions:
        value = px4.store.get(definition.name)
        raw = struct.pack("<i", int(value)) if definition.is_integer else struct.pack("<f", value)
        crc = zlib.crc32(raw, zlib.crc32(definition.name.encode(), crc))
    assert px4.service.hash_check == crc


def test_px4_setting_the_hash_ends_the_list(px4: Vehicle) -> None:
    px4.deliver(mavlink.MAVLink_param_request_list_message(1, 1))
    px4.tick()
    px4.asking.take()
    assert px4.write("_HASH_CHECK", 0.0, 5) == []
    px4.tick(60)
    assert px4.asking.take() == []


def test_ardupilot_list_in_order_with_the_banner_hook(ardupilot: Vehicle) -> None:
    ardupilot.deliver(mavlink.MAVLink_param_request_list_message(1, 1))
    assert ardupilot.listed_by == [ardupilot.asking]
    ardupilot.tick(33)  # 0.65 s
    messages = ardupilot.asking.take()
    assert [message.param_index for message in messages] == list(range(ardupilot.store.count))
    assert messages[0].param_id == "FORMAT_VERSION"


def test_a_slow_channel_loses_nothing(px4: Vehicle) -> None:
    px4.deliver(mavlink.MAVLink_param_request_list_message(1, 1))
    for tick in range(400):
        px4.asking.congested = tick % 4 != 0
        px4.tick()
    assert len(px4.asking.take()) == px4.store.count + 1


def test_changes_by_the_vehicle_are_announced(px4: Vehicle, ardupilot: Vehicle) -> None:
    for vehicle, name in ((px4, "MPC_THR_HOVER"), (ardupilot, "MOT_THST_HOVER")):
        vehicle.store.set(name, 0.4)
        for channel in vehicle.channels:
            (message,) = channel.take()
            assert (message.param_id, message.param_value) == (name, pytest.approx(0.4))


def test_other_messages_are_not_taken(px4: Vehicle) -> None:
    heartbeat = mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 3, 3)
    assert not deliver(heartbeat, Source(px4.asking, 255, 190), 0, px4.service)


def test_address_rules() -> None:
    def to(system: int, component: int) -> Any:
        return mavlink.MAVLink_param_request_list_message(system, component)

    px4, ardupilot = px4_services.address_rule(1), ardupilot_services.address_rule(1)
    for system, component in ((1, 1), (1, 0), (1, 190)):
        assert px4.accepts(to(system, component))
    for system, component in ((2, 1), (0, 1), (0, 0), (1, 191)):
        assert not px4.accepts(to(system, component))
    for system, component in ((1, 1), (1, 0), (1, 191), (0, 0), (0, 7)):
        assert ardupilot.accepts(to(system, component))
    assert not ardupilot.accepts(to(2, 1))
    assert px4.accepts(mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 3, 3))


@given(
    flavour=st.sampled_from(["px4", "ardupilot"]),
    messages=st.lists(
        st.one_of(
            st.builds(
                mavlink.MAVLink_param_set_message,
                st.integers(0, 255),
                st.integers(0, 255),
                st.one_of(
                    st.binary(max_size=16), st.sampled_from([b"NAV_DLL_ACT", b"LAND_SPEED", b"RTL_ALT"])
                ),
                st.floats(width=32),
                st.integers(0, 255),
            ),
            st.builds(
                mavlink.MAVLink_param_request_read_message,
                st.integers(0, 255),
                st.integers(0, 255),
                st.binary(max_size=16),
                st.integers(-(2**15), 2**15 - 1),
            ),
            st.builds(mavlink.MAVLink_param_request_list_message, st.integers(0, 255), st.integers(0, 255)),
        ),
        max_size=12,
    ),
)
def test_whatever_arrives_nothing_raises(flavour: str, messages: list[Any]) -> None:
    vehicle = Vehicle(flavour)
    for message in messages:
        vehicle.deliver(message)
        vehicle.tick()
    packer = mavlink.MAVLink(None, 1, 1)
    for message in vehicle.other.take():
        message.pack(packer)
    assert all(math.isfinite(value) for value in vehicle.store.as_dict().values())


@pytest.mark.parametrize(
    ("flavour", "name", "given"),
    [("px4", "MAV_SYS_ID", 3), ("px4", "MAV_COMP_ID", 1), ("ardupilot", "SYSID_THISMAV", 3)],
)
def test_the_ids_of_a_vehicle_are_reported_and_stay(flavour: str, name: str, given: int) -> None:
    """A change is answered with the value that is kept, and a text."""
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(autopilot=flavour, system_id=3, parameters={name: 9.0}),)))
    link, parser = sitl.connect(0), FrameParser()

    def received(message: Any, seconds: float) -> list[Any]:
        link.send(FrameEncoder(255, 190).encode(message))
        until_us = sitl.time_us + round(seconds * 1e6)
        while sitl.time_us < until_us:
            sitl.advance()
        return [decode(frame) for _, data in link.receive() for frame in parser.feed(data)]

    received(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3), 3.0)
    wanted = struct.unpack("<f", struct.pack("<i", 7))[0] if flavour == "px4" else 7.0
    kind = 6 if flavour == "px4" else 4
    messages = received(mavlink.MAVLink_param_set_message(3, 1, name.encode(), wanted, kind), 0.5)
    (value,) = [m.param_value for m in messages if m.get_type() == "PARAM_VALUE" and m.param_id == name]
    assert (struct.unpack("<i", struct.pack("<f", value))[0] if flavour == "px4" else value) == given
    texts = "".join(m.text for m in messages if m.get_type() == "STATUSTEXT")
    assert f"{name} stays {given}" in texts
    assert sitl.vehicles[0].autopilot.parameters.get(name) == given
