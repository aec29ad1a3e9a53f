"""Viewers beside flights and logs, without a viewer's own program: 12 s."""

import socket
import threading

import pytest

from autopilot_bridge.mavlink import FrameEncoder, dialect
from autopilot_bridge.tlog import TlogWriter
from estimators.logs import open_log
from estimators.scene.scene import entries_of_log
from estimators.scene_items import Line, PointSet, Role, Text
from missions.base.options import FlightOptions
from missions.base.request import RunRequest
from missions.cli import main as cli
from missions.errors import PlanError
from missions.pattern_search.mission import PatternSearchFlight
from missions.runs import session
from missions.view import feed, opening, rerun_process
from missions.view.target import ViewKind, ViewTarget, parse_view
from tests.estimators.conftest import LEVEL


class Drawn:
    """A viewer that keeps what is drawn."""

    where, live = "here", True

    def __init__(self):
        self.entries, self.calls = [], []

    def begin(self, title, log=None):
        self.calls.append(f"begin {title}")

    def draw(self, entries):
        self.entries += entries

    def lay_out(self):
        pass

    def finish(self):
        self.calls.append("finish")

    def close(self):
        self.calls.append("close")


class Broken(Drawn):
    """A viewer that is closed in flight."""

    def draw(self, entries):
        raise RuntimeError("the window was closed")


class Stuck(Drawn):
    """A viewer that never reads."""

    def __init__(self):
        super().__init__()
        self.released = threading.Event()

    def draw(self, entries):
        self.released.wait(60.0)


class Recorded(Drawn):
    """A viewer that draws a flight when it is over."""

    live = False


def fly(out, view, **changes):
    options = FlightOptions(width_m=30.0, height_m=20.0, pattern="L2")
    request = RunRequest(options=options, out=out, picture=False, view=view, **changes)
    return session.fly("lissajous", request)


def test_a_flight_is_the_same_to_the_byte_with_and_without_a_viewer(scripted, tmp_path, monkeypatch):
    monkeypatch.setattr(feed, "_ENDS_WITHIN_S", 0.2)
    monkeypatch.setattr(feed, "_MOST_WAITING", 100)
    stuck = Stuck()
    results = {
        name: fly(tmp_path / name, view)
        for name, view in (("without", None), ("drawn", Drawn()), ("broken", Broken()), ("stuck", stuck))
    }
    stuck.released.set()
    logs = {name: (result.folder / "flight.tlog").read_bytes() for name, result in results.items()}
    assert len(set(logs.values())) == 1
    assert all(result.outcome == "completed" for result in results.values())
    warnings = {name: result.summary["vehicles"][0]["warnings"] for name, result in results.items()}
    assert warnings["without"] == []
    assert any("the window was closed" in text for text in warnings["broken"])
    assert any("did not take the rest" in text for text in warnings["stuck"])


def test_live_and_recorded_give_the_same_scene(scripted, tmp_path):
    live, recorded = Drawn(), Recorded()
    result = fly(tmp_path / "live", live, estimator="lissajous", estimator_settings=["source=global"])
    fly(tmp_path / "recorded", recorded, estimator="lissajous", estimator_settings=["source=global"])
    beside = list(entries_of_log(open_log(result.folder / "flight.tlog")))
    paths = {entry.path for entry in beside}
    assert {entry.path for entry in live.entries} == {entry.path for entry in recorded.entries} == paths
    assert {"vehicles/1/estimate", "vehicles/1/truth", "vehicles/1/commanded", "vehicles/1/phase"} <= paths
    assert {"estimators/lissajous/1/place", "estimators/lissajous/1/error_north"} <= paths
    texts = [entry.item for entry in beside if entry.path == "vehicles/1/phase"]
    phases = [text.state for text in texts if isinstance(text, Text)]
    assert phases[-1] == "return" and "pattern" in phases
    assert live.calls[0] == "begin live" and live.calls[-1] == "finish"


def test_a_mission_shows_what_it_knows_and_its_mistakes_end_no_flight(scripted, tmp_path, monkeypatch):
    places = iter(range(1000))

    def shown(self):
        return {"places": PointSet(points_ned_m=[[float(next(places)), 0.0, 0.0]], role=Role.FOUND)}

    monkeypatch.setattr(PatternSearchFlight, "shown", shown, raising=False)
    result = fly(tmp_path / "run", None)
    found = [e for e in entries_of_log(open_log(result.folder / "flight.tlog")) if e.path == "mission/places"]
    assert len(found) > 20  # each second

    monkeypatch.setattr(PatternSearchFlight, "shown", lambda self: {"a": Line(points_ned_m=1 / 0)})
    result = fly(tmp_path / "again", None)
    assert result.outcome == "completed"
    assert any("division by zero" in text for text in result.summary["vehicles"][0]["warnings"])


@pytest.mark.parametrize(
    ("text", "target"),
    [
        ("window", ViewTarget(ViewKind.WINDOW)),
        ("web:8080", ViewTarget(ViewKind.WEB, port=8080)),
        ("foxglove", ViewTarget(ViewKind.FOXGLOVE)),
    ],
)
def test_viewers_are_named_in_one_word(text, target):
    assert parse_view(text) == target
    assert parse_view("a/b.RRD").kind is ViewKind.RRD


@pytest.mark.parametrize("text", ["orbit", "web:0", "web:99999", "window:1", "rrd", "flight.tlog", ""])
def test_what_names_no_viewer_is_refused(text):
    with pytest.raises(PlanError, match="give window, web, web:PORT"):
        parse_view(text)


@pytest.fixture
def log(tmp_path):
    """A log without a position."""
    path = tmp_path / "no_position.tlog"
    writer, encoder = TlogWriter(path), FrameEncoder(1, 1)
    for k in range(20):
        message = dialect.MAVLink_attitude_message(1000 + 100 * k, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0)
        writer.write(1_700_000_000_000_000 + 100_000 * k, encoder.encode(message))
    writer.close()
    return path


@pytest.fixture
def view(capsys):
    """Runs `flightstack view`; returns the exit code and what it says on stderr."""

    def run(*arguments):
        code = cli.run_command_line(["view", *map(str, arguments)])
        return code, capsys.readouterr().err.strip()

    return run


def test_what_can_not_be_viewed_is_one_line(view, log, tmp_path, monkeypatch):
    pytest.importorskip("rerun", reason="Rerun is not installed: pip install 'flightstack[view]'")
    assert view(log, "--view", "orbit")[0] == 2
    (tmp_path / "empty").mkdir()
    assert view(tmp_path / "empty", "--view", "web")[0] == 2
    monkeypatch.setattr(opening, "find_spec", lambda name: None)
    code, line = view(log, "--view", "web")
    assert code == 1 and "rerun, which is not installed; pip install 'flightstack[view]'" in line
    assert "\n" not in line


def test_a_port_in_use_and_no_display_are_one_line(view, log, monkeypatch):
    pytest.importorskip("rerun", reason="Rerun is not installed: pip install 'flightstack[view]'")
    with socket.socket() as taken:
        taken.bind((rerun_process.LOOPBACK, 0))
        taken.listen()
        code, line = view(log, "--view", f"web:{taken.getsockname()[1]}")
    assert code == 1 and "is in use; give another one" in line and "\n" not in line
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    code, line = view(log)
    assert code == 1 and "there is no display for a window" in line and "\n" not in line


def test_a_log_without_a_position_is_drawn_and_said_to_have_no_map(view, log, tmp_path):
    pytest.importorskip("rerun", reason="Rerun is not installed: pip install 'flightstack[view]'")
    code, line = view(log, "--view", tmp_path / "out.rrd")
    assert code == 0 and line == f"{log} has no position, so that there is no map"
    code, line = view(log, "--view", tmp_path / "out.rrd")
    assert code == 1 and "out.rrd" in line and "\n" not in line  # nothing is overwritten


def test_a_replay_is_drawn_with_what_its_estimator_shows(log, tmp_path, capsys):
    pytest.importorskip("rerun", reason="Rerun is not installed: pip install 'flightstack[view]'")
    from rerun.chunk import RrdReader

    arguments = ["replay", log, "--estimator", LEVEL, "--out", tmp_path / "run", "--no-picture"]
    assert cli.run_command_line([*map(str, arguments), "--view", str(tmp_path / "run.rrd")]) == 0
    paths = {str(chunk.entity_path).strip("/") for chunk in RrdReader(tmp_path / "run.rrd").stream()}
    assert "estimators/level/1/roll" in paths
    assert "view: " in capsys.readouterr().out
    code = cli.run_command_line([*map(str, [*arguments, log]), "--view", str(tmp_path / "two.rrd")])
    assert code == 2 and "is one file for several logs" in capsys.readouterr().err
