"""`flightstack replay` as a user runs it: tables, folders, exit codes, bad input."""

import errno
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameEncoder, dialect
from autopilot_bridge.tlog import TlogWriter
from estimators.names import ESTIMATORS
from missions.cli.main import run_command_line
from tests.recorded_logs import recorded_log

LEVEL = str(Path(__file__).parents[2] / "estimators" / "level.py")
FILES = {"summary.json", "estimates.npz", "estimates.csv", "errors.png"}


def write_log(path, rate_hz=20, seconds=10, system=1):
    """A log of an attitude that the estimator follows with a lag, and of its truth."""
    encoder, truth = FrameEncoder(system, 1), FrameEncoder(system, 25)
    with TlogWriter(path) as log:
        for k in range(rate_hz * seconds):
            ms = 1000 + k * 1000 // rate_hz
            roll = 0.001 * k
            log.write(
                10**15 + ms * 1000,
                encoder.encode(dialect.MAVLink_attitude_message(ms, roll, 0.1, 0, 0, 0, 0)),
            )
            q = [np.cos(roll / 2), np.sin(roll / 2), 0, 0]
            message = dialect.MAVLink_hil_state_quaternion_message(ms * 1000, q, *[0] * 14)
            log.write(10**15 + ms * 1000, truth.encode(message))
    return path


def replay(*arguments):
    return run_command_line(["replay", *map(str, arguments)])


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text())


def test_one_log_one_folder(tmp_path, capfd):
    log = write_log(tmp_path / "flight.tlog")
    out = tmp_path / "out"
    assert replay(log, "--estimator", LEVEL, "--set", "weight=0.5", "--out", out) == 0
    assert {path.name for path in out.iterdir()} == FILES
    summary = summary_of(out)
    assert summary["outcome"] == "completed"
    assert not summary["partial"]
    assert summary["reference"] == "autopilot"
    assert summary["parameters"]["weight"] == 0.5
    # an exponential average of a ramp lags behind by (1 - w)/w steps, in the end
    assert summary["roll_max_deg"] == pytest.approx(np.degrees(0.001), rel=1e-3)
    assert summary["roll_mse_deg2"] == pytest.approx(summary["roll_rms_deg"] ** 2)
    assert summary["against"]["truth"]["pitch_mean_deg"] == pytest.approx(np.degrees(0.1), rel=1e-5)
    arrays = np.load(out / "estimates.npz")
    assert len(arrays["time_us"]) == summary["samples"] == 200
    lines = (out / "estimates.csv").read_text().splitlines()
    assert lines[0] == "time_s,boot,subject,roll_rad,pitch_rad"
    assert len(lines) == 201
    reported = capfd.readouterr()
    assert "mean squared" in reported.out
    assert "flight.tlog  vehicle 1  truth" in reported.out
    assert reported.err == ""


@pytest.mark.parametrize("against", ["autopilot", "truth"])
@pytest.mark.sampled(1)
def test_against_one_of_them(tmp_path, against):
    log = write_log(tmp_path / "flight.tlog")
    assert replay(log, "--estimator", LEVEL, "--against", against, "--out", tmp_path / "out") == 0
    summary = summary_of(tmp_path / "out")
    assert summary["reference"] == against
    assert list(summary["against"]) == [against]


def test_several_logs_have_one_table_and_a_folder_each(tmp_path, capfd):
    (tmp_path / "b").mkdir()
    logs = [write_log(tmp_path / name) for name in ("one.tlog", "two.tlog", "b/one.tlog")]
    out = tmp_path / "out"
    assert replay(*logs, "--estimator", LEVEL, "--out", out, "--no-picture") == 0
    assert {path.name for path in out.iterdir()} == {"one", "two", "one-2"}
    assert all({path.name for path in folder.iterdir()} == FILES - {"errors.png"} for folder in out.iterdir())
    assert capfd.readouterr().out.count("mean squared") == 1


def test_a_part_of_it(tmp_path):
    log = write_log(tmp_path / "flight.tlog")
    assert replay(log, "--estimator", LEVEL, "--from", 2, "--to", 3, "--out", tmp_path / "out") == 0
    assert summary_of(tmp_path / "out")["samples"] == 20  # the end itself is left out


def test_a_boot_is_chosen(tmp_path, capfd):
    log = write_log(tmp_path / "one.tlog")
    both = tmp_path / "both.tlog"
    both.write_bytes(log.read_bytes() * 2)
    assert (
        replay(both, "--estimator", LEVEL, "--from", 2, "--to", 3, "--boot", 1, "--out", tmp_path / "a") == 0
    )
    assert summary_of(tmp_path / "a")["samples"] == 20
    assert replay(both, "--estimator", LEVEL, "--from", 2, "--to", 3, "--out", tmp_path / "b") == 0
    assert summary_of(tmp_path / "b")["samples"] == 40
    assert replay(both, "--estimator", LEVEL, "--from", 50, "--out", tmp_path / "c") == 1
    assert "has nothing at that time; it has 1.0 to 10.9, 1.0 to 10.9 s" in capfd.readouterr().err


def test_what_is_not_compared_says_why_and_is_drawn(tmp_path, capfd):
    """A log without the reference of an own estimator's columns."""
    mine = tmp_path / "mine.py"
    text = Path(LEVEL).read_text().replace('("roll_rad", "pitch_rad")', '("lean_rad", "tilt_rad")', 1)
    mine.write_text(text)
    out = tmp_path / "out"
    assert replay(write_log(tmp_path / "flight.tlog"), "--estimator", mine, "--out", out) == 0
    summary = summary_of(out)
    assert summary["reference"] is None
    assert summary["not_compared"].startswith("no reference for its columns lean_rad, tilt_rad")
    assert "nothing is compared: no reference for its columns" in capfd.readouterr().out
    assert (out / "errors.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("against", "armed", "says"),
    [
        ("truth", True, "the log has nothing of the truth for roll_rad, pitch_rad"),
        ("both", False, "no estimate was made in the air: never armed"),
    ],
)
@pytest.mark.sampled(1)
def test_no_truth_and_never_in_the_air(tmp_path, against, armed, says):
    encoder = FrameEncoder(1, 1)
    path = tmp_path / "flight.tlog"
    with TlogWriter(path) as log:
        for k in range(200):
            ms = 1000 + k * 50
            messages = [dialect.MAVLink_attitude_message(ms, 0.1, 0.1, 0, 0, 0, 0)]
            if k % 20 == 0:
                messages.append(dialect.MAVLink_heartbeat_message(2, 12, 128 if armed else 0, 0, 4, 3))
            for message in messages:
                log.write(10**15 + ms * 1000, encoder.encode(message))
    assert replay(path, "--estimator", LEVEL, "--against", against, "--out", tmp_path / "out") == 0
    assert summary_of(tmp_path / "out")["not_compared"] == says
    assert (tmp_path / "out" / "errors.png").exists()


def test_what_is_lacking_is_reported_and_the_rest_goes_on(tmp_path, capfd):
    slow, good = write_log(tmp_path / "slow.tlog", rate_hz=2), write_log(tmp_path / "good.tlog")
    out = tmp_path / "out"
    assert replay(slow, good, "--estimator", LEVEL, "--out", out) == 1
    reported = capfd.readouterr()
    assert "slow.tlog: ATTITUDE at 2 Hz; needs 10 Hz or more for attitude" in reported.err
    assert "good.tlog: completed" in reported.out
    summary = summary_of(out / "slow")
    assert summary["partial"] and summary["outcome"] == "failed"
    assert summary["samples"] == 0
    assert summary["needs"][0]["met"] is False
    assert summary_of(out / "good")["outcome"] == "completed"


@pytest.mark.parametrize("content", [b"", b"not a log at all" * 100], ids=["empty", "junk"])
def test_files_that_are_no_logs(tmp_path, capfd, content):
    path = tmp_path / "bad.tlog"
    path.write_bytes(content)
    assert replay(path, "--estimator", LEVEL, "--out", tmp_path / "out") == 1
    reported = capfd.readouterr()
    assert "bad.tlog" in reported.err
    assert "Traceback" not in reported.err


@pytest.mark.parametrize(
    ("arguments", "reported"),
    [
        (["{folder}"], "is a directory; give the path of a log"),
        (["{folder}/none.tlog"], "does not exist; give the path of a log"),
        (["{log}", "--set", "weight=x"], "weight: 'x' is not a number"),
        (["{log}", "--set", "height=1"], "no parameter 'height'; there are: weight"),
        (["{log}", "--out", "{folder}"], "is not empty, and nothing is overwritten"),
        (["{log}", "--out", "{log}"], "is a file; choose a folder"),
        (["{log}", "--from", "5", "--to", "2"], "from 5 s to 2 s is no time"),
        (["{log}", "--from", "nan"], "--from nan is not possible; ask for 0 or more"),
        (["{log}", "--system-id", "0"], "--system-id 0 is not in 1..255"),
        (["{log}", "--against", "moon"], "'moon' is not one of"),
        (["{log}", "--dialect", "klingon"], "no MAVLink dialect 'klingon'"),
        ([], "Missing argument 'LOG...'"),
    ],
)
def test_wrong_use_names_value_and_what_is_accepted(tmp_path, capfd, arguments, reported):
    log = write_log(tmp_path / "flight.tlog")
    filled = [text.format(folder=tmp_path, log=log) for text in arguments]
    assert replay(*filled, "--estimator", LEVEL) == 2
    error = capfd.readouterr().err
    assert reported in error
    assert error.count("\n") == 1
    assert {path.name for path in tmp_path.iterdir()} == {"flight.tlog"}


def test_an_unknown_estimator(tmp_path, capfd):
    log = write_log(tmp_path / "flight.tlog")
    assert replay(log, "--estimator", "atitude") == 2
    assert f"there are {', '.join(ESTIMATORS)}" in capfd.readouterr().err


def test_a_vehicle_that_is_not_in_it(tmp_path, capfd):
    log = write_log(tmp_path / "flight.tlog", system=4)
    assert replay(log, "--estimator", LEVEL, "--system-id", 2, "--out", tmp_path / "out") == 1
    assert "there is no vehicle 2 in it; there are 4" in capfd.readouterr().err


def test_a_torn_log_gives_what_is_whole(tmp_path):
    log = write_log(tmp_path / "flight.tlog")
    log.write_bytes(log.read_bytes()[:-1500])
    assert replay(log, "--estimator", LEVEL, "--out", tmp_path / "out") == 0
    assert 150 < summary_of(tmp_path / "out")["samples"] < 200


@pytest.mark.slow
def test_two_vehicles_in_a_log_have_a_row_and_a_file_each(tmp_path, capfd):
    one, two = (write_log(tmp_path / f"{n}.tlog", system=n) for n in (1, 2))
    both = tmp_path / "both.tlog"
    both.write_bytes(one.read_bytes() + two.read_bytes())
    assert replay(both, "--estimator", LEVEL, "--out", tmp_path / "out") == 0
    assert {p.name for p in (tmp_path / "out").glob("*.csv")} == {"estimates-1.csv", "estimates-2.csv"}
    assert "vehicle 2  truth" in capfd.readouterr().out


def test_attitude_on_a_real_flight(tmp_path, monkeypatch, capfd):
    """The table of errors that the estimator is judged by, from a real firmware's log."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(recorded_log("px4_plane_mission.tlog"), "flight.tlog")
    assert replay("flight.tlog", "--estimator", "attitude", "--no-picture") == 0
    summary = summary_of(tmp_path / "runs" / "attitude-1")
    assert 290.0 < summary["airborne_s"] < 310.0
    for against in ("autopilot", "truth"):
        assert {"roll_mse_deg2", "pitch_mse_deg2", "roll_rms_deg", "pitch_max_deg"} <= set(
            summary["against"][against]
        )
    assert summary["counters"]["updated"] == summary["samples"]


def test_a_full_disk_is_reported_and_leaves_no_half_files(tmp_path, monkeypatch, capfd):
    def full(*_args, **_columns):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", full)
    log = write_log(tmp_path / "flight.tlog")
    out = tmp_path / "out"
    assert replay(log, "--estimator", LEVEL, "--out", out) == 1
    assert "No space left on device; check the disk; results in" in capfd.readouterr().err
    assert {path.name for path in out.iterdir()} == {"summary.json"}
    summary = summary_of(out)
    assert summary["outcome"] == "failed" and summary["partial"] and summary["samples"] == 200
