"""`dialect.pyi` has the types of the installed dialect. That they are used: `message_types`."""

import re
from importlib.metadata import version

import pytest

from autopilot_bridge.mavlink import DEFINITIONS, dialect
from autopilot_bridge.mavlink.dialect_stub import STUB, stub


def test_stub_is_current() -> None:
    text = STUB.read_text()
    made_from = re.search(r"pymavlink (\S+)\. ", text)
    assert made_from is not None
    if made_from[1] != version("pymavlink"):
        pytest.skip(f"the stub is of pymavlink {made_from[1]}, and {version('pymavlink')} is installed")
    assert text == stub(), "write it again: python -m autopilot_bridge.mavlink.dialect_stub"


def test_every_message_is_in_the_dialect() -> None:
    for each in DEFINITIONS.values():
        assert getattr(dialect, f"MAVLink_{each.name.lower()}_message").id == each.message_id
