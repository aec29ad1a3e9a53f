"""`flightstack check`: logs and runs against limits and a golden run."""

import json
from pathlib import Path

import pytest
from junitparser import Failure, JUnitXml

from missions.cli.main import run_command_line
from missions.runs.limits import read_limits
from tests.estimators.logs.flight_log import write

SUMMARY = {"outcome": "completed", "reason": "", "path_rms_error_m": 0.3, "vehicles": [{"distance_m": 310.0}]}


def run_folder(path: Path, **figures: object) -> Path:
    path.mkdir()
    write(path / "flight.tlog")
    (path / "summary.json").write_text(json.dumps(SUMMARY | figures), encoding="utf-8")
    return path


def checked(folder: Path, limits: str, *arguments: str) -> int:
    file = folder / "limits.toml"
    file.write_text(limits, encoding="utf-8")
    return run_command_line(["check", *arguments, "--limits", str(file)])


PASSING = """
[[check]]
summary = "outcome"
equals = "completed"

[[check]]
summary = "vehicles.0.distance_m"
least = 300
most = 320

[[check]]
log = "boots.0.number"
equals = 0

[[check]]
message = "ATTITUDE"
field = "roll"
statistic = "last"
system_id = 2
least = -0.51
most = -0.49

[[check]]
message = "GPS_RAW_INT"
field = "vel"  # m/s
statistic = "mean"
equals = 15

[[check]]
name = "a GPS message each 100 ms"
message = "GPS_RAW_INT"
statistic = "rate_hz"
least = 4
"""


def test_all_checks_pass(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert checked(tmp_path, PASSING, str(run_folder(tmp_path / "run"))) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "passed  outcome: 'completed'"
    assert printed[4] == "passed  GPS_RAW_INT.vel mean: 15"
    assert printed[-1] == "6 passed, 0 failed"


FAILING = """
[[check]]
summary = "path_rms_error_m"
most = 0.2

[[check]]
summary = "path_max_error_m"
most = 5

[[check]]
message = "VFR_HUD"
field = "groundspeed"
most = 5

[[check]]
estimator = "attitude"
figure = "roll_rms_deg"
most = 1
"""


def test_failures_and_what_was_not_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report = tmp_path / "report.xml"
    assert checked(tmp_path, FAILING, str(run_folder(tmp_path / "run")), "--junit", str(report)) == 1
    (suite,) = JUnitXml.fromfile(str(report))
    assert (suite.tests, suite.failures, suite.name) == (4, 4, str(tmp_path / "run"))
    failures = [case.result[0] for case in suite]
    assert all(isinstance(failure, Failure) for failure in failures)
    assert failures[0].message == "more than 0.2"
    assert failures[1].message.startswith("not measured: no 'path_max_error_m' in summary.json")
    assert "has no VFR_HUD" in failures[2].message
    assert "roll_rms_deg" in failures[3].message
    assert "FAILED  path_rms_error_m: 0.3; more than 0.2" in capsys.readouterr().out


GOLDEN = """
[[check]]
summary = "path_rms_error_m"
within = 0.05

[[check]]
summary = "vehicles.0.distance_m"
within_share = 0.01

[[check]]
summary = "outcome"
within = 0
"""


@pytest.mark.parametrize(("error_m", "code"), [(0.34, 0), (0.36, 1)])
def test_against_a_golden_run(tmp_path: Path, error_m: float, code: int) -> None:
    golden = run_folder(tmp_path / "golden")
    run = run_folder(tmp_path / "run", path_rms_error_m=error_m)
    assert checked(tmp_path, GOLDEN, str(run), "--against", str(golden)) == code


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        ("x = 1", "limits.toml: x is unknown; accepted are check"),
        ("# nothing", "limits.toml: check is missing"),
        ("check = []", "limits.toml: it has no [[check]]"),
        ("x =", "limits.toml is not TOML: Invalid value"),
        ('[[check]]\nlog = "x"\nmost = "a"', "check[1].most: 'a' is not a number"),
        ('[[check]]\nlog = "x"', "give least, most, equals, within or within_share"),
        ("[[check]]\nmost = 1", "give one of summary, log, message, estimator and track"),
        ('[[check]]\nmessage = "ATTITUDE"\nmost = 1', "statistic largest needs a field"),
        ('[[check]]\nlog = "x"\nwithin = 1', "the check 'x' compares with another run; give --against"),
    ],
)
def test_wrong_limits_are_usage_errors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], limits: str, text: str
) -> None:
    log = write(tmp_path / "flight.tlog")
    assert checked(tmp_path, limits, str(log)) == 2
    assert text in capsys.readouterr().err


def test_a_log_alone_has_no_summary(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert checked(tmp_path, PASSING, str(write(tmp_path / "flight.tlog"))) == 1
    assert "is a log and has no summary; give a run folder" in capsys.readouterr().out
    assert checked(tmp_path, PASSING, str(tmp_path / "nothing")) == 2


def test_the_limits_of_the_page_are_accepted(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "reports.md").read_text(encoding="utf-8")
    (tmp_path / "limits.toml").write_text(page.split("```toml")[1].split("```")[0], encoding="utf-8")
    assert len(read_limits(tmp_path / "limits.toml").check) == 7
