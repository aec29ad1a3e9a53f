"""The commander: which mode is flown, whether motors may turn, what a failsafe does. Flavour-neutral.

Its decisions use the navigation filter, the sensors, the parameters and the requests of clients and pilots.
A request returns a `Verdict`; events are typed, and flavours convert them into texts.
"""

from collections.abc import Callable
from typing import Final

from autopilot_bridge.commander.arming import ArmingChecks, arming_reasons, mode_obstacle
from autopilot_bridge.commander.battery import BatteryMonitor
from autopilot_bridge.commander.crash import CrashCheck
from autopilot_bridge.commander.disarming import AutoDisarm
from autopilot_bridge.commander.events import (
    Armed,
    ArmingDenied,
    BatteryLevel,
    Booted,
    Disarmed,
    DisarmingDenied,
    DisarmReason,
    Event,
    FailsafeAction,
    ModeChanged,
    ModeDenied,
    SystemStatus,
    TakeoffDetected,
)
from autopilot_bridge.commander.failsafe import FailsafeMonitor, failsafe_mode
from autopilot_bridge.commander.fence_keeper import FenceKeeper
from autopilot_bridge.commander.fence_watch import FenceWatch
from autopilot_bridge.commander.guidance import Guidance
from autopilot_bridge.commander.health import HealthMonitor
from autopilot_bridge.commander.home import Home
from autopilot_bridge.commander.link_and_sensor_monitor import LinkAndSensorMonitor
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.pilot import THROTTLE_RAISED, ModeMemory, PilotInput, StickOverride
from autopilot_bridge.commander.policy import CommanderPolicy, MissionRestart
from autopilot_bridge.commander.situation import Situation, SituationUpdate
from autopilot_bridge.commander.task_events import TaskFollower
from autopilot_bridge.commander.tasks import TaskRunner
from autopilot_bridge.commander.vehicle_tasks import LandDetector, SetpointStream, VehicleTasks
from autopilot_bridge.commander.verdict import ACCEPTED, Reason, Verdict
from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.plan_reading import ends_in_landing, in_landing_sequence
from autopilot_bridge.mission_feasibility.ardupilot import starts_with_takeoff
from autopilot_bridge.mission_plan import MissionStore

# Health, failsafes and arming checks run at 10 Hz, as in PX4's commander; flight tasks at 50 Hz.
_SUPERVISE_EVERY: Final = 5


class Commander:
    """Owns mode, arming state, home and failsafes of one vehicle, and runs its flight task.

    Args:
        context: the data that flight tasks see; the autopilot shares its navigation state, setpoint and frame
            through it.
        policy: the flavour's rules.
        parameters: timeouts, thresholds, actions.
        vehicle: makes the flight tasks of this class of vehicle.
        health: evaluates sensors and navigation.
        land_detector: writes `context.landed_state`.
        thrust: returns the collective thrust of the motors, 0..1.
        missions: the stored mission plan.
        fence: the stored fence plan.
        mission_valid: returns whether the stored plan can be flown (called only when there is one).

    Attributes:
        mode: the mode being flown, shown in HEARTBEAT.
        commanded_mode: the last commanded mode; differs from `mode` during a failsafe that keeps it (PX4).
        armed: motors may turn.
        booted: the boot phase is over.
        pilot: receives sticks and ground-station heartbeats.
        setpoints: receives streamed setpoints.
        home: the position to return to.
        battery: warning level.
        failsafes: the active failsafe conditions.
        fence: the geofence and its breaches.
        vehicle: makes the flight tasks.
        tasks: the flight task being flown.
        guidance: requests that send the vehicle somewhere.
    """

    def __init__(
        self,
        context: FlightContext,
        *,
        policy: CommanderPolicy,
        parameters: CommanderParameters,
        vehicle: VehicleTasks,
        health: HealthMonitor,
        land_detector: LandDetector,
        thrust: Callable[[], float],
        missions: MissionStore,
        fence: MissionStore,
        mission_valid: Callable[[], bool],
    ) -> None:
        self.context = context
        self.policy = policy
        self.parameters = parameters
        self.missions = missions
        self.vehicle = vehicle
        self._mission_over = False
        self.mode = policy.initialising_mode or policy.boot_mode
        self.commanded_mode = self.mode
        self.armed = False
        self.booted = False
        self.terminated = False
        self.pilot = PilotInput(built_in_radio=policy.manual_control_always)
        self.setpoints = SetpointStream(vehicle)
        self.home = Home(context, self.emit)
        self.battery = BatteryMonitor()
        self.failsafes = FailsafeMonitor(policy)
        self.tasks = TaskRunner(context, vehicle)
        self.guidance = Guidance(self)
        self.situation = Situation(health=health.health, mode=self.mode)
        self.fence = FenceWatch(fence)
        self._health = health
        self._land_detector = land_detector
        self._thrust = thrust
        self._fence_keeper = FenceKeeper(self.fence, context, health, lambda: self.parameters.fence)
        self._situation_update = SituationUpdate(
            self.situation,
            context,
            policy,
            setpoints=self.setpoints,
            pilot=self.pilot,
            home=self.home,
            battery=self.battery,
        )
        self._checks = ArmingChecks(policy)
        self._mission_valid = mission_valid
        self._mode_after_disarm = policy.boot_mode
        self._events: list[Event] = []
        self._ticks = 0
        self._disarming = AutoDisarm(policy)
        self._override = StickOverride()
        self._monitor = LinkAndSensorMonitor()
        self._crash = CrashCheck()
        self._memory = ModeMemory(active=policy.radio_restores_mode)
        self._follower = TaskFollower(self)

    @property
    def time_us(self) -> int:
        """Vehicle time of the newest update."""
        return self.situation.time_us

    @property
    def landed(self) -> bool:
        """The land detector reports that the vehicle stands on the ground."""
        return self.context.on_ground

    @property
    def airborne(self) -> bool:
        """Armed and off the ground."""
        return self.armed and not self.context.on_ground

    @property
    def armable(self) -> bool:
        """The arming checks pass; ArduPilot shows obstacles of the mode only when a client arms."""
        return self._checks.passed

    @property
    def arming_reasons(self) -> tuple[Reason, ...]:
        """The result of the newest arming checks."""
        return self._checks.reasons

    @property
    def battery_level(self) -> BatteryLevel:
        """Battery warning level."""
        return self.battery.level

    @property
    def system_status(self) -> SystemStatus:
        """MAV_STATE for HEARTBEAT."""
        if self.terminated:
            return SystemStatus.FLIGHT_TERMINATION
        if self.armed and self.failsafes.active(self.time_us, self.parameters):
            return SystemStatus.CRITICAL
        if self.armed and (self.policy.active_when_landed or not self.context.on_ground):
            return SystemStatus.ACTIVE
        if self.policy.standby_when_armable:
            if self.situation.calibrating:
                return SystemStatus.CALIBRATING
            return SystemStatus.STANDBY if self.armable else SystemStatus.UNINIT
        return SystemStatus.STANDBY if self.booted else self.policy.boot_status

    def drain_events(self) -> list[Event]:
        """All events since the last call, in order."""
        events, self._events = self._events, []
        return events

    def emit(self, event: Event) -> None:
        """Add an event of a service that acts for the commander (denied commands, reboot)."""
        self._events.append(event)

    def set_mode(self, mode: FlightMode, *, announced: bool = True) -> Verdict:
        """Command a mode. Disarmed almost any is accepted; armed its requirements must be met.

        Args:
            announced: a refusal is also an event, which becomes a text.
        """
        self._health.update(self.time_us)
        self._refresh()
        locked = self.failsafes.recovers_from_fence and mode is not self.mode
        reason = mode_obstacle(
            mode, self.situation, self.policy, self.parameters, flown=self.mode, locked=locked
        )
        if reason is not None:
            if announced:
                self.emit(ModeDenied(time_us=self.time_us, mode=mode, reason=reason))
            return Verdict(result=self.policy.mode_denied, reasons=(reason,))
        self.failsafes.override()
        self._memory.forget()
        self._command(mode)
        self._select()
        return ACCEPTED

    def change_mode(self, mode: FlightMode) -> None:
        """Continue the flight in another mode: a task is finished, or a link is available again."""
        self._command(mode)
        self._enter(mode)

    def end_mission(self, mode: FlightMode | None = None) -> None:
        """End the mission being flown.

        Args:
            mode: the mode that its last item requires; None: the policy's mode follows.
        """
        after = self.policy.mission_end_mode
        follows = mode or after
        if follows is None or self.mode is not FlightMode.MISSION:
            return
        stays = after in self.policy.kept_after_disarm
        if self.airborne and not ends_in_landing(self.missions):
            self.change_mode(follows)
            if stays and after is not None:
                self._mode_after_disarm = after
        else:
            self._mission_over = stays

    def arm(self, *, forced: bool = False, by_rudder: bool = False) -> Verdict:
        """Arm the motors when every check passes.

        Args:
            forced: the client sent the override number.
            by_rudder: the pilot holds the yaw stick to the side for it.
        """
        if self.armed:
            return ACCEPTED
        self._refresh()
        reasons = arming_reasons(
            self.commanded_mode, self.situation, self.policy, self.parameters, forced=forced
        )
        if by_rudder:
            reasons = tuple(reason for reason in reasons if reason is not Reason.YAW_NOT_NEUTRAL)
        if reasons:
            self._checks.reasons = reasons
            self._report_reasons(reasons, check_only=False)
            return Verdict(result=self.policy.arming_denied, reasons=reasons)
        self.armed = self.context.armed = True
        self._disarming.begin(self.time_us)
        self.situation.sticks_at_arming = self.situation.sticks_age_s <= self.parameters.stick_timeout_s
        self._override.restart(self.context.sticks)
        self.home.begin_flight()
        self.emit(Armed(time_us=self.time_us))
        self.tasks.enter(self.mode)
        return ACCEPTED

    def disarm(self, *, forced: bool = False) -> Verdict:
        """Stop the motors; in the air only when forced."""
        if not self.armed:
            return ACCEPTED
        if not self.context.on_ground and not forced:
            self.emit(DisarmingDenied(time_us=self.time_us))
            return Verdict(result=self.policy.disarm_in_air_denied, reasons=(Reason.NOT_LANDED,))
        self._disarm(DisarmReason.FORCED if forced else DisarmReason.COMMAND)
        return ACCEPTED

    def terminate(self) -> None:
        """Flight termination: stop the motors permanently."""
        self.terminated = True
        if self.armed:
            self._disarm(DisarmReason.TERMINATION)
        self._enter(FlightMode.TERMINATION)
        self.commanded_mode = FlightMode.TERMINATION

    def check_arming(self) -> tuple[Reason, ...]:
        """Run the arming checks now and announce the failed ones."""
        self._refresh()
        reasons = self._checks.run(self.commanded_mode, self.situation, self.parameters)
        if reasons:
            self._report_reasons(reasons, check_only=True)
        return reasons

    def set_home_here(self) -> bool:
        """Set home to the vehicle's position; False while the position is not known."""
        return self.situation.position and self.home.command_here()

    def update(self, time_us: int) -> None:
        """Advance everything by one 50 Hz period and write the control setpoint."""
        self.situation.time_us = time_us
        self.context.time_us = time_us
        self._ticks += 1
        self.context.sticks = self.pilot.sticks(time_us, self.parameters.stick_timeout_s)
        self._land_detector.update(self.context, self._thrust())
        self.home.follow_frame()
        self._follow_landing()
        if self._ticks % _SUPERVISE_EVERY == 1:
            self._supervise(time_us)
        self._take_over_by_sticks()
        self._start_mission_by_throttle()
        self.tasks.update()
        self._follower.follow()

    def _supervise(self, time_us: int) -> None:
        """The slow part: sensors, arming checks, home, battery, failsafes and the modes they require."""
        if not self.booted and time_us >= self.policy.boot_s * 1e6:
            self.booted = True
            self.emit(Booted(time_us=time_us))
            if self.mode is self.policy.initialising_mode:
                self.change_mode(self.policy.boot_mode)
        self._health.update(time_us)
        warning = self.battery.update(self.situation.health, self.parameters, time_us)
        if warning is not None:
            self.emit(warning)
        self._refresh()
        if not (self.armed or time_us < self.policy.home_s * 1e6) and self.situation.health.position:
            self.home.settle(settled=self.situation.position, once_a_second=self._ticks % 50 == 1)
        if not self.armed:
            self._checks.run(self.commanded_mode, self.situation, self.parameters)
            if self.booted and self._checks.report_due(time_us):
                self._report_reasons(self.arming_reasons, check_only=True)
        self._events.extend(self._monitor.update(self.situation, self.parameters, self.context.health))
        changes = self.failsafes.update(self.situation, self.parameters)
        self._events.extend(changes)
        self._select()
        crash = self._crash.update(self.situation, self.context) if self.parameters.crash_check else None
        if crash is not None:
            self.emit(crash)
            self._disarm(DisarmReason.FAILSAFE)
        restored = self._memory.recall(changes)
        if restored is not None and self.armed:
            self.change_mode(restored)

    def _report_reasons(self, reasons: tuple[Reason, ...], *, check_only: bool) -> None:
        mode = self.commanded_mode
        faults = self.parameters.faults
        self.emit(
            ArmingDenied(
                time_us=self.time_us, mode=mode, reasons=reasons, check_only=check_only, faults=faults
            )
        )

    def _refresh(self) -> None:
        """Update the situation."""
        self._events += self._situation_update.update(
            self.parameters,
            mode=self.commanded_mode,
            terminated=self.terminated,
            mission_problem=self.mission_problem,
        )
        items, current = self.missions.items, self.missions.current
        self.situation.landing_sequence = (
            self.policy.landing_blocks_arming
            and self.commanded_mode is FlightMode.MISSION
            and in_landing_sequence(self.missions)
            and not starts_with_takeoff(items[1:])
        )
        self.situation.takeoff_missing = (
            self.policy.mission_starts_with_takeoff
            and self.context.on_ground
            and not starts_with_takeoff(items[max(current, 1) :])
        )
        self._events.extend(self._fence_keeper.update(self.situation))

    @property
    def mission_problem(self) -> Reason | None:
        """Why the stored mission can't be flown; None when it can."""
        if len(self.missions.items) <= self.policy.mission_first_item:
            return Reason.MISSION_MISSING
        return None if self._mission_valid() else Reason.MISSION_INVALID

    def _command(self, mode: FlightMode) -> None:
        self.commanded_mode = self.situation.mode = mode
        self._mission_over = False
        self._disarming.restart(self.time_us)
        self._override.restart(self.context.sticks)
        if mode in self.policy.kept_after_disarm:
            self._mode_after_disarm = mode
        if not self.armed:
            self._checks.run(mode, self.situation, self.parameters)

    def _select(self) -> None:
        """Fly the commanded mode, or the action of the strongest failsafe."""
        self._memory.note(self.failsafes.started, self.commanded_mode)
        action = self.failsafes.due(self.time_us, self.parameters)
        if not self.armed or action <= FailsafeAction.WARN:
            self._enter(self.commanded_mode)
        elif action is FailsafeAction.TERMINATE:
            self.terminate()
        elif action is FailsafeAction.DISARM or (
            self.policy.failsafe_disarms_landed and self.context.on_ground
        ):
            self._disarm(DisarmReason.FAILSAFE)
        else:
            mode = failsafe_mode(action, self.situation, self.policy, sticks_valid=self.context.sticks.valid)
            if not self.policy.recovers:
                self._command(mode)
            self._enter(mode)
            if action is FailsafeAction.FENCE_POINT and mode is FlightMode.GUIDED:
                self.guidance.go_to_place(self._fence_keeper.return_place())

    def _enter(self, mode: FlightMode) -> None:
        if mode is self.mode:
            return
        previous, self.mode = self.mode, mode
        self.guidance.forget_speed()
        self.context.look_at(None)
        self.emit(ModeChanged(time_us=self.time_us, mode=mode, previous=previous))
        self.tasks.enter(mode)

    def _disarm(self, reason: DisarmReason) -> None:
        self.armed = self.context.armed = self.situation.armed = False
        self.situation.sticks_at_arming = False
        self.tasks.stop()
        self._events.extend(self.failsafes.update(self.situation, self.parameters))
        self.emit(Disarmed(time_us=self.time_us, reason=reason))
        self._rewind_mission()
        if self._mission_over and self.policy.mission_end_mode is not None:
            self._command(self.policy.mission_end_mode)
        elif self.policy.kept_after_disarm and self.commanded_mode not in self.policy.kept_after_disarm:
            self.commanded_mode = self._mode_after_disarm
        if not self.terminated:
            self._enter(self.commanded_mode)

    def _follow_landing(self) -> None:
        """Report take-off and landing, and stop motors that are not needed on the ground."""
        event = self._disarming.follow(self.context)
        if event is not None:
            self.emit(event)
        if isinstance(event, TakeoffDetected) and self.policy.home_at_liftoff:
            self.home.begin_flight()
        reason = self._disarming.due(self.mode, self.context, self.tasks, self.parameters)
        if reason is not None:
            self._disarm(reason)

    def _take_over_by_sticks(self) -> None:
        """PX4 COM_RC_OVERRIDE: moved sticks end automatic flight."""
        if self.airborne and self._override.wanted(self.mode, self.context.sticks, self.parameters):
            self.set_mode(FlightMode.POSITION if self.situation.position else FlightMode.ALTITUDE)

    def _start_mission_by_throttle(self) -> None:
        """ArduCopter: armed on the ground in AUTO, a raised throttle stick starts the mission."""
        raised = self.policy.mission_waits_for_start and self.situation.throttle > THROTTLE_RAISED
        if raised and self.armed and self.landed and self.mode is FlightMode.MISSION:
            self.guidance.start_mission()

    def _rewind_mission(self) -> None:
        """After disarming, restart the mission at its first item where the firmware does so."""
        restart, missions = self.policy.mission_restart, self.missions
        flown = missions.current + 1 >= len(missions.items)
        if restart is MissionRestart.AT_DISARM or (restart is MissionRestart.AFTER_LAST_ITEM and flown):
            missions.current = 0
