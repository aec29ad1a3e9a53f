"""Parameter files of QGroundControl and MAVProxy."""

from pathlib import Path

import pytest

from autopilot_bridge.flavours.ardupilot_parameters import ARDUPILOT_PARAMETERS
from autopilot_bridge.flavours.px4_parameters import PX4_PARAMETERS
from autopilot_bridge.parameter_files import parse_parameters, read_parameter_file, write_parameter_file
from autopilot_bridge.parameters import ParameterError, ParameterStore

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
    assert parse_parameters(QGC, PX4_PARAMETERS) == {"COM_OF_LOSS_T": 1.5, "NAV_DLL_ACT": 2}
    assert parse_parameters(PARM, ARDUPILOT_PARAMETERS) == {
        "WPNAV_SPEED": 800.0,
        "FENCE_ENABLE": 1,
        "RTL_ALT": 2000,
        "STAT_RUNTIME": 12,
    }


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "\nMPC_XY_CRUISE fast\n",
            "f.parm, line 2: MPC_XY_CRUISE = fast: not a number; accepted is a number in 3..20",
        ),
        ("MPC_XY_CRUISE 90", "line 1: MPC_XY_CRUISE = 90: accepted is a number in 3..20 m/s"),
        ("MPC_XY_CRUSE 9", "line 1: no parameter 'MPC_XY_CRUSE'; did you mean MPC_XY_CRUISE"),
        ("NAV_DLL_ACT 1.5", "line 1: NAV_DLL_ACT = 1.5: accepted is a whole number in 0..6"),
        ("MPC_XY_CRUISE nan", "not finite"),
        ("MPC_XY_CRUISE 6\nMPC_XY_CRUISE 7", "line 2: MPC_XY_CRUISE was set in line 1 already"),
        ("MPC_XY_CRUISE 6 m/s", "line 1: 'MPC_XY_CRUISE 6 m/s' is not understood; accepted: 'NAME VALUE'"),
    ],
)
def test_errors_give_line_value_and_what_is_accepted(text: str, told: str) -> None:
    with pytest.raises(ParameterError) as caught:
        parse_parameters(text, PX4_PARAMETERS, source="f.parm")
    assert told in str(caught.value)


def test_a_whole_dump_of_a_real_vehicle_can_be_read() -> None:
    text = "1\t1\tUAVCAN_ENABLE\t0\t6\n" + QGC
    with pytest.raises(ParameterError, match="UAVCAN_ENABLE"):
        parse_parameters(text, PX4_PARAMETERS)
    assert len(parse_parameters(text, PX4_PARAMETERS, skip_unknown=True)) == 2


@pytest.mark.parametrize("name", ["all.params", "all.parm", "all.param"])
@pytest.mark.parametrize("table", [PX4_PARAMETERS, ARDUPILOT_PARAMETERS], ids=["px4", "ardupilot"])
def test_what_is_written_reads_back(tmp_path: Path, table: tuple, name: str) -> None:
    store = ParameterStore(table)
    write_parameter_file(tmp_path / name, store)
    assert read_parameter_file(tmp_path / name, table) == store.as_dict()


def test_changed_values_only(tmp_path: Path) -> None:
    file = tmp_path / "mine.parm"
    write_parameter_file(file, ParameterStore(PX4_PARAMETERS, {"MPC_XY_CRUISE": 7.3}), changed_only=True)
    assert file.read_text().split() == ["MPC_XY_CRUISE", "7.3"]


def test_unreadable_files(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"parameter file .*missing\.parm can't be read: No such file"):
        read_parameter_file(tmp_path / "missing.parm", PX4_PARAMETERS)
    (tmp_path / "binary.parm").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ParameterError, match="not UTF-8"):
        read_parameter_file(tmp_path / "binary.parm", PX4_PARAMETERS)
    with pytest.raises(ParameterError, match=r"suffix '\.txt'; accepted are \.params, \.parm, \.param"):
        write_parameter_file(tmp_path / "x.txt", ParameterStore(PX4_PARAMETERS))
