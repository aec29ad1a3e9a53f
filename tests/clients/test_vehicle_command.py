"""`flightstack vehicle` as a user calls it, against a SITL of each flavour."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")

from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.parameter_files import read_untyped_parameter_file
from autopilot_bridge.tlog import TlogReader
from tests.clients.forked_process import flightstack_done
from tests.clients.mavutil_client import Client
from tests.clients.sitl_process import free_port, running_sitl
from tests.slow import slow

FLOAT = {"px4": "MPC_XY_CRUISE", "ardupilot": "WPNAV_SPEED"}
INTEGER = {"px4": "NAV_DLL_ACT", "ardupilot": "FS_GCS_ENABLE"}
SPEEDUP = 5.0


@dataclass
class Said:
    """What a command left behind."""

    returncode: int
    stdout: str
    stderr: str


class User:
    """A user at a terminal, with a SITL beside it; a script flies it over `script_port`."""

    def __init__(self, flavour: str, port: int, script_port: int = 0) -> None:
        self.flavour = flavour
        self.url = f"udpin:127.0.0.1:{port}"
        self.script_port = script_port

    def run(self, *words: str) -> Said:
        done = flightstack_done("vehicle", *words, "--connect", self.url)
        return Said(done.returncode, done.stdout, done.stderr)

    def json(self, *words: str) -> Any:
        done = self.run(*words, "--json")
        assert done.stderr == ""
        return json.loads(done.stdout)


@pytest.fixture(scope="module", params=["px4", slow("ardupilot")])
def user(request: pytest.FixtureRequest) -> Iterator[User]:
    port, script_port = free_port(), free_port()
    links = [f"udpout:127.0.0.1:{number}" for number in (port, script_port)]
    with running_sitl(request.param, links, speedup=SPEEDUP):
        script = Client(request.param, f"udpin:127.0.0.1:{script_port}", speedup=SPEEDUP)
        script.ready()
        script.link.close()  # it has its position
        yield User(request.param, port, script_port)


def test_info(user: User) -> None:
    found = user.json("info")
    assert (found["autopilot"], found["type"], found["system_id"]) == (user.flavour, "quadrotor", 1)
    assert found["firmware"] == {"px4": "1.16.1 release", "ardupilot": "4.6.3 release"}[user.flavour]
    assert {"id": 1, "name": "autopilot1"} in found["components"]
    assert "mission_int" in found["capabilities"]
    assert found["armed"] is False
    assert found["position"]["lat_deg"] == pytest.approx(
        {"px4": 47.4, "ardupilot": -35.4}[user.flavour], abs=0.1
    )
    assert found["battery"]["voltage_v"] > 10.0
    assert found["gps"]["satellites"] >= 6
    text = user.run("info")
    assert (text.returncode, text.stderr) == (0, "")
    assert f"autopilot      {user.flavour}" in text.stdout


def test_parameters_are_read_set_saved_compared_and_loaded(user: User, tmp_path: Path) -> None:
    name, whole = FLOAT[user.flavour], INTEGER[user.flavour]
    values = user.json("params", "list")
    assert len(values) > 300
    assert values[name]["type"] == 9
    assert values[whole]["type"] == {"px4": 6, "ardupilot": 2}[user.flavour]  # INT32, INT8
    assert isinstance(values[whole]["value"], int)

    before = values[name]["value"]
    for suffix in (".params", ".parm"):
        saved = user.run("params", "save", str(tmp_path / f"a{suffix}"))
        assert (saved.returncode, saved.stderr) == (0, "")
        read = read_untyped_parameter_file(tmp_path / f"a{suffix}")
        assert read.keys() == values.keys()
        assert user.run("params", "compare", str(tmp_path / f"a{suffix}")).returncode == 0
    again = user.run("params", "save", str(tmp_path / "a.params"))
    assert again.returncode == 2
    assert "nothing is overwritten" in again.stderr

    value = before + 0.1
    changed = user.run("params", "set", name, f"{value:.3f}")
    assert (changed.returncode, changed.stderr) == (0, "")
    assert user.json("params", "get", name, whole)[name]["value"] == pytest.approx(value, rel=1e-6)
    differ = user.run("params", "compare", str(tmp_path / "a.params"))
    assert differ.returncode == 1
    assert "1 differ" in differ.stdout
    assert name in differ.stdout

    unasked = user.run("params", "load", str(tmp_path / "a.params"))
    assert unasked.returncode == 2
    assert "give --yes" in unasked.stderr
    loaded = user.run("params", "load", str(tmp_path / "a.params"), "--yes")
    assert (loaded.returncode, loaded.stderr) == (0, "")
    assert "1 parameter set" in loaded.stdout
    assert user.run("params", "compare", str(tmp_path / "a.params")).returncode == 0


def test_parameters_that_are_not_there(user: User, tmp_path: Path) -> None:
    typo = user.run("params", "get", FLOAT[user.flavour] + "X")
    assert typo.returncode == 2
    assert f"did you mean {FLOAT[user.flavour]}" in typo.stderr
    assert len(typo.stderr.splitlines()) == 1
    fraction = user.run("params", "set", INTEGER[user.flavour], "0.5")
    assert fraction.returncode == 2
    assert "accepted: a whole number" in fraction.stderr
    large = user.run("params", "set", INTEGER[user.flavour], "99999999999")
    assert large.returncode == 2
    assert "= 1e+11: accepted: a whole number, -" in large.stderr
    other = tmp_path.parent / "other.parm"
    other.write_text("NOT_THERE 1\n")
    unknown = user.run("params", "load", str(other), "--yes")
    assert (unknown.returncode, unknown.stderr) == (1, "flightstack: the vehicle has no NOT_THERE\n")
    suffix = user.run("params", "save", str(tmp_path / "a.txt"))
    assert suffix.returncode == 2
    assert "accepted: .params, .parm, .param" in suffix.stderr
    assert not any(tmp_path.iterdir())


def test_doctor(user: User) -> None:
    found = user.json("doctor")
    assert (found["would_arm"], found["problems"]) == (True, 0)
    subjects = {finding["subject"] for finding in found["findings"]}
    assert subjects >= {
        *("vehicle", "sensors", "arming", "GPS", "navigation", "home", "battery", "remote control"),
        *("geofence", "clock", "lost link", "link"),
    }
    assert all(f["advice"] for f in found["findings"] if f["level"] != "ok")
    link = next(f for f in found["findings"] if f["subject"] == "link")
    assert "0.0 % lost" in link["text"]


def test_no_vehicle_is_one_line() -> None:
    user = User("px4", free_port())
    done = user.run("info", "--timeout", "1")
    assert done.returncode == 1
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert "no autopilot was received on udpin:127.0.0.1" in line
    assert "nothing was received in 2 s" in line
    wrong = {"serial:/dev/none:57600": "can't be opened", "nonsense": "accepted:", "a.tlog": "accepted:"}
    for url, words in wrong.items():
        user.url = url
        done = user.run("info", "--timeout", "1")
        assert done.returncode in (1, 2)
        assert words in done.stderr
        assert len(done.stderr.splitlines()) == 1


def logged_flight(user: User) -> None:
    """ArduPilot begins its log when it is armed, and has no logs for clients until it is disarmed."""
    script = Client(user.flavour, f"udpin:127.0.0.1:{user.script_port}", speedup=SPEEDUP)
    try:
        script.ready()
        script.link.mav.param_set_send(1, 1, b"DISARM_DELAY", 0.0, mavlink.MAV_PARAM_TYPE_INT8)
        script.set_mode("GUIDED")
        script.arm()
        script.next("HEARTBEAT", lambda m: bool(m.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED))
        refused = user.run("logs", "list")
        assert refused.returncode == 1
        assert "it is armed" in refused.stderr
        while script.link.recv_match() is not None:
            continue  # what came meanwhile: the answer needs room in the socket's buffer
        # no client has read what the vehicle sent meanwhile: an acknowledgement may not fit any more
        script.link.mav.command_long_send(1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, *(0.0,) * 7)
        script.next("HEARTBEAT", lambda m: not m.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
    finally:
        script.link.close()


def test_logs_are_fetched_once_and_erased_when_requested(user: User, tmp_path: Path) -> None:
    if user.flavour == "ardupilot":
        assert user.json("logs", "list") == []
        assert user.run("logs", "download", "--to", str(tmp_path)).returncode == 2
        logged_flight(user)
    first = {"px4": 0, "ardupilot": 1}[user.flavour]
    assert [log["id"] for log in user.json("logs", "list")] == [first]
    fetched = user.run("logs", "download", "newest", "--to", str(tmp_path))
    assert (fetched.returncode, fetched.stderr) == (0, "")
    (path,) = tmp_path.iterdir()
    assert path.suffix == ".tlog"
    assert f"{path.stat().st_size} bytes" in fetched.stdout
    names = {frame.definition.name for _, frame in TlogReader(path)}
    assert {"HEARTBEAT", "ATTITUDE", "PARAM_VALUE"} <= names
    if user.flavour == "ardupilot":  # PX4's goes on until a disarming
        again = user.json("logs", "download", "all", "--to", str(tmp_path))
        assert [(log["file"], log["fetched"]) for log in again] == [(str(path), False)]
    wrong = user.run("logs", "download", "99", "--to", str(tmp_path))
    assert wrong.returncode == 2
    assert "accepted: all, newest, or one of" in wrong.stderr
    unasked = user.run("logs", "erase")
    assert unasked.returncode == 2
    assert "give --yes" in unasked.stderr
    assert user.run("logs", "erase", "--yes").returncode == 0
    left = {"px4": [first], "ardupilot": []}[user.flavour]  # what is being written stays
    assert [log["id"] for log in user.json("logs", "list")] == left
