"""Parameter files of QGroundControl and MAVProxy."""

from pathlib import Path

import pytest

from autopilot_bridge.firmware.ardupilot.copter.parameters import ARDUPILOT_PARAMETERS
from autopilot_bridge.firmware.px4.copter.parameters import PX4_PARAMETERS
from autopilot_bridge.parameter_files import (
    format_mavproxy,
    format_qgc,
    parse_untyped_parameters,
    read_untyped_parameter_file,
)
from autopilot_bridge.parameters import ParameterDefinition, ParameterError, ParameterStore
from autopilot_bridge.services.parameters.parameter_file import StoredParameters
from autopilot_bridge.storage.files import read_whole
from autopilot_bridge.storage.memory import MemoryCard
from tests.services.command_rig import ServiceRig

QGC = """# Onboard parameters for Vehicle 1
#
# Vehicle-Id Component-Id Name Value Type
1\t1\tCOM_OF_LOSS_T\t1.500000000000000000\t9
1\t1\tNAV_DLL_ACT\t2\t6
"""
PARM = """# a comment
WPNAV_SPEED      800.000000
FENCE_ENABLE,1   # Mission Planner writes commas
RTL_ALT=2000
STAT_RUNTIME 12 @READONLY

"""


def test_reads_both_formats() -> None:
    assert parse_untyped_parameters(QGC) == {"COM_OF_LOSS_T": 1.5, "NAV_DLL_ACT": 2}
    assert parse_untyped_parameters(PARM) == {
        "WPNAV_SPEED": 800.0,
        "FENCE_ENABLE": 1,
        "RTL_ALT": 2000,
        "STAT_RUNTIME": 12,
    }


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        ("\nMPC_XY_CRUISE fast\n", "f.parm, line 2: 'MPC_XY_CRUISE fast': accepted is a finite number"),
        ("MPC_XY_CRUISE nan", "line 1: 'MPC_XY_CRUISE nan': accepted is a finite number"),
        ("MPC_XY_CRUISE 6\nMPC_XY_CRUISE 7", "line 2: MPC_XY_CRUISE was set in line 1 already"),
        ("MPC_XY_CRUISE 6 m/s", "line 1: 'MPC_XY_CRUISE 6 m/s' is not understood; accepted: 'NAME VALUE'"),
        ("MPC_XY_CRUISE_SPEED 6", "line 1: name 'MPC_XY_CRUISE_SPEED'; accepted: up to 16 ASCII characters"),
    ],
)
def test_errors_give_line_value_and_what_is_accepted(text: str, reported: str) -> None:
    with pytest.raises(ParameterError) as caught:
        parse_untyped_parameters(text, source="f.parm")
    assert reported in str(caught.value)


@pytest.mark.parametrize("table", [PX4_PARAMETERS, ARDUPILOT_PARAMETERS], ids=["px4", "ardupilot"])
def test_what_is_written_reads_back(table: tuple[ParameterDefinition, ...]) -> None:
    values = ParameterStore(table).as_dict()
    for text in (format_mavproxy(values), format_qgc(values, table)):
        read = parse_untyped_parameters(text)
        assert {each.name: each.convert(read[each.name]) for each in table} == values


def test_qgc_files_need_types() -> None:
    with pytest.raises(ParameterError, match="no parameter 'UAVCAN_ENABLE'"):
        format_qgc({"UAVCAN_ENABLE": 0.0}, PX4_PARAMETERS)


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"parameter file .*missing\.parm can't be read: No such file"):
        read_untyped_parameter_file(tmp_path / "missing.parm")
    (tmp_path / "binary.parm").write_bytes(b"RATE 1\xff")
    with pytest.raises(ParameterError, match="not UTF-8"):
        read_untyped_parameter_file(tmp_path / "binary.parm")


@pytest.mark.parametrize(
    ("flavour", "name", "value", "line"),
    [
        ("px4", "COM_OF_LOSS_T", 2.5, "7\t1\tCOM_OF_LOSS_T\t2.5\t9"),
        ("ardupilot", "WPNAV_SPEED", 700.0, "WPNAV_SPEED      700.0"),
    ],
)
def test_each_firmware_stores_what_was_changed_in_its_own_format(
    flavour: str, name: str, value: float, line: str
) -> None:
    """PX4 in QGroundControl's, ArduPilot in MAVProxy's; values as at the start are not stored."""
    rig, card = ServiceRig(flavour), MemoryCard(logs=False)
    layout = rig.flavour.services.card
    stored = StoredParameters(rig.store, card.files, layout, system_id=7)
    rig.store.set(name, value)
    stored.save()
    text = read_whole(card.files, layout.parameters, at_most=1 << 30).decode()
    assert line in text.splitlines()
    assert parse_untyped_parameters(text) == {name: value}
    rig.store.set(name, rig.store.find(name).default)  # type: ignore[union-attr]
    stored.load()
    assert rig.store.get(name) == value
    stored.erase()
    stored.save()
    assert parse_untyped_parameters(read_whole(card.files, layout.parameters, at_most=1 << 30).decode()) == {}
