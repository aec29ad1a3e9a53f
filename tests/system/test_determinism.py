"""One seed makes one flight: the same bytes in the log, whatever the wall clock does."""

import signal
import time
from pathlib import Path

import pytest

from tests.system.runs import SHORT, fly_all, started

WEATHER = ("--wind", "4@200", "--turbulence", "moderate")
IN_FLIGHT_BYTES = 700_000  # about 20 s of vehicle time; the whole log is three times as large

CONFIGURATIONS = {
    "px4-waypoints": WEATHER,
    "px4-setpoints": ("--via", "setpoints", *WEATHER),
    "ardupilot-waypoints": ("--autopilot", "ardupilot", *WEATHER),
    "ardupilot-setpoints": ("--autopilot", "ardupilot", "--via", "setpoints", *WEATHER),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_flight_is_repeated_to_the_byte(name: str, tmp_path: Path) -> None:
    """Twice at full speed, once paced and stopped for a second in the air."""
    arguments = (*SHORT, *CONFIGURATIONS[name], "--seed", "7")
    first, second = fly_all([(tmp_path / "first", arguments), (tmp_path / "second", arguments)])
    with started(tmp_path / "stopped", *arguments, "--speedup", "40") as stopped:
        stopped.wait_for_log(IN_FLIGHT_BYTES)
        stopped.process.send_signal(signal.SIGSTOP)
        size = stopped.log.stat().st_size
        time.sleep(1.0)  # what the test is about: the wall clock goes on, the flight does not
        assert stopped.log.stat().st_size == size
        stopped.process.send_signal(signal.SIGCONT)
        stopped.finish()
    log = first.log.read_bytes()
    assert first.summary["outcome"] == "completed"
    assert len(log) > 1.5 * IN_FLIGHT_BYTES
    assert second.log.read_bytes() == log
    assert stopped.log.read_bytes() == log


def test_speed_factor_changes_no_byte_and_seed_does(tmp_path: Path) -> None:
    """The speed factor only sleeps; another seed is another flight."""
    free, other = fly_all(
        [(tmp_path / "free", (*SHORT, "--seed", "7")), (tmp_path / "other", (*SHORT, "--seed", "8"))]
    )
    (paced,) = fly_all([(tmp_path / "paced", (*SHORT, "--seed", "7", "--speedup", "20"))])
    assert paced.log.read_bytes() == free.log.read_bytes()
    assert other.log.read_bytes() != free.log.read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("via", ["waypoints", "setpoints"])
def test_a_team_is_repeated_to_the_byte(via: str, tmp_path: Path) -> None:
    arguments = (*SHORT, "--via", via, "--vehicles", "2", "--seed", "7", *WEATHER)
    first, second = fly_all(
        [(tmp_path / "first", arguments), (tmp_path / "second", (*arguments, "--speedup", "20"))]
    )
    assert [vehicle["system_id"] for vehicle in first.summary["vehicles"]] == [1, 2]
    assert second.log.read_bytes() == first.log.read_bytes()


def test_a_second_vehicle_does_not_change_the_weather_of_the_first(tmp_path: Path) -> None:
    """One random stream per vehicle and sensor: until somebody moves, vehicle 1 of a team hears and says the
    same sensor values as alone.
    """
    from autopilot_bridge.mavlink import definition
    from autopilot_bridge.tlog import TlogReader

    runs = fly_all(
        [
            (tmp_path / "alone", (*SHORT, "--seed", "7", *WEATHER)),
            (tmp_path / "team", (*SHORT, "--seed", "7", *WEATHER, "--vehicles", "2")),
        ]
    )
    imu = definition("HIGHRES_IMU").message_id
    samples = [
        [
            frame.payload
            for _, frame in TlogReader(run.log)
            if frame.message_id == imu and frame.system_id == 1
        ][:100]
        for run in runs
    ]
    assert len(samples[0]) == 100
    assert samples[0] == samples[1]
