"""Direct packing gives pymavlink's payload bytes, and saturates instead of failing."""

import math

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mavlink.definitions import DEFINITIONS, definition
from autopilot_bridge.telemetry.packing import values_packer


def sample_values(message_id: int) -> tuple[object, ...]:
    """One value per field in definition order, all different."""
    item = definition(message_id)
    by_name = {field.name: field for field in item.wire_fields}
    values: list[object] = []
    for index, name in enumerate(item.field_names):
        field = by_name[name]
        if field.code == "s":
            values.append(b"ab"[: field.length or 1])
        elif field.length:
            values.append([index + k + 1 for k in range(field.length)])
        else:
            values.append(index + 1.5 if field.code in "fd" else index + 1)
    return tuple(values)


@pytest.mark.parametrize("message_id", sorted(DEFINITIONS), ids=lambda i: DEFINITIONS[i].name)
def test_payload_equals_pymavlinks(message_id: int) -> None:
    item = definition(message_id)
    values = sample_values(message_id)
    payload = values_packer(item)(values)
    sender = mavlink.MAVLink(None, 1, 1)
    frame = item.message_class(*values).pack(sender)
    assert payload.rstrip(b"\0") == bytes(frame[10:-2]).rstrip(b"\0")


def test_integers_saturate_and_nan_becomes_zero() -> None:
    pack = values_packer(definition("GLOBAL_POSITION_INT"))
    payload = pack((1, 2, 3, 4, 5, 40_000, -40_000, math.nan, 36_000))
    message = mavlink.MAVLink_global_position_int_message
    assert message.unpacker.unpack(payload) == (1, 2, 3, 4, 5, 32767, -32768, 0, 36_000)


def test_floats_saturate_at_single_precision() -> None:
    payload = values_packer(definition("ATTITUDE"))((1, 1e300, -1e300, 0.0, 0.0, 0.0, 0.0))
    values = mavlink.MAVLink_attitude_message.unpacker.unpack(payload)
    assert values[1] == pytest.approx(3.4028235e38)
    assert values[2] == pytest.approx(-3.4028235e38)
