"""Autopilots other than the emulated one fly in a SITL: they get readings and give actuator commands."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.autopilot.channels import AutopilotChannel
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.mavlink import Frame, FrameEncoder, dialect
from autopilot_bridge.sitl import BackendLinks, BackendSetup, Sitl
from flightsim.interface import MAX_ACTUATORS
from flightsim.world_spec import VehicleSpec, WorldSpec

STEPS = 250 * 20


class Recorded:
    """Gives recorded commands; it has links of its own."""

    armed = True
    links: BackendLinks | None = None

    def __init__(self, setup: BackendSetup, commands: Sequence[NDArray[np.float64]]) -> None:
        self.readings = setup.readings
        self.times_us: list[int] = []
        self.pressures: set[float] = set()
        self.closed = False
        self._commands = commands

    def step(self, time_us: int) -> NDArray[np.float64]:
        self.times_us.append(time_us)
        self.pressures.add(float(self.readings.barometer.values[0]))
        return self._commands[len(self.times_us) - 1]

    def close(self) -> None:
        self.closed = True


def test_a_recorded_sequence_of_commands_repeats_the_flight_it_is_from() -> None:
    emulated = Sitl(WorldSpec(seed=6))
    vehicle = emulated.vehicles[0]
    commands, truths = [], []
    for step in range(STEPS):
        if step == 2000:
            vehicle.autopilot.commander.set_mode(FlightMode.TAKEOFF)
            vehicle.autopilot.commander.arm()
        emulated.advance()
        commands.append(vehicle.autopilot.actuators.copy())
        truths.append(vehicle.vehicle.truth.copy())
    assert truths[-1][2] > truths[0][2] + 1.0  # it climbed

    started: list[tuple[int, Recorded]] = []

    def recorded(setup: BackendSetup) -> Callable[[int], Recorded]:
        def boot(unix_epoch_us: int) -> Recorded:
            started.append((unix_epoch_us, Recorded(setup, commands)))
            return started[-1][1]

        return boot

    spec = WorldSpec(seed=6)
    again = Sitl(spec, backend=recorded)
    for truth in truths:
        again.advance()
        np.testing.assert_array_equal(again.vehicles[0].vehicle.truth, truth)
    ((epoch_us, backend),) = started
    assert epoch_us == spec.unix_epoch_us
    assert backend.times_us == [again.step_us * (step + 1) for step in range(STEPS)]
    assert len(backend.pressures) > 10  # the readings change
    again.close()
    assert backend.closed
    assert again.vehicles[0].parameter_values(["MPC_XY_VEL_MAX"]) == {}
    with pytest.raises(TypeError, match="vehicle 1 is not emulated"):
        _ = again.vehicles[0].autopilot


class Constant:
    """Full throttle; on the SITL's links it echoes what it receives."""

    armed = False

    def __init__(self, setup: BackendSetup) -> None:
        self.roles: list[str] = []
        self.received: list[int] = []
        self._commands = np.zeros(MAX_ACTUATORS)
        self._system_id = setup.vehicle.system_id

    @property
    def links(self) -> BackendLinks:
        return self

    def step(self, time_us: int) -> NDArray[np.float64]:
        return self._commands

    def add_channel(self, channel: AutopilotChannel, *, role: str) -> None:
        self.roles.append(role)

    def remove_channel(self, channel: AutopilotChannel) -> None:
        self.roles.pop()

    def receive(self, frame: Frame, channel: AutopilotChannel) -> None:
        self.received.append(frame.message_id)
        channel.send(dialect.MAVLink_system_time_message(1, 2))

    def close(self) -> None:
        pass


def test_a_backend_on_the_links_of_the_sitl_and_its_launch_when_it_is_armed() -> None:
    made: list[Constant] = []

    def constant(setup: BackendSetup) -> Callable[[int], Constant]:
        made.append(Constant(setup))
        return lambda _unix_epoch_us: made[-1]

    sitl = Sitl(
        WorldSpec(vehicles=(VehicleSpec(model="aerosonde", launch="catapult", system_id=3),)),
        backend=constant,
    )
    link, (backend,), launcher = sitl.connect(0), made, sitl.vehicles[0].vehicle.launcher
    assert launcher is not None
    assert backend.roles == ["onboard"]
    link.send(FrameEncoder(255, 190).encode(dialect.MAVLink_ping_message(0, 1, 0, 0)))
    assert backend.received == [dialect.MAVLINK_MSG_ID_PING]
    assert link.receive()

    for _ in range(250 * 5):
        sitl.advance()
    assert launcher.held
    backend.armed = True
    for _ in range(250 * 4):
        sitl.advance()
    assert not launcher.held
    sitl.close()
    assert backend.roles == []
