"""What stands between the simulated sensors and the actuators of a vehicle: an autopilot, emulated or real.

Every backend is an `AutopilotBackend`. What only some can do has a protocol of its own (`ComputesElsewhere`,
`ReportsLiftOff`, `ReadsParameters`); the SITL does without where a backend has none.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.autopilot import Autopilot
from autopilot_bridge.autopilot.channels import AutopilotChannel
from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.mavlink import Frame
from autopilot_bridge.services.vehicle_memory import PowerAction
from autopilot_bridge.sitl.failures import FailureInjector
from autopilot_bridge.storage.memory import MemoryCard
from flightsim.airframe import Airframe, AirframeKind, LaunchKind
from flightsim.interface import SensorReadings
from flightsim.world_spec import VehicleSpec, WorldSpec


class BackendLinks(Protocol):
    """The side of a backend that sends and receives on links which the SITL opens."""

    def add_channel(self, channel: AutopilotChannel, *, role: str) -> None:
        """Send the default streams of a role ("onboard", "gcs" or "payload") on one more channel."""

    def remove_channel(self, channel: AutopilotChannel) -> None:
        """Send nothing more on a channel."""

    def receive(self, frame: Frame, channel: AutopilotChannel) -> None:
        """Take one frame from a channel. Contents are untrusted and never raise."""


class AutopilotBackend(Protocol):
    """The autopilot of one vehicle, from a boot to the next shutdown. It has the readings from its setup."""

    @property
    def armed(self) -> bool:
        """Whether its actuators are armed."""

    @property
    def links(self) -> BackendLinks | None:
        """Its side of the SITL's links; None: it opens links of its own."""

    def step(self, time_us: int) -> NDArray[np.float64]:
        """One physics step, after the sensors have written their readings.

        Args:
            time_us: microseconds since its boot.

        Returns:
            (MAX_ACTUATORS,) actuator commands (`flightsim.interface`), which act from the next step on.
        """

    def close(self) -> None:
        """Shut down: close open files, links and processes."""


@runtime_checkable
class ComputesElsewhere(Protocol):
    """A backend in another process, which computes while this one goes on.

    The readings of a step are sent for all vehicles before the commands of any are received, so that no
    vehicle waits for another.
    """

    def begin_step(self, time_us: int) -> None:
        """Send the readings of the step that ends at `time_us`; `AutopilotBackend.step` follows."""


@runtime_checkable
class ReportsLiftOff(Protocol):
    """A backend that reports when its flight task starts to take off; a launch crew then launches."""

    @property
    def lifting_off(self) -> bool:
        """Whether the task is to take off now."""


@runtime_checkable
class ReadsParameters(Protocol):
    """A backend whose parameters can be read without a message."""

    def parameter_values(self, names: Sequence[str]) -> dict[str, float]:
        """Values as the autopilot would send them; names that it does not have are left out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BackendSetup:
    """What a backend is made for.

    Attributes:
        vehicle, world: from the description of the world.
        airframe: the vehicle's.
        readings: its sensors, written before each step.
        truth: its true motion (`flightsim.truth`), for a firmware whose simulator makes its own sensors.
        failures: executes MAV_CMD_INJECT_FAILURE and simulator parameters.
        card: its memory card.
        power: takes a request to reboot or to shut down, and whether the simulated vehicle also starts again.
    """

    vehicle: VehicleSpec
    world: WorldSpec
    airframe: Airframe
    readings: SensorReadings
    truth: NDArray[np.float64]
    failures: FailureInjector
    card: MemoryCard
    power: Callable[[PowerAction, bool], None]


Boot: TypeAlias = Callable[[int], AutopilotBackend]
"""Starts a backend; called at each boot with its Unix time in microseconds."""

BackendMaker: TypeAlias = Callable[[BackendSetup], Boot]


class EmulatedBackend:
    """The emulated autopilot as a backend.

    Attributes:
        autopilot: the emulated autopilot.
    """

    def __init__(self, autopilot: Autopilot) -> None:
        self.autopilot = autopilot
        self._actuators = autopilot.actuators  # written in place
        self._step = autopilot.step

    @property
    def armed(self) -> bool:
        """Whether it is armed."""
        return self.autopilot.commander.armed

    @property
    def lifting_off(self) -> bool:
        """Whether its flight task starts to take off."""
        return self.autopilot.commander.tasks.lifting_off

    @property
    def links(self) -> BackendLinks:
        """It communicates on the SITL's links."""
        return self.autopilot

    def step(self, time_us: int) -> NDArray[np.float64]:
        """One physics step."""
        self._step(time_us)
        return self._actuators

    def parameter_values(self, names: Sequence[str]) -> dict[str, float]:
        """Values of parameters."""
        store = self.autopilot.parameters
        return {name: store.get(name) for name in names if name in store}

    def close(self) -> None:
        """Close its files."""
        self.autopilot.close()


def emulated(setup: BackendSetup) -> Boot:
    """Emulated autopilots of the flavour that the vehicle's description names.

    Raises:
        ValueError: a flavour or parameter that does not exist, or is out of range.
    """
    vehicle, world, airframe = setup.vehicle, setup.world, setup.airframe
    flavour = get_flavour(vehicle.autopilot, airframe.kind)
    launch = None if vehicle.launch is None else LaunchKind(vehicle.launch)
    parameters: Final[Mapping[str, float]] = {
        **flavour.launch_parameters.get(launch or airframe.launch_kind, {}),
        **vehicle.parameters,
    }
    envelope = None
    if airframe.kind is AirframeKind.FIXED_WING:
        # its module imports scipy, which a multicopter does not need
        from flightsim.flight_envelope import flight_envelope

        envelope = flight_envelope(airframe, home=world.place, environment=world.air)

    def boot(unix_epoch_us: int) -> EmulatedBackend:
        return EmulatedBackend(
            Autopilot(
                flavour,
                system_id=vehicle.system_id,
                readings=setup.readings,
                physics_rate_hz=world.physics_rate_hz,
                parameters=parameters,
                envelope=envelope,
                unix_epoch_us=unix_epoch_us,
                inject_failure=setup.failures.inject,
                simulation=setup.failures,
                card=setup.card,
                power=lambda action: setup.power(action, flavour.reboot_starts_again),
            )
        )

    return boot
