"""The emulated autopilot: navigation, control, commander and MAVLink services around sensor readings.

Execution order of a physics step: navigation filter; every fifth step (50 Hz) the slow loop (commander with
its flight task, services, events); control laws; streams that are due. Nothing here sleeps, opens or reads a
clock.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.autopilot.channels import AutopilotChannel, ChannelStreams
from autopilot_bridge.autopilot.status import NavigationJudgement, StatusReport
from autopilot_bridge.autopilot.status_text import StatusTextService
from autopilot_bridge.commander import events
from autopilot_bridge.commander.commander import Commander
from autopilot_bridge.commander.health import HealthMonitor
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.firmware.external_mapping import connected
from autopilot_bridge.firmware.flavour import Flavour
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.mavlink import Frame, decode
from autopilot_bridge.mavlink import dialect as mavlink
from autopilot_bridge.mission_plan import MissionType
from autopilot_bridge.navigation import NavigationFilter
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.handlers import CommandHooks
from autopilot_bridge.services.commands.message_interval import MessageIntervalService
from autopilot_bridge.services.commands.protocol import CommandService
from autopilot_bridge.services.inputs.radio import RadioService
from autopilot_bridge.services.inputs.setpoints import SetpointService
from autopilot_bridge.services.inputs.timesync import TimeSyncService
from autopilot_bridge.services.microservice import Microservice, receivers_by_id
from autopilot_bridge.services.parameters.parameter_file import boot_parameters
from autopilot_bridge.services.parameters.protocol import ParameterService, fix_identity
from autopilot_bridge.services.parts import AutopilotParts, Simulation
from autopilot_bridge.services.plans.geofence import MissionFence
from autopilot_bridge.services.plans.messages import extended_payload
from autopilot_bridge.services.plans.protocol import MissionService, new_stores
from autopilot_bridge.services.vehicle_memory import LOG_ROLE, PowerHook, VehicleMemory
from autopilot_bridge.storage.memory import MemoryCard
from autopilot_bridge.telemetry.common import CommonMessages, TelemetrySources
from autopilot_bridge.telemetry.line import MICROSECONDS
from autopilot_bridge.telemetry.streams import PayloadCache
from autopilot_bridge.telemetry.view import TelemetryView
from flightsim.interface import SensorReadings

if TYPE_CHECKING:  # its module imports scipy
    from flightsim.flight_envelope import FlightEnvelope

SLOW_RATE_HZ: Final = 50
_TURNS: Final = 5  # iterations of the slow loop; microservices with `coarse_timers` are called in one of them
_COMPONENT: Final = 1
_ALWAYS_ANSWERED: Final = frozenset({mavlink.MAVLINK_MSG_ID_TIMESYNC, mavlink.MAVLINK_MSG_ID_PING})

FailureHook = Callable[[int, int, int], Result]
EntryT = TypeVar("EntryT")


class _TypedParameters(NamedTuple):
    """What the parts of the autopilot use of the parameters; control laws and flight differ by vehicle."""

    navigation: NavigationParameters
    controller: Any
    flight: Any
    commander: CommanderParameters


class _Progress:
    """The mission being flown, as the mission protocol sees it."""

    def __init__(self, commander: Commander) -> None:
        self._commander = commander
        self.complete = False

    @property
    def active(self) -> bool:
        """The mission mode is selected."""
        return self._commander.mode is FlightMode.MISSION


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
        firmware = flavour.services
        self.flavour = flavour
        self.system_id = system_id
        self.channels: list[AutopilotChannel] = []
        self._firmware = firmware
        self._simulation = simulation
        self._address = firmware.address(system_id)
        self._divisor = physics_rate_hz // SLOW_RATE_HZ
        self._until_slow = self._divisor
        self._time_us = 0

        self._vehicle = {} if envelope is None else {"envelope": envelope}
        airframe = dict(flavour.airframe)
        if envelope is not None and flavour.airframe_of is not None:
            airframe.update(flavour.airframe_of(envelope))
        self.parameters = ParameterStore(flavour.parameter_definitions(), {**airframe, **(parameters or {})})
        fix_identity(self.parameters, firmware.parameters, system_id)
        card = card or MemoryCard()
        memory = VehicleMemory(
            card=card,
            stored=boot_parameters(
                self.parameters,
                card,
                firmware.card,
                system_id=system_id,
                given=parameters or {},
                check=self._typed_parameters,
            ),
            time_us=lambda: self._time_us,
            unix_epoch_us=unix_epoch_us,
            add_channel=lambda channel, role: self.add_channel(channel, role=role),
            remove_channel=self.remove_channel,
            power=power,
        )
        readings = connected(readings, flavour.gps_source(self.parameters))
        self._readings = readings
        typed = self._typed_parameters()
        self.navigation = NavigationFilter(
            typed.navigation, readings=readings, physics_rate_hz=physics_rate_hz
        )
        self.controller = flavour.controller(
            typed.controller, physics_rate_hz=physics_rate_hz, nav=self.navigation.state
        )
        self.context = FlightContext(
            nav=self.navigation.state, setpoint=self.controller.setpoint, parameters=typed.flight
        )
        self.context.health = self.navigation.health
        self.context.attitude_setpoint = self.controller.attitude_setpoint
        stores = new_stores()
        self.context.rally = stores[MissionType.RALLY]
        self.commander = Commander(
            self.context,
            policy=flavour.policy,
            parameters=typed.commander,
            vehicle=flavour.vehicle_tasks(self.context, stores[MissionType.MISSION], flavour.policy),
            health=HealthMonitor(
                readings,
                NavigationJudgement(self.navigation),
                airspeed=flavour.has_airspeed,
                gps_may_repeat=self.navigation.parameters.gps_may_repeat,
            ),
            land_detector=flavour.land_detector(),
            thrust=lambda: self.controller.thrust,
            missions=stores[MissionType.MISSION],
            fence=stores[MissionType.FENCE],
            mission_valid=lambda: self.missions.mission_valid(landed=self.commander.landed),
        )
        self._progress = _Progress(self.commander)
        self._texts = StatusTextService(flavour, self)
        self.missions = MissionService(
            firmware.missions,
            stores,
            self,
            self._texts.announce,
            home=lambda: self.commander.home.position,
            progress=self._progress,
            on_plan_changed=self._on_plan_changed,
            parameters=self.parameters,
            fence=MissionFence(self.commander),
            landed=lambda: self.commander.landed,
        )
        self._status = StatusReport(flavour, self.commander)
        self._view = TelemetryView(self.context, self.navigation.state, readings)
        self._messages = self._build_messages(unix_epoch_us)
        parts = AutopilotParts(
            kind=flavour.kind,
            system_id=system_id,
            commander=self.commander,
            navigation=self.navigation,
            parameters=self.parameters,
            readings=readings,
            stores=stores,
            missions=firmware.missions,
            broadcast=self,
            announce=self._texts.announce,
            memory=memory,
            simulation=simulation,
            execute=lambda command: self.commands.carry_out(command),
        )
        if simulation is not None:
            simulation.connect(
                self.parameters,
                lambda failed: self.commander.pilot.lose_signal(failed, self.commander.time_us),
            )
        self._more = firmware.microservices(parts)
        self._cache = PayloadCache(merged(self._messages.builders(), *(more.builders for more in self._more)))
        self._streams = ChannelStreams(
            self.channels,
            firmware=firmware,
            parameters=self.parameters,
            cache=self._cache,
            motion=self._messages.motion,
            physics_step_us=MICROSECONDS // physics_rate_hz,
        )
        self.intervals = MessageIntervalService(
            firmware.intervals,
            self._streams.tables,
            self._cache,
            self._texts.announce,
            merged(*(more.on_demand for more in self._more)),
        )
        hooks = CommandHooks(
            intervals=self.intervals,
            parameters=self.parameters,
            announce=self._texts.announce,
            banner=self._texts.banner,
            set_current_item=self.missions.set_current,
            mission_item_count=lambda: len(stores[MissionType.MISSION].items),
            inject_failure=inject_failure,
        )
        self._parameter_service = ParameterService(
            self.parameters,
            firmware.parameters,
            self,
            on_list=self._texts.banner,
            on_fixed=self._report_fixed,
        )
        timed = [more for more in self._more if type(more).tick is not Microservice.tick]
        self._timed: tuple[Microservice, ...] = (
            self._parameter_service,
            self.missions,
            *(more for more in timed if not more.coarse_timers),
            self.intervals,
        )
        coarse_timers = [more for more in timed if more.coarse_timers]
        self._coarse_timers = tuple(coarse_timers[turn::_TURNS] for turn in range(_TURNS))
        self._turn = 0
        self.commands = CommandService(
            firmware.commands(self.commander, hooks),
            flavour.command_address(system_id),
            merged(*(more.commands for more in self._more)),
        )
        services: tuple[Microservice, ...] = (
            SetpointService(firmware.setpoints(self.commander)),
            self.commands,
            self._parameter_service,
            self.missions,
            TimeSyncService(answers_ping=firmware.answers_ping),
            RadioService(lambda channel: self._streams.throttle(channel, self._time_us)),
            *self._more,
            self.intervals,
            self._texts,
        )
        self._receivers = receivers_by_id(services)
        self._followers = tuple(more for more in self._more if type(more).follow is not Microservice.follow)
        self.parameters.subscribe(self._on_parameter)

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

    def add_channel(self, channel: AutopilotChannel, *, role: str) -> None:
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
        for more in self._more:
            more.close()

    def remove_channel(self, channel: AutopilotChannel) -> None:
        """Stop all streams and answers on a channel."""
        self._streams.remove(channel)

    def receive(self, frame: Frame, channel: AutopilotChannel) -> None:
        """Take one frame from a channel. Contents are untrusted and never raise."""
        if frame.system_id == self.system_id and frame.component_id == _COMPONENT:
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
        self._texts.report(event)
        for follower in self._followers:
            follower.follow(event)
        match event:
            case events.MissionItemReached(index=index):
                self.missions.item_reached(index)
            case events.MissionFinished():
                self._progress.complete = True
            case events.ModeChanged(mode=mode):
                if mode is not FlightMode.MISSION:
                    self._progress.complete = False
                if self.flavour.heartbeat_on_mode_change:
                    self._streams.push(mavlink.MAVLINK_MSG_ID_HEARTBEAT, self._time_us)
            case events.HomeSet():
                self._push_position()
            case events.Armed() if self._firmware.position_pushed_at_arm:
                self._push_position()

    def _push_position(self) -> None:
        self._streams.push(mavlink.MAVLINK_MSG_ID_HOME_POSITION, self._time_us)
        self._streams.push(mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, self._time_us)

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
        self._texts.announce(mavlink.MAV_SEVERITY_WARNING, f"{name} stays {value:g}: given by the simulation")

    def _build_messages(self, unix_epoch_us: int) -> CommonMessages:
        sources = TelemetrySources(
            view=self._view,
            context=self.context,
            navigation=self.navigation,
            controller=self.controller,
            readings=self._readings,
            heartbeat=self._status.heartbeat,
            sys_status=self._status.sys_status,
            mission_current=self._mission_current,
            autopilot_version=self._status.autopilot_version,
            battery_level=lambda: int(self.commander.battery_level),
            position_ready=lambda: self.commander.situation.position,
            unix_epoch_us=unix_epoch_us,
            current_mode=self._status.current_mode,
            orbit=lambda: self.commander.tasks.orbit,
            task=lambda: self.commander.tasks.task,
            missions=self.commander.missions,
        )
        return self._firmware.messages(sources)

    def _on_plan_changed(self, mission_type: MissionType) -> None:
        if mission_type is MissionType.MISSION:
            self._progress.complete = False

    def _mission_current(self) -> bytes | None:
        return extended_payload(self.missions.current_message())


def merged(*tables: Mapping[int, EntryT]) -> dict[int, EntryT]:
    """One table from several, by number; for a number in several tables, the last entry."""
    return {number: entry for table in tables for number, entry in table.items()}
