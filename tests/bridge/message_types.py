"""What the type checker must refuse of messages: it checks this module as all others (`test_static_checks`).

An error that is not reported is one here: `warn_unused_ignores` is set for this module, so that each ignored
line must have its error.
"""

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from estimators import wire


def field_of_its_class(message: dialect.MAVLink_global_position_int_message) -> int:
    return message.lat


def misspelled_field(message: dialect.MAVLink_global_position_int_message) -> int:
    return message.latt  # type: ignore[attr-defined]


def field_of_any_message(message: MAVLinkMessage) -> int:
    return message.lat  # type: ignore[attr-defined]


def field_of_a_narrowed_message(message: MAVLinkMessage) -> int:
    return message.lat if isinstance(message, dialect.MAVLink_gps_raw_int_message) else 0


def misspelled_field_of_a_log(message: wire.GLOBAL_POSITION_INT) -> int:
    return message.latt if message.lat else message.src_system  # type: ignore[attr-defined]
