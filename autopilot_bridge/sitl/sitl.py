"""The one visible wiring: world, sensors, autopilots and links, stepped together.

Execution order of a step, for each vehicle in turn: vehicle dynamics, sensors, autopilot (navigation, slow
loop, control, streams), payload. Then the world's clock moves on and what links have brought is handed to the
autopilots.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from autopilot_bridge.autopilot import Autopilot
from autopilot_bridge.flavours import get_flavour
from autopilot_bridge.links import Link, MemoryLink, Reach, memory_pair
from autopilot_bridge.mavlink import Frame
from autopilot_bridge.mavlink.signing import signing_time
from autopilot_bridge.payload import PayloadStation
from autopilot_bridge.services.vehicle_memory import PowerAction
from autopilot_bridge.sitl.channel import LinkChannel
from autopilot_bridge.sitl.configuration import SitlConfiguration, VehicleSpecification
from autopilot_bridge.sitl.failures import FailureInjector
from autopilot_bridge.sitl.launch_crew import LaunchCrew
from autopilot_bridge.sitl.shared_link import SharedLink
from autopilot_bridge.sitl.signing import SigningParameters, VehicleSigning
from autopilot_bridge.sitl.switchboard import Switchboard
from autopilot_bridge.sitl.truth import TRUTH_RATE_HZ, TargetTruthEncoder, TruthEncoder
from autopilot_bridge.storage.card import MemoryCard
from autopilot_bridge.tlog import TlogWriter
from flightsim.airframe import Airframe, AirframeKind, LaunchKind
from flightsim.initial_state import InitialState
from flightsim.payload import GroundTargets, Payload, PayloadParameters
from flightsim.sensors import (
    FIX_AT_BOOT,
    RTK_FIX_AFTER_10_S,
    GpsParameters,
    SensorSuite,
    SensorSuiteParameters,
)
from flightsim.world import World, WorldParameters

if TYPE_CHECKING:
    from flightsim.flight_envelope import FlightEnvelope

TruthListener = Callable[[int, bytes], None]
"""Called with vehicle time (microseconds) and a frame of truth."""

_NEVER_US: Final = 1 << 62
REBOOT_US: Final = 1_000_000
"""From when a rebooting autopilot goes down until it starts again."""
_NOT_SIGNED: Final = SigningParameters()


class SitlVehicle:
    """One vehicle with its sensors, autopilot and channels.

    Attributes:
        vehicle: the JSBSim vehicle.
        sensors: its sensor suite; `sensors.faults` switches failures.
        autopilot: the emulated autopilot.
        payload: what it carries, as MAVLink components on a link of their own; None: nothing.
        links: its open links, who is heard on them, and the key it signs with.
        crashed: the vehicle is a wreck; clients were told.
    """

    def __init__(
        self,
        specification: VehicleSpecification,
        index: int,
        configuration: SitlConfiguration,
        world: World,
        targets: GroundTargets,
        signing: SigningParameters,
        card: MemoryCard,
    ) -> None:
        streams = world.streams
        self.specification = specification
        launch = None if specification.launch is None else LaunchKind(specification.launch)
        self.vehicle = world.add_vehicle(
            specification.model, initial=InitialState(offset_ne_m=specification.offset_ne_m, launch=launch)
        )
        airframe = self.vehicle.airframe
        aircraft = airframe.kind is AirframeKind.FIXED_WING
        flavour = get_flavour(specification.flavour, airframe.kind)
        fitted = SensorSuiteParameters.fixed_wing if aircraft else SensorSuiteParameters
        self.sensors = SensorSuite(
            fitted(gps=_gps(specification.flavour)),
            physics_rate_hz=configuration.physics_rate_hz,
            truth=self.vehicle.truth,
            seeds=lambda name: streams.child("vehicle", index, "sensor", name),
        )
        failures = FailureInjector(self.vehicle, self.sensors)
        self._new_autopilot = partial(
            Autopilot,
            flavour,
            system_id=specification.system_id,
            readings=self.sensors.readings,
            physics_rate_hz=configuration.physics_rate_hz,
            parameters={
                **flavour.launch_parameters.get(launch or airframe.launch_kind, {}),
                **specification.parameters,
            },
            envelope=_envelope(airframe, configuration) if aircraft else None,
            inject_failure=failures.inject,
            simulation=failures,
            card=card,
            power=self._on_power,
        )
        self._epoch_us = configuration.unix_epoch_us
        self._boot_us = 0
        self._power: PowerAction | None = None
        self._power_us = _NEVER_US  # when it goes down, or boots
        self.autopilot = self._new_autopilot(unix_epoch_us=self._epoch_us)
        self._actuators = self.autopilot.actuators  # written in place
        self._crew_of = partial(LaunchCrew, self.vehicle, step_us=world.step_us)
        self._crew = None if self.vehicle.launcher is None else self._crew_of(self.autopilot.commander)
        self.links = Switchboard(
            self.autopilot,
            system_id=specification.system_id,
            signing=VehicleSigning(
                signing,
                system_id=specification.system_id,
                clock=lambda: signing_time(configuration.unix_epoch_us + world.time_us),
                armed=lambda: self.autopilot.commander.armed,
            ),
        )
        self.crashed = False
        self.truth_encoder = TruthEncoder(specification.system_id, self.vehicle.truth)
        self.payload: PayloadStation | None = None
        if specification.payload != PayloadParameters():
            self._fit(
                Payload(
                    specification.payload,
                    truth=self.vehicle.truth,
                    home=configuration.place,
                    physics_rate_hz=configuration.physics_rate_hz,
                    seeds=lambda name: streams.child("vehicle", index, "sensor", name),
                    targets=targets,
                    magnetic_field=configuration.magnetic_field,
                )
            )

    def _fit(self, payload: Payload) -> None:
        """Put the payload's components onto a link of their own."""
        ours, theirs = memory_pair("vehicle", "payload")
        station = PayloadStation(payload, system_id=self.specification.system_id, send=theirs.send)
        channel = self.open(ours, role="payload")
        ours.on_receive = lambda data: self.take(channel, channel.parse(data))
        theirs.on_receive = station.receive
        self.payload = station

    @property
    def channels(self) -> list[LinkChannel]:
        """Its open links."""
        return self.links.channels

    @property
    def echoes(self) -> int:
        """Frames of its own that came back on a link; they were dropped."""
        return self.links.echoes

    def step(self, time_us: int) -> None:
        """One physics step, ending at `time_us`."""
        if time_us >= self._power_us:
            self._power_cycle(time_us)
        boot_us = self._boot_us
        self.vehicle.step(self._actuators)
        self.sensors.step(time_us - boot_us)
        if time_us > boot_us:
            self.autopilot.step(time_us - boot_us)
        if self.payload is not None:
            self.payload.step(time_us)
        if self._crew is not None and self._crew.watch(time_us):
            self._crew = None
        if self.vehicle.crash is not None and not self.crashed:
            self.crashed = True
            text = self.truth_encoder.encode_text(f"Simulator: {self.vehicle.crash}")
            self.links.send_to_all(text)

    def _on_power(self, action: PowerAction) -> None:
        self._power, self._power_us = action, 0

    def _power_cycle(self, time_us: int) -> None:
        """The autopilot goes down, to boot again a moment later unless it was shut down; or it boots."""
        if self._power is None:
            self._boot_us, self._power_us = time_us, _NEVER_US
            self.autopilot = self._new_autopilot(unix_epoch_us=self._epoch_us + time_us)
            self._actuators = self.autopilot.actuators
            self.links.restart(self.autopilot)
            if self._crew is not None:
                self._crew = self._crew_of(self.autopilot.commander)
            return
        again = self._power is PowerAction.REBOOT
        self._boot_us = self._power_us = time_us + REBOOT_US if again else _NEVER_US
        self._power = None
        self._actuators = np.zeros_like(self._actuators)
        self.autopilot.close()
        self.links.restart(None)

    def open(
        self,
        link: Link,
        *,
        name: str | None = None,
        role: str = "onboard",
        bytes_per_s: float | None = None,
        reach: Reach | None = None,
    ) -> LinkChannel:
        """Give the autopilot one more link.

        Args:
            name: unique per vehicle; None: made from the link.
            role: which default streams run on it ("onboard", "gcs" or "payload").
            bytes_per_s: what the link carries in a second of vehicle time; streams are thinned to fit.
            reach: who can get at it; None: only this process when it is a memory link, else the network.
        """
        return self.links.open(link, name=name, role=role, bytes_per_s=bytes_per_s, reach=reach)

    def close(self, channel: LinkChannel) -> None:
        """Take a link away; the link itself is closed too."""
        self.links.close(channel)

    def poll(self) -> None:
        """Hand everything that has arrived to the autopilot, and forward what is for somebody else."""
        self.links.poll()

    def take(self, channel: LinkChannel, frames: Sequence[Frame]) -> None:
        """Hand frames that came in on a channel to the autopilot and to the channels they are meant for."""
        self.links.take(channel, frames)


def _gps(flavour: str) -> GpsParameters:
    """The receiver, with the start-up that the firmware's own SITL shows."""
    return GpsParameters(fix_timeline=RTK_FIX_AFTER_10_S if flavour == "ardupilot" else FIX_AT_BOOT)


def _envelope(airframe: Airframe, configuration: SitlConfiguration) -> "FlightEnvelope":
    """What an aircraft can do, found by trimming its model."""
    from flightsim.flight_envelope import flight_envelope  # brings scipy, which a multicopter needs not

    return flight_envelope(airframe, home=configuration.place, environment=configuration.environment)


class Sitl:
    """A world of vehicles under autopilots, advanced step by step.

    Args:
        configuration: what it holds.
        signing: how the vehicles sign what they say, and what they believe.
        cards: the vehicles' memory cards; None: empty ones in memory, without logs.

    Attributes:
        configuration: as given.
        world: vehicles and air.
        vehicles: with sensors, autopilots and links.
        targets: on the ground.
        shared_links: those that several vehicles speak on.

    Raises:
        ValueError: a model, flavour or parameter that does not exist or is out of range.
    """

    def __init__(
        self,
        configuration: SitlConfiguration,
        *,
        signing: SigningParameters = _NOT_SIGNED,
        cards: Sequence[MemoryCard] | None = None,
    ) -> None:
        self.configuration = configuration
        self.world = World(
            WorldParameters(
                seed=configuration.seed,
                physics_rate_hz=configuration.physics_rate_hz,
                home=configuration.place,
                environment=configuration.environment,
            )
        )
        streams = self.world.streams
        self.targets = GroundTargets(
            configuration.targets, seeds=lambda target: streams.child("target", target)
        )
        cards = [MemoryCard() for _ in configuration.vehicles] if cards is None else cards
        self.vehicles = tuple(
            SitlVehicle(specification, index, configuration, self.world, self.targets, signing, card)
            for index, (specification, card) in enumerate(zip(configuration.vehicles, cards, strict=True))
        )
        self.shared_links: list[SharedLink] = []
        self._step_us = 1_000_000 // configuration.physics_rate_hz
        self._time_us = 0
        self._poll_us = self._step_us
        self._next_poll_us = _NEVER_US
        self._attended: list[Callable[[int], None]] = []
        self._truth_listeners: list[TruthListener] = []
        self._truth_interval_us = 1_000_000 // TRUTH_RATE_HZ
        self._next_truth_us = _NEVER_US
        self._target_truth = TargetTruthEncoder(self.targets, configuration.place)

    @property
    def time_us(self) -> int:
        """Vehicle time, microseconds since boot."""
        return self._time_us

    @property
    def step_us(self) -> int:
        """Length of a physics step."""
        return self._step_us

    def advance(self) -> None:
        """Make one physics step."""
        time_us = self._time_us + self._step_us
        self._time_us = time_us
        for vehicle in self.vehicles:
            vehicle.step(time_us)
        self.world.advance()
        if time_us >= self._next_poll_us:
            self._next_poll_us = time_us + self._poll_us
            self.poll()
        if time_us >= self._next_truth_us:
            self._next_truth_us = time_us + self._truth_interval_us
            for vehicle in self.vehicles:
                self._tell_truth(time_us, vehicle.truth_encoder.encode(time_us))
            for frame in self._target_truth.encode(time_us):
                self._tell_truth(time_us, frame)

    def _tell_truth(self, time_us: int, frame: bytes) -> None:
        for listener in self._truth_listeners:
            listener(time_us, frame)

    def poll(self) -> None:
        """Take what has arrived on all links, as much of it as there is time for."""
        for shared in self.shared_links:
            shared.poll()
        for vehicle in self.vehicles:
            vehicle.links.poll()
        for look_after in self._attended:
            look_after(self._time_us)

    def attend(self, look_after: Callable[[int], None]) -> None:
        """Have a shell looked after, with vehicle time, whenever real links are."""
        self._attended.append(look_after)

    def filenos(self) -> list[int]:
        """File descriptors of all links, to watch for reading."""
        links = [shared.link for shared in self.shared_links]
        links += [channel.link for vehicle in self.vehicles for channel in vehicle.channels]
        return [number for link in links for number in link.filenos()]

    def share(
        self, link: Link, *, role: str, reach: Reach = Reach.NETWORK, bytes_per_s: float | None = None
    ) -> SharedLink:
        """Open one link for all vehicles together.

        Args:
            link: an open link.
            role: which default streams run on it ("onboard" or "gcs").
            reach: who can get at it.
            bytes_per_s: what it carries in a second of vehicle time; each vehicle gets an equal part.
        """
        shared = SharedLink(link, reach=reach)
        part = None if bytes_per_s is None else bytes_per_s / len(self.vehicles)
        for vehicle in self.vehicles:
            shared.join(vehicle.links, vehicle.specification.system_id, role=role, bytes_per_s=part)
        self.shared_links.append(shared)
        return shared

    def poll_every(self, interval_us: int) -> None:
        """Look at real links every so often (vehicle time); memory links need no polling."""
        self._poll_us = max(self._step_us, interval_us)
        self._next_poll_us = self._time_us + self._poll_us

    def connect(
        self,
        index: int,
        *,
        role: str = "onboard",
        bytes_per_s: float | None = None,
        reach: Reach = Reach.PROCESS,
    ) -> MemoryLink:
        """A memory link to vehicle `index`; the returned end is the client's.

        Args:
            index: of the vehicle.
            role: which default streams run on it.
            bytes_per_s: what it carries in a second of vehicle time.
            reach: whose link it stands for; of this process, it is trusted and never signed.
        """
        vehicle = self.vehicles[index]
        ours, theirs = memory_pair(f"vehicle{index + 1}", f"client{index + 1}")
        channel = vehicle.open(ours, role=role, bytes_per_s=bytes_per_s, reach=reach)
        ours.on_receive = lambda data: vehicle.take(channel, channel.parse(data))
        return theirs

    def record(self, log: TlogWriter) -> list[MemoryLink]:
        """Log what every vehicle says on a link of its own, and the truth, stamped with the vehicles' clock.

        Returns:
            The client's ends of those links, by which the vehicles can be spoken to.
        """
        epoch_us = self.configuration.unix_epoch_us
        links = [self.connect(index) for index in range(len(self.vehicles))]
        for link in links:
            link.on_receive = lambda packet: log.write_packet(epoch_us + self._time_us, packet)
        self.on_truth(lambda time_us, frame: log.write(epoch_us + time_us, frame))
        return links

    def on_truth(self, listener: TruthListener) -> None:
        """Have truth frames delivered at 50 Hz, for the log and the score."""
        self._truth_listeners.append(listener)
        if self._next_truth_us == _NEVER_US:
            self._next_truth_us = self._time_us + self._truth_interval_us

    def close(self) -> None:
        """Close every link, and what the autopilots have open."""
        for vehicle in self.vehicles:
            vehicle.autopilot.close()
            for channel in list(vehicle.channels):
                vehicle.close(channel)
