"""Ctrl-C and kill in an aircraft's flight: it is sent home, the log is whole, the exit code says so."""

import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from autopilot_bridge.mavlink import Frame, FrameParser, decode, definition, dialect
from tests.clients.sitl_process import free_port, running_sitl
from tests.system.logs import counts, mavutil_counts, modes, records
from tests.system.runs import Run, started, wait_until
from tests.system.test_interruption import INTERRUPTED, check_interrupted

ORBIT = ("orbit", "--target", "200,100", "--no-picture", "--speedup", "60")
OCCUPANCY = (
    *("occupancy", "--vehicles", "2", "--model", "aerosonde,iris", "--size", "800", "--altitude", "40"),
    *("--no-picture", "--speedup", "60"),
)
COMMAND_LONG, HEARTBEAT, PARAM_SET = (
    definition(name).message_id for name in ("COMMAND_LONG", "HEARTBEAT", "PARAM_SET")
)
PX4_OFFBOARD, PX4_MISSION, PX4_RETURN, PLANE_TAKEOFF = 6 << 16, 0x04040000, 0x05040000, 13


def fly_until(run: Run, found: Callable[[Frame], bool]) -> None:
    """Wait until a frame is in the growing log; each byte is read once."""
    parser = FrameParser()  # what stands between the frames is junk to it
    wait_until(lambda: run.ended or run.log.exists())
    with run.log.open("rb") as file:
        wait_until(lambda: run.ended or any(found(frame) for frame in parser.feed(file.read())))
    assert not run.ended, run.process.communicate()


def in_mode(custom_mode: int) -> Callable[[Frame], bool]:
    def found(frame: Frame) -> bool:
        heartbeat = frame.message_id == HEARTBEAT and frame.component_id == 1
        return heartbeat and decode(frame).custom_mode == custom_mode  # type: ignore[attr-defined]

    return found


def gps_switched_off(frame: Frame) -> bool:
    """By command (PX4) or by the simulator's parameter (ArduPilot)."""
    if frame.message_id == PARAM_SET:
        change = decode(frame)
        return bool(change.param_id == "SIM_GPS_DISABLE" and change.param_value == 1.0)  # type: ignore[attr-defined]
    if frame.message_id != COMMAND_LONG:
        return False
    command = decode(frame)
    return bool(command.command == dialect.MAV_CMD_INJECT_FAILURE and command.param2 == 1.0)  # type: ignore[attr-defined]


def last_modes(path: Path, systems: int) -> list[int]:
    """The last custom mode of each system's autopilot."""
    reported: dict[int, int] = {}
    for _, frame in records(path):
        if frame.message_id == HEARTBEAT and frame.component_id == 1:
            reported[frame.system_id] = decode(frame).custom_mode  # type: ignore[attr-defined]
    return [reported[system] for system in range(1, systems + 1)]


@pytest.mark.parametrize("flavour", [pytest.param("px4", marks=pytest.mark.slow), "ardupilot"])
def test_ctrl_c_without_gps(flavour: str, tmp_path: Path) -> None:
    """When the mission has switched GPS off: it is switched on again, and the aircraft returns."""
    with started(tmp_path / "run", *ORBIT, "--autopilot", flavour) as run:
        fly_until(run, gps_switched_off)
        run.process.send_signal(signal.SIGINT)
        check_interrupted(run, run.finish(INTERRUPTED))
    assert modes(run.log)[-1] == "return"
    assert run.summary["gps_back_at_s"] >= run.summary["gps_lost_at_s"]


def test_ctrl_c_in_a_search_sends_all_home(tmp_path: Path) -> None:
    with started(tmp_path / "run", *OCCUPANCY) as run:
        fly_until(run, in_mode(PX4_OFFBOARD))
        run.process.send_signal(signal.SIGINT)
        check_interrupted(run, run.finish(INTERRUPTED))
    assert last_modes(run.log, 2) == [PX4_RETURN, PX4_RETURN]


@pytest.mark.slow
@pytest.mark.parametrize(("flavour", "flying"), [("px4", PX4_MISSION), ("ardupilot", PLANE_TAKEOFF)])
def test_ctrl_c_on_an_aircraft_elsewhere(flavour: str, flying: int, tmp_path: Path) -> None:
    port = free_port()
    options = ["--model", "aerosonde"]
    with running_sitl(flavour, [f"udpin:127.0.0.1:{port}"], speedup=20.0, options=options):
        flight = ("lissajous", "--no-picture", "--connect", f"udpout:127.0.0.1:{port}")
        with started(tmp_path / "run", *flight) as run:
            fly_until(run, in_mode(flying))
            run.process.send_signal(signal.SIGINT)
            check_interrupted(run, run.finish(INTERRUPTED))
    assert modes(run.log)[-1] == "return"


@pytest.mark.slow
def test_a_killed_flight_leaves_a_readable_log(tmp_path: Path) -> None:
    """kill -9, and a machine that loses the end of the file as well: all complete records are there."""
    with started(tmp_path / "run", *OCCUPANCY) as run:
        run.wait_for_log(2_500_000)
        run.process.kill()
        run.process.communicate()
    assert not (run.folder / "summary.json").exists()
    whole = records(run.log)  # the writer hands over whole records only
    assert whole[-1][0] - whole[0][0] > 5_000_000
    assert {frame.system_id for _, frame in whole} >= {1, 2, 255}
    assert mavutil_counts(run.log) == counts(run.log)
    os.truncate(run.log, run.log.stat().st_size - 9)
    assert counts(run.log).total() == len(whole) - 1
    assert mavutil_counts(run.log) == counts(run.log)
