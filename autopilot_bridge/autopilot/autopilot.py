"""The emulated autopilot: navigation, control, commander and MAVLink services around sensor readings.

Execution order of a physics step: navigation filter; every fifth step (50 Hz) the slow loop (commander with
its flight task, services, events); control laws; streams that are due. Nothing here sleeps, opens or reads a
clock.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.autopilot.channels import AutopilotChannel, ChannelStreams
from autopilot_bridge.autopilot.flown_mission import FlownMission
from autopilot_bridge.autopilot.status import NavigationJudgement, StatusReport
from autopilot_bridge.autopilot.status_text import StatusTextService
from autopilot_bridge.commander import events
from autopilot_bridge.commander.commander import Commander
from autopilot_bridge.commander.health import HealthMonitor
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.firmware.external_mapping import connected
from autopilot_bridge.firmware.flavour import Flavour
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.mavlink import Frame, decode, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mission_plan import MissionType
from autopilot_bridge.navigation import NavigationFilter
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import Command
from autopilot_bridge.services.commands.message_interval import MessageIntervalService
from autopilot_bridge.services.commands.protocol import CommandService
from autopilot_bridge.services.microservice import Microservice, receivers_by_id
from autopilot_bridge.services.parameters.parameter_file import boot_parameters
from autopilot_bridge.services.parameters.protocol import ParameterService, fix_identity
from autopilot_bridge.services.parts import AutopilotParts, FailureHook, Simulation
from autopilot_bridge.services.plans.geofence import MissionFence
from autopilot_bridge.services.plans.protocol import MissionService, new_stores
from autopilot_bridge.services.vehicle_memory import LOG_ROLE, PowerHook, VehicleMemory
from autopilot_bridge.storage.memory import MemoryCard
from autopilot_bridge.telemetry.line import MICROSECONDS
from autopilot_bridge.telemetry.motion import MotionMessages
from autopilot_bridge.telemetry.streams import PayloadCache
from autopilot_bridge.telemetry.view import TelemetryView
from flightsim.interface import SensorReadings

if TYPE_CHECKING:  # its module imports scipy
    from flightsim.flight_envelope import FlightEnvelope

SLOW_RATE_HZ: Final = 50
_TURNS: Final = 5  # iterations of the slow loop; microservices with `coarse_timers` are called in one of them
_ALWAYS_ANSWERED: Final = frozenset({dialect.MAVLINK_MSG_ID_TIMESYNC, dialect.MAVLINK_MSG_ID_PING})

EntryT = TypeVar("EntryT")


class _TypedParameters(NamedTuple):
    """What the parts of the autopilot use of the parameters; control laws and flight differ by vehicle."""

    navigation: NavigationParameters
    controller: Any
    flight: Any
    commander: CommanderParameters


class Autopilot:
    """One vehicle's autopilot.

    Args:
        flavour: which firmware it emulates.
        system_id: MAVLink system id; the component id is 1.
        readings: the vehicle's sensors, written before each `step`.
        physics_rate_hz: calls of `step` per second.
        parameters: values that differ from the flavour's defaults.
        envelope: the aircraft's flight envelope; None for a multicopter.
        unix_epoch_us: Unix time of boot.
        inject_failure: executes MAV_CMD_INJECT_FAILURE; None: not supported.
        simulation: the simulated world; None: there is none.
        card: its memory card; None: an empty one in memory.
        power: restarts the vehicle, or shuts it down; None: not possible.

    Attributes:
        actuators: motor commands of the newest step (flightsim.interface).
        commander, navigation, controller, parameters, context, commands: the parts, for tests and benchmarks.

    Raises:
        ParameterError: an override names an unknown parameter or is out of its range.
        ValueError: the physics rate is no multiple of 50 Hz.
    """

    def __init__(
        self,
        flavour: Flavour,
        *,
        system_id: int,
        readings: SensorReadings,
        physics_rate_hz: int,
        parameters: Mapping[str, float] | None = None,
        envelope: "FlightEnvelope | None" = None,
        unix_epoch_us: int = 0,
        inject_failure: FailureHook | None = None,
        simulation: Simulation | None = None,
        card: MemoryCard | None = None,
        power: PowerHook | None = None,
    ) -> None:
        if physics_rate_hz % SLOW_RATE_HZ:
            raise ValueError(f"physics rate {physics_rate_hz} Hz is not a multiple of {SLOW_RATE_HZ} Hz")
        self.flavour = flavour
        self.system_id = system_id
        self.channels: list[AutopilotChannel] = []
        self._simulation = simulation
        self._address = flavour.services.address(system_id)
        self._divisor = physics_rate_hz // SLOW_RATE_HZ
        self._until_slow = self._divisor
        self._time_us = 0

        self._vehicle = {} if envelope is None else {"envelope": envelope}
        airframe = dict(flavour.airframe)
        if envelope is not None and flavour.airframe_of is not None:
            airframe.update(flavour.airframe_of(envelope))
        self.parameters = ParameterStore(flavour.parameter_definitions(), {**airframe, **(parameters or {})})
        fix_identity(self.parameters, flavour.services.parameters, system_id)
        card = card or MemoryCard()
        memory = VehicleMemory(
            card=card,
            stored=boot_parameters(
                self.parameters,
                card,
                flavour.services.card,
                system_id=system_id,
                given=parameters or {},
                check=self._typed_parameters,
            ),
            time_us=self._now_us,
            unix_epoch_us=unix_epoch_us,
            add_channel=self.add_channel,
            remove_channel=self.remove_channel,
            power=power,
        )
        self._build_core(connected(readings, flavour.gps_source(self.parameters)), physics_rate_hz)
        self._texts = StatusTextService(flavour, self)
        plans = FlownMission(self.commander)
        self.missions = MissionService(
            flavour.services.missions,
            self._stores,
            self,
            self._texts.announce,
            home=plans.home,
            progress=plans,
            on_plan_changed=plans.plan_changed,
            parameters=self.parameters,
            fence=MissionFence(self.commander),
            landed=plans.landed,
        )
        self._parameter_service = ParameterService(
            self.parameters,
            flavour.services.parameters,
            self,
            on_list=self._texts.banner,
            on_fixed=self._report_fixed,
        )
        self._connect_services(plans, memory, inject_failure, physics_rate_hz)
        if simulation is not None:
            simulation.connect(self.parameters, self._lose_radio)
        self.parameters.subscribe(self._on_parameter)

    def _build_core(self, readings: SensorReadings, physics_rate_hz: int) -> None:
        """Navigation filter, control laws and commander, which share state in place."""
        flavour, typed = self.flavour, self._typed_parameters()
        self._readings = readings
        self._stores = stores = new_stores()
        self.navigation = NavigationFilter(
            typed.navigation, readings=readings, physics_rate_hz=physics_rate_hz, frame_at=flavour.frame_at
        )
        self.controller = flavour.flight.controller(
            typed.controller, physics_rate_hz=physics_rate_hz, nav=self.navigation.state
        )
        self.context = context = FlightContext(
            nav=self.navigation.state, setpoint=self.controller.setpoint, parameters=typed.flight
        )
        context.health = self.navigation.health
        context.attitude_setpoint = self.controller.attitude_setpoint
        context.rally = stores[MissionType.RALLY]
        self.commander = Commander(
            context,
            policy=flavour.policy,
            parameters=typed.commander,
            vehicle=flavour.flight.vehicle_tasks(context, stores[MissionType.MISSION], flavour.policy),
            health=HealthMonitor(
                readings,
                NavigationJudgement(self.navigation),
                airspeed=flavour.flight.has_airspeed,
                gps_may_repeat=self.navigation.parameters.gps_may_repeat,
            ),
            land_detector=flavour.flight.land_detector(),
            thrust=self._thrust,
            missions=stores[MissionType.MISSION],
            fence=stores[MissionType.FENCE],
            mission_valid=self._mission_valid,
        )

    def _connect_services(
        self,
        plans: FlownMission,
        memory: VehicleMemory,
        inject_failure: FailureHook | None,
        physics_rate_hz: int,
    ) -> None:
        """Make the services, and the tables of what they receive, execute and send."""
        flavour, announce = self.flavour, self._texts.announce
        rules = flavour.services
        self._view = TelemetryView(self.context, self.navigation.state, self._readings)
        motion = MotionMessages(self._view, self.context, self.navigation, self._readings)
        cache = PayloadCache(motion.builders)
        self._streams = ChannelStreams(
            self.channels,
            flavour=flavour,
            parameters=self.parameters,
            cache=cache,
            motion=motion,
            physics_step_us=MICROSECONDS // physics_rate_hz,
        )
        self.intervals = MessageIntervalService(rules.intervals, self._streams.tables, cache, announce)
        parts = AutopilotParts(
            kind=flavour.kind,
            system_id=self.system_id,
            commander=self.commander,
            navigation=self.navigation,
            controller=self.controller,
            parameters=self.parameters,
            readings=self._readings,
            stores=self._stores,
            missions=rules.missions,
            broadcast=self,
            announce=announce,
            banner=self._texts.banner,
            memory=memory,
            view=self._view,
            status=StatusReport(flavour, self.commander),
            intervals=self.intervals,
            set_current_item=self.missions.set_current,
            inject_failure=inject_failure,
            simulation=self._simulation,
            execute=self._execute,
        )
        of_firmware = rules.make(parts)
        self.commands = CommandService(
            flavour.command_address(self.system_id), merged(*(service.commands for service in of_firmware))
        )
        # the order in which they get messages and timers
        self._services: tuple[Microservice, ...] = (
            self.commands,
            self._parameter_service,
            self.missions,
            *of_firmware,
            self.intervals,
            plans,
            self._streams,
            self._texts,
        )
        for service in self._services:
            cache.add(service.builders)
            self.intervals.requested.update(service.on_demand)
        self._receivers = receivers_by_id(self._services)
        timed = [service for service in self._services if type(service).tick is not Microservice.tick]
        self._timed = tuple(service for service in timed if not service.coarse_timers)
        coarse_timers = [service for service in timed if service.coarse_timers]
        self._coarse_timers = tuple(coarse_timers[turn::_TURNS] for turn in range(_TURNS))
        self._turn = 0
        # the text of an event comes before what else it causes
        self._followers = (
            self._texts,
            *(service for service in self._services[:-1] if type(service).follow is not Microservice.follow),
        )

    # interface to the simulator

    @property
    def actuators(self) -> NDArray[np.float64]:
        """Motor commands (MAX_ACTUATORS,), written in place."""
        return self.controller.actuators

    def step(self, time_us: int) -> None:
        """One physics step, after the readings were written."""
        self._time_us = time_us
        self.navigation.step(time_us)
        self._until_slow -= 1
        if self._until_slow == 0:
            self._until_slow = self._divisor
            self._slow(time_us)
        self.controller.step()
        for table in self._streams.running:
            if table.next_due_us <= time_us:
                self._view.advance(time_us)
                table.tick(time_us)

    # interface to the links

    def add_channel(self, channel: AutopilotChannel, role: str) -> None:
        """Start the default streams of a role ("onboard", "gcs" or "payload") on one more channel.

        Raises:
            ValueError: unknown role, or a channel of that name is there already.
        """
        first_us = round(self.flavour.policy.heartbeat_start_s * 1e6)
        self._streams.add(channel, role=role, time_us=self._time_us, heartbeat_us=first_us)
        if role == LOG_ROLE:
            self._parameter_service.list_on(channel)

    def close(self) -> None:
        """Shut down: close open files and store pending data."""
        for service in self._services:
            service.close()

    def remove_channel(self, channel: AutopilotChannel) -> None:
        """Stop all streams and answers on a channel."""
        self._streams.remove(channel)

    def receive(self, frame: Frame, channel: AutopilotChannel) -> None:
        """Take one frame from a channel. Contents are untrusted and never raise."""
        if frame.system_id == self.system_id and frame.component_id == AUTOPILOT_COMPONENT:
            return
        receivers = self._receivers.get(frame.message_id)
        if receivers is None:
            return
        message = decode(frame)
        if self._simulation is not None and self._simulation.drops_message(getattr(message, "command", None)):
            return
        if frame.message_id not in _ALWAYS_ANSWERED and not self._address.accepts(message):
            return
        source = Source(channel, frame.system_id, frame.component_id)
        for receiver in receivers:
            receiver(message, source, self._time_us)

    # internal

    def _slow(self, time_us: int) -> None:
        context, navigation = self.context, self.navigation
        context.frame = navigation.frame
        context.hover_thrust = self.controller.hover_thrust
        self._view.vibration.update()
        self.commander.update(time_us)
        self.controller.set_ground_contact(context.ground_contact)
        navigation.vehicle_at_rest = context.on_ground and not self.commander.tasks.lifting_off
        self._view.advance(time_us)
        self._streams.advance(time_us)
        for service in self._timed:
            service.tick(time_us)
        self._turn = turn = (self._turn + 1) % _TURNS
        for service in self._coarse_timers[turn]:
            service.tick(time_us)
        for event in self.commander.drain_events():
            self._follow(event)

    def _follow(self, event: events.Event) -> None:
        """Pass an event of the vehicle to the other parts of the autopilot."""
        for follower in self._followers:
            follower.follow(event)

    def _typed_parameters(self) -> _TypedParameters:
        """The parameters as the parts use them.

        Raises:
            ValueError, ArithmeticError: there is no vehicle with such parameters.
        """
        flavour, store = self.flavour, self.parameters
        return _TypedParameters(
            navigation=flavour.navigation_parameters(store),
            controller=flavour.controller_parameters(store, **self._vehicle),
            flight=flavour.flight_parameters(store, **self._vehicle),
            commander=flavour.commander_parameters(store),
        )

    def _on_parameter(self, name: str, value: float) -> None:
        typed = self._typed_parameters()
        self.controller.set_parameters(typed.controller)
        self.commander.guidance.set_parameters(typed.flight)
        self.commander.parameters = typed.commander
        self.navigation.set_parameters(typed.navigation)
        self._streams.change(name, self._time_us)

    def _report_fixed(self, name: str) -> None:
        value = self.parameters.get(name)
        self._texts.announce(dialect.MAV_SEVERITY_WARNING, f"{name} stays {value:g}: given by the simulation")

    def _lose_radio(self, failed: bool) -> None:
        self.commander.pilot.lose_signal(failed, self.commander.time_us)

    def _now_us(self) -> int:
        return self._time_us

    def _thrust(self) -> float:
        return float(self.controller.thrust)

    def _mission_valid(self) -> bool:
        return self.missions.mission_valid(landed=self.commander.landed)

    def _execute(self, command: Command) -> Result | None:
        return self.commands.carry_out(command)


def merged(*tables: Mapping[int, EntryT]) -> dict[int, EntryT]:
    """One table from several, by number; for a number in several tables, the last entry."""
    return {number: entry for table in tables for number, entry in table.items()}
