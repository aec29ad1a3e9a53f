"""`flightstack report`: results of a flight whose program was killed, from the log that is left."""

import json
import os

import pytest

from missions.cli.main import run_command_line

OLD = (1_700_000_000, 1_700_000_000)


@pytest.fixture
def killed(scripted, tmp_path):
    """The run folder of a flight that was killed: a torn log, and nothing else."""
    folder = tmp_path / "run"
    assert run_command_line(["fly", "sector", "--size", "30", "--out", str(folder)]) == 0
    log = folder / "flight.tlog"
    log.write_bytes(log.read_bytes()[: round(0.7 * log.stat().st_size) - 5])
    os.utime(log, OLD)
    whole = json.loads((folder / "summary.json").read_text())
    for name in ("summary.json", "track.png"):
        (folder / name).unlink()
    return folder, whole


def test_the_folder_of_a_killed_flight_is_completed_and_never_overwritten(killed, capsys):
    folder, whole = killed
    log = (folder / "flight.tlog").read_bytes()
    assert run_command_line(["report", str(folder)]) == 0
    printed = capsys.readouterr().out
    assert "the log ends in mode Mission" in printed and "summary.json, track.png" in printed
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["outcome"] == "interrupted" and summary["autopilot"] == "px4"
    assert 0.3 * whole["distance_m"] < summary["distance_m"] < whole["distance_m"]
    assert summary["vehicles"][0]["error_reference"] == "truth"
    picture = (folder / "track.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert (folder / "report.html").stat().st_size > 1_000_000
    assert run_command_line(["report", str(folder)]) == 0  # only the page is made anew
    assert capsys.readouterr().out == f"written: {folder / 'report.html'}\n"
    assert (folder / "flight.tlog").read_bytes() == log and (folder / "track.png").read_bytes() == picture


def test_a_summary_without_a_picture_is_kept(killed):
    folder, _ = killed
    (folder / "summary.json").write_text("{}")
    assert run_command_line(["report", str(folder)]) == 0
    assert (folder / "summary.json").read_text() == "{}" and (folder / "track.png").exists()


def test_a_log_gets_a_folder_of_its_own(killed, tmp_path, capsys):
    folder, _ = killed
    out = tmp_path / "of the log"
    assert run_command_line(["report", str(folder / "flight.tlog"), "--out", str(out), "--no-picture"]) == 0
    assert sorted(file.name for file in out.iterdir()) == ["summary.json"]
    assert run_command_line(["report", str(folder / "flight.tlog"), "--out", str(out)]) == 2
    assert "is not empty, and nothing is overwritten" in capsys.readouterr().err


def test_a_run_that_may_be_going_on_is_left_alone(killed, capsys):
    folder, _ = killed
    os.utime(folder / "flight.tlog")
    assert run_command_line(["report", str(folder)]) == 1
    assert "its run may be going on" in capsys.readouterr().err
    assert not (folder / "summary.json").exists()


def test_what_has_no_flight_in_it_is_named(tmp_path, capsys):
    for name, words in (("nothing.tlog", "does not exist"), ("text.tlog", "no valid MAVLink frame")):
        path = tmp_path / name
        if name == "text.tlog":
            path.write_text("no log\n" * 50)
        assert run_command_line(["report", str(path)]) in (1, 2)
        reported = capsys.readouterr().err
        assert words in reported and reported.count("\n") == 1
    assert not (tmp_path / "runs").exists()
