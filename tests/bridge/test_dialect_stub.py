"""`dialect.pyi` has the types of the installed dialect, and the type checker uses them."""

import re
import subprocess
import sys
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import pytest

from autopilot_bridge.mavlink import DEFINITIONS, dialect
from autopilot_bridge.mavlink.dialect_stub import STUB, stub

ROOT = Path(__file__).parents[2]


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


@pytest.mark.skipif(find_spec("mypy") is None, reason="mypy is not installed; it comes with the [test] extra")
def test_a_message_has_the_fields_of_its_class_only(tmp_path: Path) -> None:
    source = tmp_path / "reader.py"
    source.write_text(
        "from autopilot_bridge.mavlink import MAVLinkMessage, dialect\n"
        "def known(message: dialect.MAVLink_global_position_int_message) -> int:\n"
        "    return message.lat\n"
        "def misspelled(message: dialect.MAVLink_global_position_int_message) -> int:\n"
        "    return message.latt\n"
        "def any_message(message: MAVLinkMessage) -> int:\n"
        "    return message.lat\n"
        "def narrowed(message: MAVLinkMessage) -> int:\n"
        "    return message.lat if isinstance(message, dialect.MAVLink_gps_raw_int_message) else 0\n"
        "from estimators import wire\n"
        "def of_a_log(message: wire.GLOBAL_POSITION_INT) -> int:\n"
        "    return message.latt if message.lat else message.src_system\n"
    )
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--no-error-summary", str(source)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    unknown = [line for line in done.stdout.splitlines() if line.endswith("[attr-defined]")]
    assert [line.split(": error: ")[0].rsplit(":", 1)[1] for line in unknown] == ["5", "7", "12"]
    assert 'has no attribute "latt"' in unknown[0]
