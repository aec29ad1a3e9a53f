"""One seed makes one flight of aircraft too: payload, teams of different kinds, whatever the clock does."""

import signal
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.mavlink import FrameParser
from autopilot_bridge.sitl import Sitl
from flightsim.environment import Environment
from flightsim.payload import (
    CameraParameters,
    GimbalParameters,
    GroundTargetParameters,
    MagneticField,
    MagneticMap,
    PayloadParameters,
    Static,
    SurveyMagnetometerParameters,
)
from flightsim.world_spec import HOMES, VehicleSpec, WorldSpec
from tests.system.runs import Run, started

FLIGHTS = {
    "orbit": ("orbit", "--autopilot", "ardupilot", "--target", "250,100", "--duration", "10"),
    "occupancy": (
        *("occupancy", "--vehicles", "3", "--model", "aerosonde,iris,aerosonde"),
        *("--size", "800", "--search-time", "10", "--altitude", "40"),
    ),
    "lissajous": ("lissajous", "--model", "aerosonde", "--search-time", "30", "--wind", "5@240"),
}
IN_FLIGHT_BYTES = 2_000_000
WALL_FIGURES = {"wall_time_s", "speedup", "command"}


def same_files(first: Run, second: Run) -> None:
    names = sorted(path.name for path in first.folder.iterdir())
    assert sorted(path.name for path in second.folder.iterdir()) == names
    for name in names:
        if name != "summary.json":
            assert (first.folder / name).read_bytes() == (second.folder / name).read_bytes(), name
    summaries: list[dict[str, Any]] = [
        {key: value for key, value in run.summary.items() if key not in WALL_FIGURES}
        for run in (first, second)
    ]
    assert summaries[0] == summaries[1]
    assert summaries[0]["outcome"] == "completed"


@pytest.mark.slow
@pytest.mark.parametrize("name", FLIGHTS)
def test_a_flight_is_repeated_to_the_byte(name: str, tmp_path: Path) -> None:
    """Once at full speed, once paced and stopped in the air for a while."""
    arguments = (*FLIGHTS[name], "--seed", "7", "--turbulence", "light", "--no-picture")
    with (
        started(tmp_path / "stopped", *arguments, "--speedup", "60") as stopped,
        started(tmp_path / "free", *arguments, interpreter=True) as free,
    ):
        stopped.wait_for_log(IN_FLIGHT_BYTES)
        stopped.process.send_signal(signal.SIGSTOP)
        time.sleep(0.5)  # the wall clock goes on, the flight does not
        stopped.process.send_signal(signal.SIGCONT)
        for run in (free, stopped):
            run.finish()
        assert free.log.stat().st_size > 1.5 * IN_FLIGHT_BYTES
        same_files(free, stopped)


HOME = HOMES["px4"]
LINES = np.linspace(-500.0, 500.0, 11)
MAP = MagneticMap(
    north_m=LINES, east_m=LINES, total_field_nt=np.full((11, 11), 48_000.0), height_m=80.0, home=HOME
)
CARRIED = PayloadParameters(
    gimbal=GimbalParameters(), camera=CameraParameters(), magnetometer=SurveyMagnetometerParameters()
)
GUST = Environment.from_wind(speed_m_s=5.0, from_deg=240.0, turbulence="moderate")
TARGETS = tuple(
    GroundTargetParameters(motion=Static(north_m=north_m, east_m=20.0), size_m=4.0)
    for north_m in (40.0, 90.0)
)


def taken_off(
    *,
    models: Sequence[str] = ("aerosonde",),
    flavour: str = "px4",
    seed: int = 7,
    payload: PayloadParameters | None = None,
    targets: Sequence[GroundTargetParameters] = (),
) -> tuple[bytes, bytes]:
    """All that the first aircraft's sensors read and its truth in a take-off, and what its payload said."""
    vehicles = tuple(
        VehicleSpec(
            system_id=index + 1,
            model=model,
            autopilot=flavour,
            offset_ne_m=(0.0, 30.0 * index),
            payload=payload or PayloadParameters(),
        )
        for index, model in enumerate(models)
    )
    sitl = Sitl(
        WorldSpec(
            vehicles=vehicles,
            home=HOME,
            seed=seed,
            air=GUST,
            targets=tuple(targets),
            magnetic_field=MagneticField(MAP) if payload is not None else None,
        )
    )
    first, link, parser = sitl.vehicles[0], sitl.connect(0), FrameParser()
    senses = first.sensors.readings
    seen, said = [], []
    for step in range(4500):
        if step == 2000:
            for vehicle in sitl.vehicles:
                assert vehicle.autopilot.commander.set_mode(FlightMode.TAKEOFF).accepted
                assert vehicle.autopilot.commander.arm().accepted
        sitl.advance()
        if step % 10 == 0:
            seen += [getattr(senses, name).values.tobytes() for name in senses.__slots__]
            seen.append(first.vehicle.truth.tobytes())
            for _, data in link.receive():
                said += [frame.raw for frame in parser.feed(data) if frame.component_id != 1]
    return b"".join(seen), b"".join(said)


@pytest.fixture(scope="module")
def alone() -> tuple[bytes, bytes]:
    return taken_off()


@pytest.mark.slow
def test_payload_and_targets_change_no_other_stream(alone: tuple[bytes, bytes]) -> None:
    seen, said = taken_off(payload=CARRIED, targets=TARGETS)
    assert seen == alone[0]
    assert len(said) > 10_000 and alone[1] == b""


@pytest.mark.slow
def test_other_vehicles_change_no_stream_of_an_aircraft_and_its_payload() -> None:
    single = taken_off(payload=CARRIED, targets=TARGETS)
    assert taken_off(models=("aerosonde", "iris", "aerosonde"), payload=CARRIED, targets=TARGETS) == single


@pytest.mark.slow
def test_another_seed_is_another_flight(alone: tuple[bytes, bytes]) -> None:
    assert taken_off()[0] == alone[0]
    assert taken_off(seed=8)[0] != alone[0]
