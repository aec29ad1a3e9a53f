"""Field values by name are packed as the message class packs them."""

import pytest

from autopilot_bridge.mavlink.definitions import definition
from autopilot_bridge.telemetry.fields import fields
from autopilot_bridge.telemetry.packing import values_packer


@pytest.mark.parametrize("name", ["BATTERY_STATUS", "AUTOPILOT_VERSION", "GPS_RAW_INT", "STATUSTEXT"])
def test_what_is_not_named_is_zero(name: str) -> None:
    described = definition(name)
    values = fields(name)()
    assert values._fields == tuple(described.field_names)  # type: ignore[attr-defined]
    assert values_packer(described)(values) == bytes(described.size)


def test_values_have_the_order_of_the_definition() -> None:
    values = fields("GPS_RAW_INT")(lat=3, fix_type=2, time_usec=1)
    assert values[:4] == (1, 2, 3, 0)
    assert values._replace(lat=5).lat == 5  # type: ignore[attr-defined]


def test_a_field_that_the_message_does_not_have_is_refused() -> None:
    with pytest.raises(TypeError, match="fix_typ"):
        fields("GPS_RAW_INT")(fix_typ=3)
