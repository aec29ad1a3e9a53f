"""Whole runs against scripted autopilots: folder, log, summary, picture, outcomes; and the command line."""

import errno
import json
import os
import re
import signal
import socket
import struct
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from pymavlink import mavutil

from autopilot_bridge.errors import BridgeError, TlogError
from autopilot_bridge.tlog import TlogReader, TlogWriter
from flightsim.foundation.user_options import user_options
from flightsim.world_spec import WorldSpec
from missions.base.given_text import parameters_from_file, parse_wind
from missions.base.mission import Mission
from missions.base.options import FlightOptions, Via
from missions.cli import fly as cli_fly
from missions.cli import main as cli
from missions.cli.options import DeclaredType
from missions.errors import MissionError, PlanError
from missions.flown.records import FlightRecords
from missions.flown.run_folder import create_run_folder
from missions.library import MISSIONS, find_mission
from missions.pattern_search.mission import PatternMission
from missions.runs import session
from missions.runs.session import RunRequest

REQUIRED = {
    "mission", "vehicle", "autopilot", "seed", "outcome", "sim_time_s", "wall_time_s", "speedup",
    "distance_m", "path_rms_error_m", "path_max_error_m", "max_attitude_error_deg", "message_counts",
    "versions",
}  # fmt: skip


def remarks(err):
    """What stderr has besides the progress in a pipe."""
    return [line for line in err.splitlines() if not re.match(r"starting |compiling |[0-9.]+ s: ", line)]


def small(**changes):
    return FlightOptions(**({"width_m": 40.0, "height_m": 30.0, "pattern": "L2"} | changes))


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize("via", list(Via))
@pytest.mark.parametrize("name", [n for n, m in MISSIONS.items() if isinstance(m, PatternMission)])
@pytest.mark.sampled(4)
def test_every_mission_on_both_firmwares_by_both_ways(scripted, tmp_path, name, via, flavour):
    request = RunRequest(
        options=small(via=via),
        world=WorldSpec.of_team(autopilot=flavour, seed=7),
        out=tmp_path / "run",
        picture=False,
    )
    result = session.fly(find_mission(name), request)
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert result.outcome == summary["outcome"] == "completed", result.reason
    assert set(summary) >= REQUIRED
    assert summary["autopilot"] == flavour
    assert summary["path_rms_error_m"] < (0.05 if via is Via.SETPOINTS else 1.0)
    assert summary["message_counts"]["HIL_STATE_QUATERNION"] > 1000
    vehicle = scripted[0].autopilots[0]
    assert not vehicle.armed
    assert abs(vehicle.pos[0]) < 1.0
    assert abs(vehicle.pos[1]) < 1.0
    if via is Via.WAYPOINTS:
        waypoints = summary["vehicles"][0]["waypoints"]
        assert waypoints["passed"] == waypoints["count"]
    phases = [phase["name"] for phase in summary["vehicles"][0]["phases"]]
    assert phases[-2:] == ["pattern", "return"]


def test_log_is_read_by_pymavlink_and_holds_both_directions_and_truth(scripted, tmp_path):
    session.fly("sector", RunRequest(options=small(), out=tmp_path / "run"))
    log = mavutil.mavlink_connection(str(tmp_path / "run" / "flight.tlog"))
    senders, first = set(), None
    while (message := log.recv_match()) is not None:
        assert message.get_type() != "BAD_DATA"
        first = first or message._timestamp
        senders.add((message.get_srcSystem(), message.get_srcComponent()))
    assert senders == {(1, 1), (1, 240), (255, 190)}
    assert first == pytest.approx(1_735_689_600.0, abs=1.0)
    counts = json.loads((tmp_path / "run" / "summary.json").read_text())["message_counts"]
    assert FlightRecords.from_tlog(tmp_path / "run" / "flight.tlog").message_counts == counts


def test_picture_is_a_png_of_some_size(scripted, tmp_path):
    session.fly("lissajous", RunRequest(options=small(vehicles=2), out=tmp_path / "run"))
    data = (tmp_path / "run" / "track.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", data[16:24])
    assert width > 1000
    assert height > 1000


def test_same_flight_same_log(scripted, tmp_path):
    for name in ("a", "b"):
        options = small(via=Via.SETPOINTS, vehicles=2)
        session.fly("lissajous", RunRequest(options=options, out=tmp_path / name, picture=False))
    logs = [(tmp_path / name / "flight.tlog").read_bytes() for name in ("a", "b")]
    assert logs[0] == logs[1]


@pytest.mark.parametrize("via", list(Via))
@pytest.mark.sampled(1)
def test_a_team_shares_the_pattern_in_layers(scripted, tmp_path, via):
    options = small(via=via, vehicles=2, pattern="L1")
    result = session.fly("lissajous", RunRequest(options=options, out=tmp_path / "run", picture=False))
    assert result.outcome == "completed", result.reason
    blocks = result.summary["vehicles"]
    assert [block["system_id"] for block in blocks] == [1, 2]
    records = FlightRecords.from_tlog(tmp_path / "run" / "flight.tlog")
    a, b = (records.table("HIL_STATE_QUATERNION", k) for k in (1, 2))
    times = [{p["name"]: p for p in block["phases"]}["pattern"] for block in blocks]
    start = max(p["start_s"] for p in times)
    end = min(p["end_s"] for p in times)
    both = (a["time_usec"] * 1e-6 > start + 2.0) & (a["time_usec"] * 1e-6 < end)
    assert (abs(a["alt"] - b["alt"])[both] > 3500).all()  # millimetres
    north = abs(a["lat"].astype(float) - b["lat"])[both] * 0.0111
    assert north.max() > 20.0  # on opposite sides of the circle
    centre = [(t["lat"][both].min() + t["lat"][both].max()) / 2 for t in (a, b)]
    assert abs(centre[0] - centre[1]) * 0.0111 < 1.5


@pytest.mark.slow
def test_search_time_ends_the_pattern(scripted, tmp_path):
    for via in Via:
        options = small(via=via, search_time_s=90.0)
        out = tmp_path / str(via)
        result = session.fly("lissajous", RunRequest(options=options, out=out, picture=False))
        assert result.outcome == "completed", result.reason
        phases = {p["name"]: p for p in result.summary["vehicles"][0]["phases"]}
        assert phases["pattern"]["end_s"] - phases["pattern"]["start_s"] == pytest.approx(90.0, abs=8.0)


def test_a_failing_mission_returns_the_vehicle_and_keeps_the_log(scripted, tmp_path):
    class Broken(Mission):
        name = "broken"

        async def fly(self, vehicle, options):
            await vehicle.takeoff(10.0)
            raise MissionError("the camera fell off")

    result = session.fly(Broken(), RunRequest(options=small(), out=tmp_path / "run"))
    assert (result.outcome, result.reason) == ("failed", "the camera fell off")
    assert scripted[0].autopilots[0].kind == "return"
    assert result.summary["outcome"] == "failed"
    assert (tmp_path / "run" / "flight.tlog").stat().st_size > 10_000


def test_an_interrupted_mission_returns_the_vehicle_and_keeps_the_log(scripted, tmp_path):
    sent = []

    def press(flight):
        if flight.clock.time_us > 30_000_000 and not sent:
            sent.append(True)
            os.kill(os.getpid(), signal.SIGINT)

    result = session.fly("lissajous", RunRequest(options=small(), out=tmp_path / "run"), press)
    assert result.outcome == "interrupted"
    assert scripted[0].autopilots[0].kind == "return"
    assert FlightRecords.from_tlog(tmp_path / "run" / "flight.tlog").message_counts["HEARTBEAT"] > 50
    assert (tmp_path / "run" / "track.png").exists()


def test_users_own_mission(scripted, tmp_path):
    script = tmp_path / "my_mission.py"
    script.write_text(
        "async def fly(vehicle, options):\n"
        "    await vehicle.takeoff(float(options.arguments['height']))\n"
        "    await vehicle.goto_ned(10.0, 0.0, -8.0)\n"
        "    await vehicle.return_to_launch()\n"
    )
    out = CliRunner().invoke(
        cli_fly.fly, [str(script), "--arg", "height=8", "--out", str(tmp_path / "run")], standalone_mode=False
    )
    assert out.exception is None, out.exception
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert (summary["mission"], summary["outcome"]) == ("my_mission", "completed")
    assert summary["path_rms_error_m"] is None
    assert summary["distance_m"] > 25.0


def reporting(tmp_path, report):
    script = tmp_path / "reports.py"
    script.write_text(
        "from missions import Report\n\n\n"
        "async def fly(vehicle, options):\n"
        "    await vehicle.clock.sleep(1.0)\n"
        f"    return {report}\n"
    )
    return script


def test_a_users_mission_returns_a_report(scripted, tmp_path, capsys):
    report = (
        "Report(figures={'walls_seen': 3, 'outcome': 'great'}, lines=['3 walls seen'], "
        "files={'walls.csv': b'3'}, title='walls', pictures=lambda: {'wall.png': b'png'})"
    )
    code, out, _err = command_line(
        capsys, "fly", str(reporting(tmp_path, report)), "--out", str(tmp_path / "run")
    )
    assert code == 0 and "3 walls seen" in out.splitlines()
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert (summary["walls_seen"], summary["outcome"]) == (3, "completed")
    assert {name.name for name in (tmp_path / "run").iterdir()} >= {"walls.csv", "wall.png", "track.png"}


@pytest.mark.parametrize(
    ("report", "code", "message"),
    [
        ("Report(verdict='2 walls were missed')", 1, "mission reports failed: 2 walls were missed"),
        ("Report(figures={'walls': {1, 2}})", 1, "the report's figures can't be written: Object of type set"),
        ("Report(pictures=lambda: 1 / 0)", 1, "the report's pictures failed: ZeroDivisionError"),
        ("Report(files={'flight.tlog': b''})", 1, "the report's file 'flight.tlog' can't be written"),
        ("True", 0, "the mission returned True, which is no Report, and is left out"),
    ],
)
def test_what_is_wrong_with_a_users_report_is_one_line(scripted, tmp_path, capsys, report, code, message):
    script = reporting(tmp_path, report)
    exit_code, _out, err = command_line(capsys, "fly", str(script), "--out", str(tmp_path / "run"))
    assert exit_code == code
    assert message in " ".join(err.split())
    assert "Traceback" not in err
    assert (tmp_path / "run" / "flight.tlog").stat().st_size > 1000


def test_reports_of_a_team_are_by_vehicle(scripted, tmp_path):
    script = reporting(
        tmp_path, "Report(figures={'walls': options.index}, lines=['seen'], files={'w.csv': b''})"
    )
    options = small(vehicles=2)
    result = session.fly(str(script), RunRequest(options=options, out=tmp_path / "run", picture=False))
    assert result.outcome == "completed"
    assert result.summary["reports"] == {"1": {"walls": 0}, "2": {"walls": 1}}
    assert list(result.report.lines) == ["vehicle 1: seen", "vehicle 2: seen"]
    assert (tmp_path / "run" / "1_w.csv").exists() and (tmp_path / "run" / "2_w.csv").exists()


def test_a_mistake_in_a_users_mission_is_one_line_and_the_vehicle_returns(scripted, tmp_path, capsys):
    script = tmp_path / "mine.py"
    script.write_text("async def fly(vehicle, options):\n    await vehicle.takeoff(8.0)\n    1 / 0\n")
    code, _out, err = command_line(capsys, "fly", str(script), "--out", str(tmp_path / "run"))
    assert code == 1
    reason, left = remarks(err)
    assert "mine.py, line 3: ZeroDivisionError: division by zero" in reason
    assert "vehicle 1: was commanded to return and does; it is in Return at " in left
    assert scripted[0].autopilots[0].kind == "return"


def test_run_folders_are_numbered_and_never_overwritten(tmp_path):
    assert create_run_folder(None, "x", tmp_path / "runs").name == "x-1"
    assert create_run_folder(None, "x", tmp_path / "runs").name == "x-2"
    given = tmp_path / "given"
    assert create_run_folder(given, "x") == given
    (given / "something").write_text("mine")
    with pytest.raises(PlanError, match="not empty"):
        create_run_folder(given, "x")


def test_a_refused_run_folder_opens_nothing(scripted, tmp_path):
    (tmp_path / "mine").write_text("x")
    with pytest.raises(PlanError, match="not empty"):
        session.fly("lissajous", RunRequest(options=small(), out=tmp_path))
    assert scripted == []


def test_the_folder_of_a_run_whose_link_cannot_be_opened_is_removed_again(tmp_path):
    out, mine = tmp_path / "some" / "run", tmp_path / "mine"
    mine.mkdir()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        connect = [f"udpin:127.0.0.1:{taken.getsockname()[1]}"]
        for folder in (out, mine):
            with pytest.raises(BridgeError):
                session.fly("lissajous", RunRequest(options=small(), connect=connect, out=folder))
    assert not out.parent.exists()
    assert mine.exists()


def test_where_no_log_can_be_made_nothing_is_opened(scripted, tmp_path, monkeypatch):
    def full(_path):
        raise TlogError("disk full")

    monkeypatch.setattr("missions.runs.claimed_folder.TlogWriter", full)
    with pytest.raises(TlogError, match="disk full"):
        session.fly("lissajous", RunRequest(options=small(), out=tmp_path / "run"))
    assert scripted == []
    assert list(tmp_path.iterdir()) == []


def test_a_run_that_fails_at_once_leaves_what_is_not_its_own(scripted, tmp_path):
    def open_badly():
        (tmp_path / "notes.txt").write_text("mine")
        raise PlanError("enough")

    request = RunRequest(options=small(), out=tmp_path, picture=False)
    with pytest.raises(PlanError, match="enough"):
        session.fly("lissajous", replace(request, on_open=open_badly))
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_folder_is_one_run_s_from_its_beginning(scripted, tmp_path, monkeypatch):
    request = RunRequest(options=small(), out=tmp_path, picture=False)
    refused = []

    def fly_another():
        monkeypatch.setattr(
            "missions.runs.claimed_folder.create_run_folder", lambda out, name: out
        )  # just empty
        with pytest.raises(PlanError, match=r"another run has begun in .*; choose another `out`") as error:
            session.fly("sector", request)
        refused.append(error)

    result = session.fly("lissajous", replace(request, on_open=fly_another))
    assert refused
    assert result.outcome == "completed", result.reason
    assert {path.name for path in tmp_path.iterdir()} == {"flight.scene", "flight.tlog", "summary.json"}


class FillingDisk(TlogWriter):
    """A log on a disk that has room for so many bytes."""

    room = 0

    def flush(self):
        if self.path.stat().st_size + len(self.unwritten) > self.room:
            raise TlogError(f"can't write {self.path}: No space left on device; check the disk")
        super().flush()


def test_a_disk_that_fills_up_in_flight_ends_the_log_and_not_the_flight(scripted, tmp_path, monkeypatch):
    monkeypatch.setattr("missions.runs.claimed_folder.TlogWriter", FillingDisk)
    monkeypatch.setattr(FillingDisk, "room", 100_000)
    result = session.fly("lissajous", RunRequest(options=small(), out=tmp_path / "run"))
    assert result.outcome == "failed"
    assert "No space left on device; check the disk; it was flown on without a log" in result.reason
    (vehicle,) = result.summary["vehicles"]
    assert vehicle["phases"][-1]["name"] == "return" and vehicle["waypoints"]["passed"] > 0
    assert not scripted[0].autopilots[0].armed
    assert len(list(TlogReader(tmp_path / "run" / "flight.tlog"))) > 1000


def test_nothing_is_flown_on_a_full_disk(scripted, tmp_path, monkeypatch):
    monkeypatch.setattr("missions.runs.claimed_folder.TlogWriter", FillingDisk)
    result = session.fly("lissajous", RunRequest(options=small(), out=tmp_path / "run"))
    assert result.outcome == "failed"
    assert "No space left on device; check the disk; nothing was flown" in result.reason
    assert all(phase["name"] != "takeoff" for phase in result.summary["vehicles"][0]["phases"])


def test_a_summary_that_finds_no_room_is_reported(scripted, tmp_path, monkeypatch):
    def full(folder, summary):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("missions.runs.session.write_summary", full)
    result = session.fly("lissajous", RunRequest(options=small(), out=tmp_path / "run"))
    assert result.outcome == "failed"
    assert "No space left on device; check the disk" in result.reason


def test_a_picture_that_finds_no_room_is_reported_in_the_summary_too(scripted, tmp_path, monkeypatch):
    def full(path, _title, _flights, _overlay):
        path.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("missions.flown.picture.draw_run", full)
    result = session.fly("lissajous", RunRequest(options=small(), out=tmp_path / "run"))
    assert result.outcome == "failed"
    assert "No space left on device; check the disk" in result.reason
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert (summary["outcome"], summary["reason"]) == (result.outcome, result.reason)
    assert summary == result.summary
    names = {path.name for path in (tmp_path / "run").iterdir()}
    assert names == {"flight.scene", "flight.tlog", "summary.json"}


# command line


def command_line(capsys, *arguments):
    code = cli.run_command_line(list(arguments))
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_a_flight_from_the_command_line(scripted, tmp_path, capsys):
    code, out, err = command_line(
        capsys, "fly", "lissajous", "--pattern", "L1", "--size", "40x30", "--via", "setpoints",
        "--out", str(tmp_path / "run"), "--no-picture",
    )  # fmt: skip
    assert code == 0
    assert remarks(err) == []
    begun = [line.split(",")[0].split(": ")[-1] for line in err.splitlines()]
    assert begun == ["starting lissajous", "takeoff", "transit", "pattern", "return", "completed"]
    assert "\r" not in err
    lines = out.splitlines()
    assert lines[0].startswith("completed: lissajous with px4")
    assert lines[1].startswith("still air")
    assert lines[2].startswith("path error 0.0")
    assert lines[-1] == f"run: {tmp_path / 'run'}"


def test_a_failed_flight_exits_1_with_one_line(scripted, tmp_path, capsys, make_sitl):
    class Deaf(make_sitl):  # type: ignore[valid-type]
        def advance(self):
            self.time_us += 20_000

    scripted.make = lambda *_: Deaf()
    code, _out, err = command_line(capsys, "fly", "sector", "--out", str(tmp_path / "run"))
    assert code == 1
    assert err.startswith("starting sector\n")
    assert len(remarks(err)) == 1
    assert "no heartbeat of a PX4 or ArduPilot autopilot within 15 s; nothing was received" in err
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["outcome"] == "failed"


def lissajous_off_by(monkeypatch, offset_m):
    """Every commanded pattern is drawn some way off from what is flown."""
    monkeypatch.setattr(
        "missions.flown.score.path_errors_m", lambda path, track: np.full(len(track.time_s), offset_m)
    )


@pytest.mark.parametrize(("offset_m", "word"), [(1.9, "within the acceptance radius"), (2.1, "poor")])
@pytest.mark.slow
def test_poor_tracking_is_reported(scripted, tmp_path, capsys, monkeypatch, offset_m, word):
    lissajous_off_by(monkeypatch, offset_m)
    code, out, _err = command_line(
        capsys, "fly", "lissajous", "--size", "40", "--via", "setpoints", "--out", str(tmp_path / "run"),
        "--no-picture",
    )  # fmt: skip
    assert code == 0  # it was flown; no bound is set for how well
    block = json.loads((tmp_path / "run" / "summary.json").read_text())["vehicles"][0]
    assert (block["tracking"], block["acceptance_m"]) == (word, 2.0)
    reported = (
        "poor tracking: vehicle 1 was 2.1 m off the path at most, more than the acceptance radius of 2 m"
    )
    assert (reported in out) == (word == "poor")


@pytest.mark.parametrize(("bound", "code"), [("1.5", 1), ("2", 0)])
@pytest.mark.sampled(1)
def test_a_bound_of_the_path_error_is_a_check(scripted, tmp_path, capsys, monkeypatch, bound, code):
    lissajous_off_by(monkeypatch, 1.9)
    given = command_line(
        capsys, "fly", "lissajous", "--size", "40", "--via", "setpoints", "--out", str(tmp_path / "run"),
        "--no-picture", "--max-error", bound,
    )  # fmt: skip
    assert given[0] == code
    assert ("was 1.90 m at most, more than --max-error 1.5 m" in given[2]) == (code == 1)
    outcome = json.loads((tmp_path / "run" / "summary.json").read_text())["outcome"]
    assert outcome == ("failed" if code else "completed")


def test_a_bound_of_a_path_error_that_is_not_measured_is_no_success(scripted, tmp_path, capsys):
    script = tmp_path / "idle.py"
    script.write_text("async def fly(vehicle, options):\n    await vehicle.clock.sleep(1.0)\n")
    code, _out, err = command_line(
        capsys, "fly", str(script), "--max-error", "1", "--out", str(tmp_path / "run"), "--no-picture"
    )
    assert code == 1
    assert "flew no path whose error --max-error could limit" in err


def test_warnings_are_reported_once(scripted, tmp_path, capsys):
    script = tmp_path / "wary.py"
    script.write_text(
        "async def fly(vehicle, options):\n    for _ in range(3):\n        vehicle.notes.warn('low sun')\n"
    )
    code, _out, err = command_line(capsys, "fly", str(script), "--out", str(tmp_path / "run"), "--no-picture")
    assert code == 0
    assert err.splitlines()[:2] == ["starting wary", "3.0 s: completed"]
    assert remarks(err) == ["warning: vehicle 1: low sun"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["fly", "lisajous"], "mission 'lisajous' is not known; there are lissajous, sector"),
        (["fly", "missing.py"], "mission file missing.py does not exist"),
        (["fly", "lissajous", "--speed", "50"], r"speed 50 m/s is not in 0..12 m/s"),
        (["fly", "lissajous", "--speed", "11", "--autopilot", "ardupilot"], "0..10 m/s"),
        (["fly", "lissajous", "--altitude", "1000"], "altitude 1000 m is not in 1.5..120 m"),
        (["fly", "lissajous", "--size", "0"], "is empty"),
        (["fly", "lissajous", "--size", "tall"], "'--size': 'tall' is not one or two numbers"),
        (["fly", "parallel-sweep", "--size", "20", "--spacing", "30"], "spacing below 20 m"),
        (["fly", "lissajous", "--pattern", "L7"], "'L7' is not known; there are L1"),
        (["fly", "lissajous", "--via", "setpoints", "--period", "5"], "ask for --period"),
        (["fly", "lissajous", "--period", "500"], "--period needs --via setpoints"),
        (["fly", "sector", "--via", "setpoints", "--period", "500"], "--period is for lissajous"),
        (["fly", "lissajous", "--periods", "-1"], "--periods -1 is not possible"),
        (["fly", "lissajous", "--wind", "gale"], "wind 'gale' is not SPEED"),
        (["fly", "lissajous", "--wind", "99@0"], "0..40 m/s"),
        (["fly", "lissajous", "--params", "none.parm"], "parameter file none.parm can't be read"),
        (["fly", "lissajous", "--connect", "nonsense"], "connection 'nonsense'"),
        (["fly", "lissajous", "--connect", "udpin:127.0.0.1:1", "--vehicles", "2"], "1 connections for 2"),
        (["fly", "lissajous", "--rate", "1"], "--rate 1 Hz"),
        (["fly", "lissajous", "--arg", "x"], "--arg is for a mission of your own, not for lissajous"),
        (["fly", "lissajous", "--no-such"], "--no-such"),
        (["fly"], "Missing argument"),
        (["walk"], "no command 'walk'; there are fly, sitl"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(capsys, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, out, err = command_line(capsys, *arguments)
    assert code == 2
    assert out == ""
    assert len(err.splitlines()) == 1
    assert message in err
    assert list(tmp_path.iterdir()) == []  # nothing was begun


def test_a_full_run_folder_is_refused(capsys, tmp_path):
    (tmp_path / "old").write_text("x")
    code, _out, err = command_line(capsys, "fly", "lissajous", "--out", str(tmp_path))
    assert code == 2
    assert "not empty" in err


@pytest.mark.parametrize(
    "text",
    [
        "MPC_XY_CRUISE 7\n# comment\nMPC_ACC_HOR=2.5 # inline\n",
        "MPC_XY_CRUISE,7\nMPC_ACC_HOR,2.5\n",
        "# QGC\n1\t1\tMPC_XY_CRUISE\t7.0\t9\n1\t1\tMPC_ACC_HOR\t2.5\t9\n",
    ],
)
def test_parameter_files_of_three_kinds(tmp_path, text):
    path = tmp_path / "p.parm"
    path.write_text(text)
    assert parameters_from_file(path) == {"MPC_XY_CRUISE": 7.0, "MPC_ACC_HOR": 2.5}


@pytest.mark.parametrize(
    "text", ["FINE 1\nBROKEN\n", "X nan\n", "A_NAME_LONGER_THAN_16 1\n", "A 1 2 3 4 5\n"]
)
def test_bad_parameter_files_name_the_line(tmp_path, text):
    path = tmp_path / "p.parm"
    path.write_text(text)
    with pytest.raises(PlanError, match=r"line \d"):
        parameters_from_file(path)


def test_small_parsers():
    assert parse_wind("5@270") == (5.0, 270.0)
    assert parse_wind("3.5") == (3.5, 0.0)
    size = DeclaredType(next(user for user in user_options(FlightOptions) if user.name == "size"))
    for text, sides in (("100x80", (100.0, 80.0)), (" 100 X 80", (100.0, 80.0)), ("60", (60.0, 60.0))):
        assert size.convert(text, None, None) == sides
