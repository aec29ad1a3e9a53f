"""`wire.pyi` has the classes of the messages as estimators read them."""

from importlib.metadata import version

import pytest

from autopilot_bridge.mavlink import DEFINITIONS, dialect_stub
from estimators import wire
from estimators.messages import Message, is_a, message_class
from estimators.wire_stub import STUB, stub


def test_stub_is_current() -> None:
    if f"pymavlink {version('pymavlink')}. " not in dialect_stub.STUB.read_text():
        pytest.skip("the stub of the dialect is of another pymavlink")
    assert STUB.read_text() == stub(), "write it again: python -m estimators.wire_stub"


def test_a_class_is_that_of_the_messages_that_are_read() -> None:
    assert wire.HEARTBEAT is message_class(DEFINITIONS[0])
    assert issubclass(wire.HEARTBEAT, Message)
    with pytest.raises(AttributeError):
        _ = wire.no_message  # type: ignore[attr-defined]


def test_a_message_of_another_dialect_is_known_by_its_name() -> None:
    other = message_class(
        DEFINITIONS[0].__class__(**{n: getattr(DEFINITIONS[0], n) for n in DEFINITIONS[0].__slots__})
    )
    message = other._make((1, 1, 0, 2, 3, 81, 4, 3))
    assert not isinstance(message, wire.HEARTBEAT)
    assert is_a(message, wire.HEARTBEAT)
    assert not is_a(message, wire.ATTITUDE)
