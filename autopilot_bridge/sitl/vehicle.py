"""One vehicle of a SITL: JSBSim's vehicle, sensors, autopilot, payload and links, and its reboots.

Execution order of a step: vehicle dynamics, sensors, autopilot (navigation, slow loop, control, streams),
payload.
"""

import contextlib
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

import numpy as np

from autopilot_bridge.autopilot import Autopilot
from autopilot_bridge.firmware.simulator import simulator_defaults
from autopilot_bridge.links import Link, Reach, memory_pair
from autopilot_bridge.mavlink import Frame
from autopilot_bridge.mavlink.signing import signing_time
from autopilot_bridge.payload import PayloadStation
from autopilot_bridge.services.vehicle_memory import PowerAction
from autopilot_bridge.sitl.backend import (
    AutopilotBackend,
    BackendMaker,
    BackendSetup,
    ComputesElsewhere,
    EmulatedBackend,
    ReadsParameters,
)
from autopilot_bridge.sitl.channel import LinkChannel
from autopilot_bridge.sitl.containment import Aftermath, FailureReport, Probation, VehicleFailure, reason_of
from autopilot_bridge.sitl.failures import NEVER_US, FailureInjector, FaultSchedule
from autopilot_bridge.sitl.launch_crew import LaunchCrew
from autopilot_bridge.sitl.signing import SigningParameters, VehicleSigning
from autopilot_bridge.sitl.switchboard import Switchboard
from autopilot_bridge.sitl.truth import TruthEncoder
from autopilot_bridge.storage.memory import MemoryCard
from flightsim.airframe import AirframeKind, LaunchKind
from flightsim.initial_state import InitialState
from flightsim.interface import MAX_ACTUATORS
from flightsim.payload import Carrier, GroundTargets, MagneticField, Payload, Terrain
from flightsim.sensors import GpsParameters, SensorSuite, SensorSuiteParameters
from flightsim.world import World
from flightsim.world_spec import VehicleSpec, WorldSpec

REBOOT_US: Final = 1_000_000
"""Time from the shutdown of a rebooting autopilot until it starts again."""


class SitlVehicle:
    """One vehicle with its sensors, autopilot and channels.

    Attributes:
        vehicle: the JSBSim vehicle.
        sensors: its sensor suite; `sensors.faults` switches failures.
        failures: executes MAV_CMD_INJECT_FAILURE.
        backend: its autopilot.
        station: its payload, as MAVLink components on a separate link; None: no payload.
        links: its open links with their peers, and its signing key.
        crashed: the vehicle has crashed; clients were informed.
        stopped: a failure of its simulation was contained, and it stays stopped.
    """

    def __init__(
        self,
        specification: VehicleSpec,
        index: int,
        world_spec: WorldSpec,
        world: World,
        targets: GroundTargets,
        magnetic_field: MagneticField | None,
        terrain: Terrain | None,
        signing: SigningParameters,
        card: MemoryCard,
        backend: BackendMaker,
    ) -> None:
        streams = world.streams
        self.specification = specification
        launch = None if specification.launch is None else LaunchKind(specification.launch)
        self.vehicle = world.add_vehicle(
            specification.model,
            initial=InitialState(
                offset_ne_m=specification.offset_ne_m, launch=launch, battery_ah=specification.battery_ah
            ),
        )
        airframe = self.vehicle.airframe
        aircraft = airframe.kind is AirframeKind.FIXED_WING
        self.sensors = SensorSuite(
            specification.sensors or usual_sensors(specification, aircraft=aircraft),
            physics_rate_hz=world_spec.physics_rate_hz,
            truth=self.vehicle.truth,
            seeds=lambda name: streams.child("vehicle", index, "sensor", name),
        )
        self.failures = FailureInjector(self.vehicle, self.sensors)
        own = [fault for fault in world_spec.faults if fault.vehicle == specification.system_id]
        self._faults = FaultSchedule(own, self.failures)
        self._epoch_us = world_spec.unix_epoch_us
        self._boot_us = 0
        self._power: PowerAction | None = None
        self._power_us = NEVER_US  # time of the shutdown or the boot
        self._starts_again = False  # the vehicle too, at the boot
        self._boot = backend(
            BackendSetup(
                vehicle=specification,
                world=world_spec,
                airframe=airframe,
                readings=self.sensors.readings,
                truth=self.vehicle.truth,
                failures=self.failures,
                card=card,
                power=self._on_power,
            )
        )
        self._off = np.zeros(MAX_ACTUATORS)
        self._actuators = self._off
        self._crew_of = partial(LaunchCrew, self.vehicle, step_us=world.step_us)
        self._crew: LaunchCrew | None = None
        self.backend, self._elsewhere = self._booted(self._epoch_us)
        if self.vehicle.launcher is not None:
            self._crew = self._crew_of(self.backend)
        self.links = Switchboard(
            self.backend.links,
            system_id=specification.system_id,
            signing=VehicleSigning(
                signing,
                system_id=specification.system_id,
                clock=lambda: signing_time(world_spec.unix_epoch_us + world.time_us),
                armed=lambda: self.backend.armed,
            ),
        )
        self.crashed = False
        self.stopped = False
        self._time_us = 0
        self._begun = False
        self._card = card
        self._report_failure: FailureReport | None = None
        self._probation = Probation()
        self.truth_encoder = TruthEncoder(specification.system_id, self.vehicle.truth)
        self.station: PayloadStation | None = None
        if specification.payload.devices:
            carrier = Carrier(
                truth=self.vehicle.truth,
                home=world_spec.place,
                physics_rate_hz=world_spec.physics_rate_hz,
                seeds=lambda name: streams.child("vehicle", index, "sensor", name),
                targets=targets,
                magnetic_field=magnetic_field,
                terrain=terrain,
                others=lambda: [
                    (other.system_id, vehicle.truth)
                    for other, vehicle in zip(world_spec.vehicles, world.vehicles, strict=True)
                    if vehicle is not self.vehicle and other.payload.range_radio is not None
                ],
            )
            self._fit(Payload(specification.payload, carrier))

    def _booted(self, unix_epoch_us: int) -> tuple[AutopilotBackend, ComputesElsewhere | None]:
        """A backend that has just booted, and the same one again if it computes elsewhere."""
        backend = self._boot(unix_epoch_us)
        return backend, backend if isinstance(backend, ComputesElsewhere) else None

    def _fit(self, payload: Payload) -> None:
        """Connect the payload's components on a separate link."""
        ours, theirs = memory_pair("vehicle", "payload")
        station = PayloadStation(payload, system_id=self.specification.system_id, send=theirs.send)
        channel = self.open(ours, role="payload")
        ours.on_receive = lambda data: self.take(channel, channel.parse(data))
        theirs.on_receive = station.receive
        self.station = station

    @property
    def autopilot(self) -> Autopilot:
        """The emulated autopilot.

        Raises:
            TypeError: the vehicle has another backend.
        """
        if not isinstance(self.backend, EmulatedBackend):
            raise TypeError(f"the autopilot of vehicle {self.specification.system_id} is not emulated")
        return self.backend.autopilot

    def parameter_values(self, names: Sequence[str]) -> dict[str, float]:
        """Parameters of its autopilot, read without a message; names that it does not have are left out."""
        return self.backend.parameter_values(names) if isinstance(self.backend, ReadsParameters) else {}

    @property
    def channels(self) -> list[LinkChannel]:
        """Its open links."""
        return self.links.channels

    @property
    def echoes(self) -> int:
        """The vehicle's own frames that came back on a link; they were dropped."""
        return self.links.echoes

    def contain(self, report: FailureReport) -> None:
        """Contain failures of this vehicle from now on (`sitl.containment`), and report them."""
        self._report_failure = report
        self.links.contain(self._fail)

    @property
    def computes_elsewhere(self) -> bool:
        """Whether its autopilot is another process, which computes between `begin_step` and `end_step`."""
        return self._elsewhere is not None

    def step(self, time_us: int) -> None:
        """One physics step, ending at `time_us`."""
        self.begin_step(time_us)
        self.end_step(time_us)

    def begin_step(self, time_us: int) -> None:
        """The first part of a step: motion and sensors, up to where the autopilot computes."""
        self._time_us = time_us
        self._begun = not self.stopped
        if self._begun:
            self._contained(self._begin, time_us)

    def end_step(self, time_us: int) -> None:
        """The second part of a step: autopilot and payload. Nothing, after a failure in the first part."""
        if self._begun:
            self._contained(self._end, time_us)

    def _contained(self, part: Callable[[int], None], time_us: int) -> None:
        try:
            part(time_us)
        except Exception as error:
            self._begun = False
            if self._report_failure is None:
                raise
            self._fail(error)

    def _begin(self, time_us: int) -> None:
        if time_us >= self._power_us:
            self._power_cycle(time_us)
        if time_us >= self._faults.next_us:
            self._faults.apply(time_us)
        boot_us = self._boot_us
        self.vehicle.step(self._actuators)
        self.sensors.step(time_us - boot_us)
        if time_us > boot_us and self._elsewhere is not None:
            self._elsewhere.begin_step(time_us - boot_us)

    def _end(self, time_us: int) -> None:
        boot_us = self._boot_us
        if time_us > boot_us:
            actuators = self.backend.step(time_us - boot_us)
            if self._boot_us == boot_us:  # it did not fail on a frame that it was sent within the step
                self._actuators = actuators
        if self.station is not None:
            self.station.step(time_us)
        if self._crew is not None and self._crew.watch(time_us):
            self._crew = None
        if self.vehicle.crash is not None and not self.crashed:
            self.crashed = True
            text = self.truth_encoder.encode_text(f"Simulator: {self.vehicle.crash}")
            self.links.send_to_all(text)

    def _fail(self, error: Exception) -> None:
        """Stop the vehicle after a failure, report it, and let it start again if that can help.

        Its simulated part starts again at once, as the motion may be undefined; its autopilot boots after
        `REBOOT_US`.
        """
        assert self._report_failure is not None
        if self.stopped:
            return
        aftermath = self._probation.judge(self._time_us)
        with contextlib.suppress(Exception):  # it has failed already
            self.backend.close()
        self.links.restart(None)
        self._actuators = self._off
        self._crew = None
        try:
            self.vehicle.reset()
        except Exception:  # noqa: BLE001 - nothing of it can be simulated any more
            aftermath = Aftermath.LEFT_STOPPED
        self.failures.vehicle_restarted()
        self.crashed = False
        if aftermath is Aftermath.STARTS_WITHOUT_STORED:
            self._card.parameters_trusted = False
        self._power, self._starts_again = None, True
        self._boot_us = self._power_us = self._time_us + REBOOT_US
        self.stopped = aftermath is Aftermath.LEFT_STOPPED
        failure = VehicleFailure(
            system_id=self.specification.system_id,
            time_us=self._time_us,
            reason=reason_of(error),
            aftermath=aftermath,
        )
        self.links.send_to_all(self.truth_encoder.encode_text(f"Simulator: failed, {aftermath.short}"))
        self._report_failure(failure)

    def _on_power(self, action: PowerAction, starts_again: bool) -> None:
        self._power, self._power_us, self._starts_again = action, 0, starts_again

    def _power_cycle(self, time_us: int) -> None:
        """Shut the autopilot down, to boot after `REBOOT_US` unless it is to stay down; or boot it."""
        if self._power is None:
            self._boot_us, self._power_us = time_us, NEVER_US
            self.backend, self._elsewhere = self._booted(self._epoch_us + time_us)
            self.links.restart(self.backend.links)
            if self._crew is not None or (self._starts_again and self.vehicle.launcher is not None):
                self._crew = self._crew_of(self.backend)
            return
        again = self._power is PowerAction.REBOOT
        self._boot_us = self._power_us = time_us + REBOOT_US if again else NEVER_US
        self._power = None
        if again and self._starts_again:
            self.vehicle.reset()
            self.crashed = False
        self._actuators = self._off
        self.backend.close()
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
        """Add a link to the autopilot; see `Switchboard.open`."""
        return self.links.open(link, name=name, role=role, bytes_per_s=bytes_per_s, reach=reach)

    def close(self, channel: LinkChannel) -> None:
        """Remove a channel and close its link."""
        self.links.close(channel)

    def poll(self) -> None:
        """Pass all received frames to the autopilot, and forward those for other systems."""
        self.links.poll()

    def take(self, channel: LinkChannel, frames: Sequence[Frame]) -> None:
        """Pass frames received on a channel to the autopilot and to the channels they are addressed to."""
        self.links.take(channel, frames)


def usual_sensors(specification: VehicleSpec, *, aircraft: bool) -> SensorSuiteParameters:
    """The sensors of a vehicle of this kind; its receiver starts as in the firmware's own SITL."""
    timeline = simulator_defaults(specification.autopilot).fix_timelines[specification.gps]
    fitted = SensorSuiteParameters.fixed_wing if aircraft else SensorSuiteParameters
    return fitted(gps=GpsParameters.of(specification.gps, fix_timeline=timeline))
