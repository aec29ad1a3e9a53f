"""The benchmark that flies the missions under real and emulated autopilots: its cells and its table."""

import argparse

import pytest

from benchmarks.firmware_in_world import EMULATED, FILES, MISSIONS, cases, result, table
from missions.catalogue import NAMES


def row(**fields: object) -> dict[str, object]:
    return {
        **{"mission": "orbit", "vehicle": "plane", "firmware": "px4", "autopilot": "real", "seed": 0},
        **{"outcome": "completed", "reason": "", "path_rms_m": 1.0, "path_max_m": 2.0, "figures": ["a"]},
        "speedup": 3.0,
        **fields,
    }


def test_a_table_has_real_and_emulated_flights_of_a_cell_in_one_line() -> None:
    rows = [
        row(),
        row(autopilot=EMULATED, path_rms_m=None, speedup=40.0),
        row(seed=1, outcome="failed", reason="b"),
    ]
    assert table(rows).splitlines()[2] == (
        "| orbit | plane | px4 | 1.00 / 2.00 m <br> failed: b | a | 3.0, 3.0 |"
    )
    assert result([row(path_rms_m=None, figures=[])]) == "completed"


def test_cells_are_missions_that_exist_and_builds_that_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    assert set(MISSIONS) - set(FILES) <= set(NAMES)
    monkeypatch.setenv("FLIGHTSTACK_ARDUPLANE", "/bin/true")
    for name in ("FLIGHTSTACK_PX4", "FLIGHTSTACK_ARDUCOPTER"):
        monkeypatch.delenv(name, raising=False)
    chosen = argparse.Namespace(firmware=None, mission=["orbit", "vision-search"], vehicle=None)
    assert [(mission, vehicle, build.firmware) for mission, vehicle, build in cases(chosen)] == [
        ("orbit", "plane", "ardupilot")
    ]
    chosen.firmware = ["px4"]
    with pytest.raises(ValueError, match="set FLIGHTSTACK_PX4"):
        list(cases(chosen))
