"""One seed makes one flight: the same bytes in the log, whatever the wall clock does."""

import signal
import time
from pathlib import Path

import pytest

from autopilot_bridge.sitl import Sitl
from flightsim.world_spec import WorldSpec, team
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
    first, second = fly_all(
        [(tmp_path / "first", arguments), (tmp_path / "second", arguments)], interpreter=True
    )
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


@pytest.mark.slow
def test_a_team_is_repeated_to_the_byte_and_another_seed_is_another_flight(tmp_path: Path) -> None:
    """The speed factor only sleeps."""
    pair = (*SHORT, "--vehicles", "2", *WEATHER)
    first, second, other = fly_all(
        [
            (tmp_path / "first", (*pair, "--seed", "7")),
            (tmp_path / "second", (*pair, "--seed", "7", "--speedup", "20")),
            (tmp_path / "other", (*SHORT, "--seed", "8", *WEATHER)),
        ],
        interpreter=True,
    )
    assert [vehicle["system_id"] for vehicle in first.summary["vehicles"]] == [1, 2]
    assert second.log.read_bytes() == first.log.read_bytes()
    alone = fly_all([(tmp_path / "alone", (*SHORT, "--seed", "7", *WEATHER))])[0]
    assert other.log.read_bytes() != alone.log.read_bytes()


def test_a_second_vehicle_does_not_change_the_senses_of_the_first() -> None:
    """One random stream per vehicle and sensor: standing, vehicle 1 of a team reads what it reads alone."""

    def readings(count: int) -> list[bytes]:
        vehicles = team(count, model="iris", autopilot="px4", parameters={})
        sitl = Sitl(WorldSpec(vehicles=vehicles, seed=7))
        seen = []
        for _ in range(1000):
            sitl.advance()
            senses = sitl.vehicles[0].sensors.readings
            seen += [getattr(senses, name).values.tobytes() for name in senses.__slots__]
        return seen

    assert readings(1) == readings(3)
