"""The wiring of a simulation: world, vehicles and links, stepped together.

In a step each vehicle is stepped in turn (`SitlVehicle.step`). Then the world's clock advances, and the data
received on links are passed to the autopilots.
"""

from collections.abc import Callable, Sequence
from typing import Final, Protocol

from autopilot_bridge.errors import TlogError
from autopilot_bridge.links import Link, MemoryLink, Reach, memory_pair
from autopilot_bridge.sitl.backend import BackendMaker, emulated
from autopilot_bridge.sitl.containment import FailureReport
from autopilot_bridge.sitl.failures import NEVER_US
from autopilot_bridge.sitl.shared_link import SharedLink
from autopilot_bridge.sitl.signing import SigningParameters
from autopilot_bridge.sitl.truth import TRUTH_RATE_HZ, TargetTruthEncoder
from autopilot_bridge.sitl.vehicle import SitlVehicle
from autopilot_bridge.storage.memory import MemoryCard
from flightsim.payload import GroundTargets, MagneticMap, MagneticSpec, TerrainSpec, magnetic_field_of
from flightsim.world import World, WorldParameters
from flightsim.world_spec import WorldSpec

TruthListener = Callable[[int, bytes], None]
"""Called with vehicle time (microseconds) and a truth frame."""

_NOT_SIGNED: Final = SigningParameters()


class PacketLog(Protocol):
    """What receives the messages of vehicles: a `TlogWriter`, or a viewer's feed."""

    def write(self, time_us: int, packet: bytes) -> object:
        """Take frames that were sent together at a Unix time."""
        ...


class Sitl:
    """A world of vehicles under autopilots, advanced step by step.

    Args:
        spec: the content of the world.
        signing: how the vehicles sign their frames, and which frames they accept.
        cards: the vehicles' memory cards; None: empty cards in memory, without logs.
        backend: makes the autopilot of each vehicle.

    Attributes:
        spec: as given.
        world: vehicles and air.
        time_us: vehicle time, microseconds since boot.
        vehicles: with sensors, autopilots and links.
        targets: on the ground.
        published_map: the map that a survey made of the magnetic field; None: there is none.
        shared_links: the links that several vehicles share.

    Raises:
        ValueError: a model, flavour or parameter that does not exist or is out of range.
    """

    def __init__(
        self,
        spec: WorldSpec,
        *,
        signing: SigningParameters = _NOT_SIGNED,
        cards: Sequence[MemoryCard] | None = None,
        backend: BackendMaker = emulated,
    ) -> None:
        self.spec = spec
        self.world = World(
            WorldParameters(
                seed=spec.seed, physics_rate_hz=spec.physics_rate_hz, home=spec.place, environment=spec.air
            )
        )
        streams = self.world.streams
        self.targets = GroundTargets(spec.targets, seeds=lambda target: streams.child("target", target))
        field = spec.magnetic_field
        self.published_map: MagneticMap | None = None
        if isinstance(field, MagneticSpec):
            field, self.published_map = magnetic_field_of(
                field, home=spec.place, seed=spec.seed, decimal_year=spec.air.decimal_year
            )
        terrain = spec.terrain.made(spec.seed) if isinstance(spec.terrain, TerrainSpec) else spec.terrain
        cards = [MemoryCard() for _ in spec.vehicles] if cards is None else cards
        self.vehicles: tuple[SitlVehicle, ...] = ()
        try:
            for index, (vehicle, card) in enumerate(zip(spec.vehicles, cards, strict=True)):
                made = SitlVehicle(
                    vehicle, index, spec, self.world, self.targets, field, terrain, signing, card, backend
                )
                self.vehicles += (made,)
        except BaseException:
            for made in self.vehicles:  # a real firmware's process ends with it
                made.backend.close()
            raise
        self._elsewhere = any(vehicle.computes_elsewhere for vehicle in self.vehicles)
        self.shared_links: list[SharedLink] = []
        self._step_us = 1_000_000 // spec.physics_rate_hz
        self.time_us = 0
        self._poll_us = self._step_us
        self._next_poll_us = NEVER_US
        self._attended: list[Callable[[int], None]] = []
        self._truth_listeners: list[TruthListener] = []
        self._truth_interval_us = 1_000_000 // TRUTH_RATE_HZ
        self._next_truth_us = NEVER_US
        self._target_truth = TargetTruthEncoder(self.targets, spec.place)

    @property
    def step_us(self) -> int:
        """Length of a physics step."""
        return self._step_us

    def advance(self) -> None:
        """Make one physics step."""
        time_us = self.time_us + self._step_us
        self.time_us = time_us
        if self._elsewhere:
            for vehicle in self.vehicles:
                vehicle.begin_step(time_us)
            for vehicle in self.vehicles:
                vehicle.end_step(time_us)
        else:
            for vehicle in self.vehicles:
                vehicle.step(time_us)
        self.world.advance()
        if time_us >= self._next_poll_us:
            self._next_poll_us = time_us + self._poll_us
            self.poll()
        if time_us >= self._next_truth_us:
            self._next_truth_us = time_us + self._truth_interval_us
            for vehicle in self.vehicles:
                if vehicle.stopped:
                    continue
                self._report_truth(time_us, vehicle.truth_encoder.encode(time_us))
            for frame in self._target_truth.encode(time_us):
                self._report_truth(time_us, frame)

    def _report_truth(self, time_us: int, frame: bytes) -> None:
        for listener in self._truth_listeners:
            listener(time_us, frame)

    def contain(self, report: FailureReport) -> None:
        """Let a vehicle that fails end alone from now on (`sitl.containment`), and report it."""
        for vehicle in self.vehicles:
            vehicle.contain(report)

    def poll(self) -> None:
        """Receive from all links, as much as the time budget allows."""
        for shared in self.shared_links:
            shared.poll()
        for vehicle in self.vehicles:
            vehicle.links.poll()
        for look_after in self._attended:
            look_after(self.time_us)

    def attend(self, look_after: Callable[[int], None]) -> None:
        """Register a function that is called with vehicle time whenever real links are polled."""
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
            reach: which processes can reach the link.
            bytes_per_s: its capacity in a second of vehicle time; each vehicle gets an equal share.
        """
        shared = SharedLink(link, reach=reach)
        part = None if bytes_per_s is None else bytes_per_s / len(self.vehicles)
        for vehicle in self.vehicles:
            shared.join(vehicle.links, vehicle.specification.system_id, role=role, bytes_per_s=part)
        self.shared_links.append(shared)
        return shared

    def poll_every(self, interval_us: int) -> None:
        """Set the interval at which real links are polled (vehicle time); memory links need no polling."""
        self._poll_us = max(self._step_us, interval_us)
        self._next_poll_us = self.time_us + self._poll_us

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
            bytes_per_s: its capacity in a second of vehicle time.
            reach: the kind of link that it represents; a link within this process is trusted and never
                signed.
        """
        vehicle = self.vehicles[index]
        ours, theirs = memory_pair(f"vehicle{index + 1}", f"client{index + 1}")
        channel = vehicle.open(ours, role=role, bytes_per_s=bytes_per_s, reach=reach)
        ours.on_receive = lambda data: vehicle.take(channel, channel.parse(data))
        return theirs

    def record(self, log: PacketLog, on_failure: Callable[[str], None] | None = None) -> list[MemoryLink]:
        """Log every vehicle's messages on a separate link, and the truth, stamped with the vehicles' clock.

        Args:
            on_failure: called once with the reason when the log can't be written any more: the log ends
                there, but the vehicles keep flying. None: the step raises that TlogError.

        Returns:
            The client's ends of those links, on which a client can send messages to the vehicles.
        """
        epoch_us = self.spec.unix_epoch_us
        links = [self.connect(index) for index in range(len(self.vehicles))]
        failed = False

        def keep(time_us: int, packet: bytes) -> None:
            nonlocal failed
            if not failed:
                try:
                    log.write(epoch_us + time_us, packet)
                except TlogError as error:
                    if on_failure is None:
                        raise
                    failed = True
                    on_failure(str(error))

        for link in links:
            link.on_receive = lambda packet: keep(self.time_us, packet)
        self.on_truth(keep)
        return links

    def on_truth(self, listener: TruthListener) -> None:
        """Register a listener for truth frames at 50 Hz, for the log and the score."""
        self._truth_listeners.append(listener)
        if self._next_truth_us == NEVER_US:
            self._next_truth_us = self.time_us + self._truth_interval_us

    def close(self) -> None:
        """Close every link, and the open files of the autopilots."""
        for vehicle in self.vehicles:
            vehicle.backend.close()
            for channel in list(vehicle.channels):
                vehicle.close(channel)
