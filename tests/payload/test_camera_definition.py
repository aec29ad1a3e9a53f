"""The camera's definition file over its own MAVLink FTP, and its settings by extended parameters."""

import struct
from xml.etree import ElementTree

import pytest

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.payload import CAMERA_COMPONENT
from flightsim.payload import Camera
from tests.payload.test_components import SYSTEM, World

HEADER = struct.Struct("<HBBBBBxI")
OPEN, READ, ACK, NAK = 4, 5, 128, 129
ACCEPTED = dialect.MAV_RESULT_ACCEPTED


@pytest.fixture
def world() -> World:
    return World()


class Ftp:
    """A client of the component's files."""

    def __init__(self, world: World) -> None:
        self.world, self.sequence = world, 0

    def ask(
        self, opcode: int, data: bytes = b"", *, session: int = 0, offset: int = 0, size: int | None = None
    ):
        self.sequence += 1
        length = len(data) if size is None else size
        payload = HEADER.pack(self.sequence, session, opcode, length, 0, 0, offset) + data
        before = len(self.world.frames)
        self.world.deliver(
            dialect.MAVLink_file_transfer_protocol_message(
                0, SYSTEM, CAMERA_COMPONENT, payload.ljust(251, b"\0")
            )
        )
        self.world.run(0.1)
        replies = [f for f in self.world.frames[before:] if f.message_id == 110]
        assert len(replies) == 1
        reply = bytes(self.world.messages(110, CAMERA_COMPONENT)[-1].payload)
        _, session, opcode, size, *_ = HEADER.unpack_from(reply)
        return opcode, session, reply[HEADER.size : HEADER.size + size]


def definition(world: World) -> ElementTree.Element:
    uri = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_INFORMATION).cam_definition_uri
    assert uri == "mftp:///camera.xml"
    ftp, text = Ftp(world), b""
    opcode, session, size = ftp.ask(OPEN, uri.removeprefix("mftp://").encode())
    assert opcode == ACK
    while len(text) < int.from_bytes(size, "little"):
        opcode, _, piece = ftp.ask(READ, session=session, offset=len(text), size=200)
        assert opcode == ACK
        text += piece
    return ElementTree.fromstring(text)


def settings(world: World) -> dict[str, int]:
    world.frames.clear()
    world.deliver(dialect.MAVLink_param_ext_request_list_message(SYSTEM, CAMERA_COMPONENT))
    world.run(0.1)
    values = world.messages(dialect.MAVLINK_MSG_ID_PARAM_EXT_VALUE, CAMERA_COMPONENT)
    assert [value.param_index for value in values] == list(range(values[0].param_count))
    return {value.param_id: number(value) for value in values}


def number(message) -> int:
    value = message.param_value
    value = value.encode("latin-1") if isinstance(value, str) else value
    return value[0] if value else 0


def set_to(world: World, name: bytes, value: int, kind: int = dialect.MAV_PARAM_EXT_TYPE_UINT8):
    world.deliver(
        dialect.MAVLink_param_ext_set_message(
            SYSTEM, CAMERA_COMPONENT, name, bytes((value,)).ljust(128, b"\0"), kind
        )
    )
    return world.messages(dialect.MAVLINK_MSG_ID_PARAM_EXT_ACK, CAMERA_COMPONENT)[-1]


def test_the_file_describes_the_settings_there_are(world):
    root = definition(world)
    assert root.tag == "mavlinkcamera" and root.find("definition").get("version") == "1"
    defaults = {item.get("name"): int(item.get("default")) for item in root.iter("parameter")}
    assert defaults == settings(world)
    for item in root.iter("parameter"):
        assert item.get("type") == "uint8"
        assert item.get("default") in [option.get("value") for option in item.iter("option")]


def test_nothing_else_is_there(world):
    for name in (b"/../camera.xml", b"/etc/passwd", b"/"):
        assert Ftp(world).ask(OPEN, name)[0] == NAK


def test_settings_are_set_and_refused(world):
    ack = set_to(world, b"CAM_PHOTOQUAL", 75)
    assert (ack.param_result, number(ack)) == (dialect.PARAM_ACK_ACCEPTED, 75)
    assert settings(world)["CAM_PHOTOQUAL"] == 75
    for name, value, kind in (
        (b"CAM_PHOTOQUAL", 76, dialect.MAV_PARAM_EXT_TYPE_UINT8),
        (b"CAM_PHOTOQUAL", 98, dialect.MAV_PARAM_EXT_TYPE_REAL32),
        (b"NO_SUCH", 1, dialect.MAV_PARAM_EXT_TYPE_UINT8),
    ):
        assert set_to(world, name, value, kind).param_result == dialect.PARAM_ACK_VALUE_UNSUPPORTED
    assert settings(world)["CAM_PHOTOQUAL"] == 75
    assert set_to(world, b"CAM_AUTOFOCUS", 0).param_result == dialect.PARAM_ACK_ACCEPTED
    assert world.payload.get(Camera).focus_distance_m is not None


def test_mode_is_one_thing_by_command_and_by_setting(world):
    assert set_to(world, b"CAM_MODE", dialect.CAMERA_MODE_VIDEO).param_result == dialect.PARAM_ACK_ACCEPTED
    assert (
        world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_SETTINGS).mode_id
        == dialect.CAMERA_MODE_VIDEO
    )
    world.frames.clear()
    assert (
        world.command(CAMERA_COMPONENT, dialect.MAV_CMD_SET_CAMERA_MODE, 0, dialect.CAMERA_MODE_IMAGE)
        == ACCEPTED
    )
    reported = world.messages(dialect.MAVLINK_MSG_ID_PARAM_EXT_VALUE, CAMERA_COMPONENT)
    assert [(value.param_id, number(value)) for value in reported] == [
        ("CAM_MODE", dialect.CAMERA_MODE_IMAGE)
    ]


def test_one_setting_by_name_or_number(world):
    read = dialect.MAVLink_param_ext_request_read_message
    world.deliver(read(SYSTEM, CAMERA_COMPONENT, b"CAM_AUTOFOCUS", -1))
    world.deliver(read(SYSTEM, CAMERA_COMPONENT, b"", 1))
    world.deliver(read(SYSTEM, CAMERA_COMPONENT, b"NO_SUCH", -1))
    world.deliver(read(SYSTEM, CAMERA_COMPONENT, b"", 99))
    reported = world.messages(dialect.MAVLINK_MSG_ID_PARAM_EXT_VALUE, CAMERA_COMPONENT)
    assert [value.param_id for value in reported] == ["CAM_AUTOFOCUS", "CAM_PHOTOQUAL"]
