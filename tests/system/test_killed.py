"""kill -9 in flight, of the vehicle, of the mission, of an estimator: every log is readable to its last
complete record, and the vehicle does what its failsafe parameters say.
"""

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavutil

from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.mavlink import Frame, decode, definition
from autopilot_bridge.services.files.log_book import LogBook
from autopilot_bridge.sitl import Sitl
from autopilot_bridge.storage.folder import FolderStore
from autopilot_bridge.storage.memory import MemoryCard
from autopilot_bridge.tlog import TlogReader
from flightsim.world_spec import VehicleSpec, WorldSpec
from missions.cli.main import run_command_line
from tests.clients.forked_process import flightstack
from tests.clients.sitl_process import SitlProcess, free_port, running_sitl
from tests.system.logs import counts, mavutil_counts, modes
from tests.system.runs import SHORT, Run, started, wait_until
from tests.system.test_interruption_aircraft import fly_until
from tests.system.test_serial_line import in_flight

LONG = (*SHORT, "--periods", "20")
SECTOR = ("sector", "--via", "waypoints", "--no-picture")
SPEEDUP = 20.0
MISSION_FAILED = 1
POSITION, ITEM = definition("GLOBAL_POSITION_INT").message_id, definition("MISSION_ITEM_INT").message_id
NUMBERS = {
    ("px4", "return"): 0x05040000,
    ("px4", "hold"): 0x03040000,
    ("px4", "land"): 0x06040000,
    ("ardupilot", "return"): 6,
    ("ardupilot", "guided"): 4,
    ("ardupilot", "land"): 9,
    ("ardupilot", "plane returns"): 11,
}


@contextlib.contextmanager
def sitl_and_watcher(
    flavour: str, folder: Path, parameters: str, *more: str
) -> Iterator[tuple[SitlProcess, str, "Watcher", Path]]:
    """A SITL with parameters and a log, the link for a mission, and a client that only looks."""
    port, watched = free_port(), free_port()
    given, log = folder / "given.parm", folder / "sitl.tlog"
    given.write_text(parameters)
    options = ["--params", str(given), "--log", str(log), *more]
    links = [f"udpin:127.0.0.1:{port}", f"udpin:127.0.0.1:{watched}"]
    with running_sitl(flavour, links, speedup=SPEEDUP, options=options) as sitl:
        watcher = Watcher(flavour, watched)
        yield sitl, f"udpout:127.0.0.1:{port}", watcher, log
        watcher.link.close()


class Watcher:
    """Hears the heartbeats; no ground station, whose own heartbeat would count."""

    def __init__(self, flavour: str, port: int) -> None:
        self.flavour = flavour
        self.link: Any = mavutil.mavlink_connection(
            f"udpout:127.0.0.1:{port}", dialect="all", source_system=200, source_component=191
        )

    def heartbeat(self) -> Any:
        self.link.mav.heartbeat_send(18, 8, 0, 0, 4)
        message = self.link.recv_match(type="HEARTBEAT", blocking=True, timeout=0.2)
        return None if message is None or message.get_srcSystem() != 1 else message

    def sets(self, name: str, value: float) -> None:
        """Set a parameter, and see that it was taken."""
        for _ in range(20):
            self.link.mav.param_set_send(1, 1, name.encode(), value, 9)
            echo = self.link.recv_match(type="PARAM_VALUE", blocking=True, timeout=1.0)
            if echo is not None and echo.param_id == name:
                assert echo.param_value == value
                return
        raise AssertionError(f"{name} is not answered")

    def sees(self, mode: str) -> None:
        """Wait for a mode."""
        number = NUMBERS[self.flavour, mode]

        def reported() -> bool:
            heartbeat = self.heartbeat()
            return heartbeat is not None and heartbeat.custom_mode == number

        wait_until(reported, 30.0)

    def sees_it_disarmed(self) -> None:
        def reported() -> bool:
            heartbeat = self.heartbeat()
            return heartbeat is not None and not heartbeat.base_mode & 128

        wait_until(reported, 60.0)


def check_readable(log: Path, *, by_others: bool = True) -> None:
    """Nothing but one torn record at the end may be lost, and pymavlink (which is slow) reads the same."""
    reader = TlogReader(log)
    frames = list(reader)
    assert len(frames) > 500
    assert reader.counters.bytes_skipped == 0
    assert log.stat().st_size - sum(8 + len(frame.raw) for _, frame in frames) < 300
    if by_others:
        assert mavutil_counts(log) == counts(log)


def kill(run: Run) -> None:
    run.process.kill()
    run.process.communicate()


def act_on_it(link: str) -> None:
    """What is left to act with when the program is gone."""
    for words, code, reported in (
        (["disarm"], 1, "was not disarmed: it is in the air"),
        (["hold"], 0, "commanded to hold, accepted; now mode Hold"),
    ):
        done = flightstack("vehicle", *words, "--connect", link, merged=True)
        out, _ = done.communicate(timeout=60.0)
        assert (done.returncode, reported in out) == (code, True), out


def high_up(frame: Frame) -> bool:
    return frame.message_id == POSITION and decode(frame).relative_alt > 3000  # type: ignore[attr-defined]


def check_card(folder: Path, flavour: str, parameters: dict[str, float], items: int) -> None:
    """The next boot finds all that was stored, and a log that ends where the process did."""
    files = FolderStore(folder)
    specification = VehicleSpec(autopilot=flavour)
    card = MemoryCard(files=files, logs=True)
    sitl = Sitl(WorldSpec(vehicles=(specification,)), cards=[card])
    autopilot = sitl.vehicles[0].autopilot
    assert {name: autopilot.parameters.get(name) for name in parameters} == parameters
    assert len(autopilot.commander.missions.items) == items
    (log,) = LogBook(files, get_flavour(flavour).services.card).logs()
    check_readable(folder.joinpath(*log.path), by_others=False)
    sitl.close()
    files.close()


def test_mission_and_vehicle_are_killed_in_one_flight(tmp_path: Path) -> None:
    """The vehicle returns when the mission is gone; when it is killed too, its memory card has everything."""
    cards = tmp_path / "cards"
    given = "NAV_DLL_ACT 2\nCOM_DL_LOSS_T 60\n"  # three seconds of the wall clock
    with sitl_and_watcher("px4", tmp_path, given, "--storage", str(cards)) as (sitl, link, watcher, log):
        with started(tmp_path / "run", *LONG, "--connect", link) as run:
            fly_until(run, high_up)
            watcher.sets("MPC_XY_CRUISE", 4.5)
            kill(run)
        act_on_it(link)
        watcher.sees("return")
        sitl.process.kill()
        sitl.process.wait()
    for written in (run.log, log):
        check_readable(written, by_others=False)
    os.utime(run.log, (0, 0))  # its run is over
    assert run_command_line(["report", str(run.log.parent), "--no-picture"]) == 0
    assert json.loads((run.log.parent / "summary.json").read_text())["outcome"] == "interrupted"
    uploaded = {decode(f).seq for _, f in TlogReader(run.log) if f.message_id == ITEM and f.system_id == 255}  # type: ignore[attr-defined]
    assert len(uploaded) > 10
    check_card(cards / "vehicle1", "px4", {"MPC_XY_CRUISE": 4.5}, len(uploaded))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("flavour", "via", "flying", "parameters", "failsafe"),
    [
        ("px4", "setpoints", "offboard", "COM_OBL_RC_ACT 3\n", "return"),
        ("px4", "setpoints", "offboard", "COM_OBL_RC_ACT 4\n", "land"),
        ("px4", "waypoints", "mission", "NAV_DLL_ACT 2\n", "return"),
        ("ardupilot", "setpoints", "guided", "FS_GCS_ENABLE 1\n", "return"),
        ("ardupilot", "waypoints", "mission", "FS_GCS_ENABLE 5\n", "land"),
    ],
)
def test_the_mission_is_killed(
    flavour: str, via: str, flying: str, parameters: str, failsafe: str, tmp_path: Path
) -> None:
    with sitl_and_watcher(flavour, tmp_path, parameters) as (_, link, watcher, log):
        with started(tmp_path / "run", *LONG, "--via", via, "--connect", link) as run:
            in_flight(run, flying)
            kill(run)
        watcher.sees(failsafe)
        watcher.sees_it_disarmed()
    check_readable(run.log)
    check_readable(log)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("flavour", "parameters", "failsafe"),
    [
        ("px4", "NAV_DLL_ACT 2\nCOM_DL_LOSS_T 60\n", "return"),
        ("ardupilot", "FS_GCS_ENABL 1\nFS_LONG_ACTN 1\nFS_LONG_TIMEOUT 60\n", "plane returns"),
    ],
)
def test_the_mission_of_an_aircraft_is_killed(
    flavour: str, parameters: str, failsafe: str, tmp_path: Path
) -> None:
    wings = ("--model", "aerosonde")
    with sitl_and_watcher(flavour, tmp_path, parameters, *wings) as (_, link, watcher, log):
        with started(tmp_path / "run", *SECTOR, "--connect", link) as run:
            fly_until(run, high_up)
            kill(run)
        watcher.sees(failsafe)
    check_readable(run.log)
    check_readable(log)


@pytest.mark.slow
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_the_vehicle_is_killed(flavour: str, tmp_path: Path) -> None:
    """The mission ends with a reason, and both logs are readable."""
    with sitl_and_watcher(flavour, tmp_path, "") as (sitl, link, _, log):
        with started(tmp_path / "run", *LONG, "--connect", link) as run:
            in_flight(run, "mission")
            sitl.process.kill()
            out = run.finish(MISSION_FAILED)
        assert "no heartbeat" in out
        assert "Traceback" not in out
    assert run.summary["outcome"] == "failed"
    assert "no heartbeat" in run.summary["reason"]
    check_readable(run.log)
    check_readable(log)


@pytest.mark.slow
def test_an_estimator_is_killed(tmp_path: Path) -> None:
    """Its log is readable, the mission on another link flies on to its end, and the vehicle heeds nothing."""
    port, onboard = free_port(), free_port()
    links = [f"udpin:127.0.0.1:{port}", f"udpin:127.0.0.1:{onboard}"]
    folder = tmp_path / "estimate"
    command = [sys.executable, "-m", "missions", "estimate", "attitude"]
    command += ["--connect", f"udpout:127.0.0.1:{onboard}", "--out", str(folder)]
    with (
        running_sitl("px4", links, speedup=SPEEDUP),
        started(tmp_path / "run", *SHORT, "--connect", f"udpout:127.0.0.1:{port}") as run,
    ):
        estimator = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=os.environ.copy()
        )
        try:
            in_flight(run, "mission")
            wait_until(lambda: any(log.stat().st_size > 300_000 for log in folder.glob("*.tlog")))
        finally:
            estimator.kill()
            reported, _ = estimator.communicate()
        assert b"Traceback" not in reported
        run.finish()
    assert run.summary["outcome"] == "completed"
    assert "offboard" not in modes(run.log)
    (log,) = folder.glob("*.tlog")
    check_readable(log)
    check_readable(run.log)
