"""The commander: which mode is flown, whether motors may turn, what a failsafe does. Flavour-neutral.

Everything it decides on comes from the navigation filter, the sensors, the parameters and people's requests.
Requests answer with a `Verdict`; what happens is told in typed events, which flavours turn into texts.
"""

import math
from collections.abc import Callable
from typing import Final

from autopilot_bridge.commander.airspeed import AirspeedWatch
from autopilot_bridge.commander.arming import MODE_REASONS, arming_reasons, shortfalls
from autopilot_bridge.commander.battery import BatteryMonitor
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
    HomeSet,
    ModeChanged,
    ModeDenied,
    NavigationReady,
    SystemStatus,
)
from autopilot_bridge.commander.failsafe import FailsafeMonitor, failsafe_mode
from autopilot_bridge.commander.fence_return import fence_return_place, place_ahead
from autopilot_bridge.commander.fence_watch import FenceWatch
from autopilot_bridge.commander.guidance import Guidance
from autopilot_bridge.commander.health import HealthMonitor
from autopilot_bridge.commander.home import Home
from autopilot_bridge.commander.mode_memory import ModeMemory
from autopilot_bridge.commander.modes import LANDING_MODES, STICK_MODES, FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.pilot import THROTTLE_HIGH, PilotInput, stick_travel
from autopilot_bridge.commander.policy import CommanderPolicy
from autopilot_bridge.commander.setpoints import SetpointStream
from autopilot_bridge.commander.situation import Situation
from autopilot_bridge.commander.task_events import TaskFollower
from autopilot_bridge.commander.tasks import TaskRunner
from autopilot_bridge.commander.vehicle_tasks import LandDetector, VehicleTasks
from autopilot_bridge.commander.verdict import ACCEPTED, Reason, Verdict
from autopilot_bridge.flight import context as flight
from autopilot_bridge.flight.context import FlightContext, FlightPhase, LandedState
from autopilot_bridge.mission_plan import MissionStore
from autopilot_bridge.navigation import layout as nav

# Health, failsafes and arming checks run at 10 Hz, as in PX4's commander; flight tasks at 50 Hz.
_SUPERVISE_EVERY: Final = 5
_POSITION_HYSTERESIS: Final = (
    2.5  # how much worse than required a position may become before it is lost (PX4)
)


class Commander:
    """Owns mode, arming state, home and failsafes of one vehicle, and runs its flight task.

    Args:
        context: what flight tasks see; the autopilot shares its navigation state, setpoint and frame
            through it.
        policy: the flavour's rules.
        parameters: time-outs, thresholds, actions.
        vehicle: makes the flight tasks of this class of vehicle.
        health: judge of sensors and navigation.
        land_detector: writes `context.landed_state`.
        thrust: the collective given by the motors, 0..1.
        missions: the stored mission plan.
        fence: the stored fence plan.
        mission_valid: whether the stored plan can be flown (asked only when there is one).

    Attributes:
        mode: the mode being flown, shown in HEARTBEAT.
        commanded_mode: the mode last asked for; differs from `mode` during a failsafe that keeps it (PX4).
        armed: motors may turn.
        pilot: sticks and ground-station heartbeats come in here.
        setpoints: streamed setpoints come in here.
        home: where to return to.
        battery: warning level.
        failsafes: conditions that are up.
        fence: the geofence, and what of it is broken.
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
        self.mode = policy.initialising_mode or policy.boot_mode
        self.commanded_mode = self.mode
        self.armed = False
        self.terminated = False
        self.pilot = PilotInput(built_in_radio=policy.manual_control_always)
        self.setpoints = SetpointStream(vehicle)
        self.home = Home(context)
        self.battery = BatteryMonitor()
        self.failsafes = FailsafeMonitor(policy)
        self.tasks = TaskRunner(context, vehicle)
        self.guidance = Guidance(self)
        self.situation = Situation(health=health.health, mode=self.mode)
        self.arming_reasons: tuple[Reason, ...] = (Reason.BOOTING,)
        self._health = health
        self._land_detector = land_detector
        self._thrust = thrust
        self.fence = FenceWatch(fence)
        context.within_fence = self._within_fence
        self._mission_valid = mission_valid
        self._mode_after_disarm = policy.boot_mode
        self._events: list[Event] = []
        self._ticks = 0
        self._booted = False
        self._disarming = AutoDisarm()
        self._last_prearm_report_us = 0
        self._sticks_at_command = flight.ManualInput()
        self._airspeed = AirspeedWatch()
        self._memory = ModeMemory(active=policy.radio_restores_mode)
        self._follower = TaskFollower(self)

    @property
    def time_us(self) -> int:
        """Vehicle time of the newest update."""
        return self.situation.time_us

    @property
    def landed(self) -> bool:
        """Standing on the ground, the land detector is sure."""
        return self.context.on_ground

    @property
    def airborne(self) -> bool:
        """Armed and off the ground."""
        return self.armed and not self.context.on_ground

    @property
    def landed_state(self) -> LandedState:
        """As EXTENDED_SYS_STATE shows it."""
        return self.context.landed_state

    @property
    def booted(self) -> bool:
        """The boot phase is over."""
        return self._booted

    @property
    def armable(self) -> bool:
        """The arming checks pass; ArduPilot shows obstacles that lie in the mode only when somebody arms."""
        if self.policy.standby_when_armable:
            return not self.arming_reasons
        return MODE_REASONS.issuperset(self.arming_reasons)

    @property
    def failsafe_active(self) -> bool:
        """A failsafe takes action (or, where the flavour says so, only warns)."""
        if self.policy.critical_on_warning:
            return self.failsafes.any
        return self.failsafes.action(self.time_us, self.parameters) > FailsafeAction.WARN

    @property
    def battery_level(self) -> BatteryLevel:
        """Battery warning level."""
        return self.battery.level

    @property
    def system_status(self) -> SystemStatus:
        """MAV_STATE for HEARTBEAT."""
        if self.terminated:
            return SystemStatus.FLIGHT_TERMINATION
        if self.armed and self.failsafe_active:
            return SystemStatus.CRITICAL
        if self.armed and (self.policy.active_when_landed or not self.context.on_ground):
            return SystemStatus.ACTIVE
        if self.policy.standby_when_armable:
            if self.situation.calibrating:
                return SystemStatus.CALIBRATING
            return SystemStatus.STANDBY if self.armable else SystemStatus.UNINIT
        return SystemStatus.STANDBY if self._booted else self.policy.boot_status

    def drain_events(self) -> list[Event]:
        """Everything that happened since the last call, in order."""
        events, self._events = self._events, []
        return events

    def emit(self, event: Event) -> None:
        """Add an event of a service that acts for the commander (denied commands, reboot)."""
        self._events.append(event)

    def set_mode(self, mode: FlightMode) -> Verdict:
        """Command a mode. On the ground almost any is taken; in flight it must be possible now."""
        self._health.update(self.time_us)
        self._refresh()
        reason = self._mode_obstacle(mode)
        if reason is not None:
            self.emit(ModeDenied(time_us=self.time_us, mode=mode, reason=reason))
            return Verdict(result=self.policy.mode_denied, reasons=(reason,))
        self.failsafes.override()
        self._memory.forget()
        self._command(mode)
        self._select()
        return ACCEPTED

    def change_mode(self, mode: FlightMode) -> None:
        """The flight itself goes on in another mode: a task is done, a link is heard again."""
        self._command(mode)
        self._enter(mode)

    def arm(self, *, forced: bool = False) -> Verdict:
        """Let the motors turn, when every check passes."""
        if self.armed:
            return ACCEPTED
        self._refresh()
        reasons = arming_reasons(
            self.commanded_mode, self.situation, self.policy, self.parameters, forced=forced
        )
        if reasons:
            self.arming_reasons = reasons
            booting = Reason.BOOTING in reasons
            if not booting or self.policy.force_arm_skips_checks:
                self._tell_reasons(reasons, check_only=False)
            return Verdict(result=self.policy.arming_denied, reasons=reasons)
        self.armed = True
        self.context.armed = True
        self._disarming.begin(self.time_us)
        self.situation.sticks_at_arming = self.situation.sticks_age_s <= self.parameters.stick_timeout_s
        self._sticks_at_command = self.context.sticks
        if not self.home.commanded and self.home.set_here():
            self._tell_home()
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
        """Flight termination: motors off, for good."""
        self.terminated = True
        if self.armed:
            self._disarm(DisarmReason.TERMINATION)
        self._enter(FlightMode.TERMINATION)
        self.commanded_mode = FlightMode.TERMINATION

    def check_arming(self) -> tuple[Reason, ...]:
        """Run the arming checks now and announce what fails."""
        self._refresh()
        reasons = self._check_arming()
        if reasons:
            self._tell_reasons(reasons, check_only=True)
        return reasons

    def set_home(self, lat_deg: float, lon_deg: float, alt_m: float) -> bool:
        """Home is there from now on; False when that can't be."""
        if not self.home.set(lat_deg, lon_deg, alt_m):
            return False
        self.home.commanded = True
        self._tell_home()
        return True

    def set_home_here(self) -> bool:
        """Home is where the vehicle is; False while that is not known."""
        if not self.situation.position or not self.home.set_here():
            return False
        self.home.commanded = False
        self._tell_home()
        return True

    def update(self, time_us: int) -> None:
        """Advance everything by one 50 Hz period and write the control setpoint."""
        self.situation.time_us = time_us
        self.context.time_us = time_us
        self._ticks += 1
        self.context.sticks = self.pilot.sticks(time_us, self.parameters.stick_timeout_s)
        self._land_detector.update(self.context, self._thrust())
        self.home.follow_frame()
        self._follow_landing()
        self._auto_disarm()
        if self._ticks % _SUPERVISE_EVERY == 1:
            self._supervise(time_us)
        self._take_over_by_sticks()
        self.tasks.update()
        self._follower.follow()

    def _supervise(self, time_us: int) -> None:
        """What needs no haste: sensors, arming checks, home, battery, failsafes and the mode they ask for."""
        if not self._booted and time_us >= self.policy.boot_s * 1e6:
            self._booted = True
            self.emit(Booted(time_us=time_us))
            if self.mode is self.policy.initialising_mode:
                self.change_mode(self.policy.boot_mode)
        self._health.update(time_us)
        warning = self.battery.update(self.situation.health, self.parameters, time_us)
        if warning is not None:
            self.emit(warning)
        self._refresh()
        self._follow_home()
        if not self.armed:
            self._check_arming()
            self._report_prearm()
        changed = self._airspeed.update(self.situation.health, armed=self.armed, time_us=time_us)
        if changed is not None:
            self.emit(changed)
        told = self.failsafes.update(self.situation, self.parameters)
        self._events.extend(told)
        self._select()
        restored = self._memory.recall(told)
        if restored is not None and self.armed:
            self.change_mode(restored)

    def _tell_reasons(self, reasons: tuple[Reason, ...], *, check_only: bool) -> None:
        mode = self.commanded_mode
        self.emit(ArmingDenied(time_us=self.time_us, mode=mode, reasons=reasons, check_only=check_only))

    def _check_arming(self) -> tuple[Reason, ...]:
        self.arming_reasons = arming_reasons(
            self.commanded_mode, self.situation, self.policy, self.parameters
        )
        return self.arming_reasons

    def _refresh(self) -> None:
        """Bring the situation up to date."""
        situation, context, parameters = self.situation, self.context, self.parameters
        time_us = situation.time_us
        situation.mode = self.commanded_mode
        situation.armed = self.armed
        situation.airborne = self.airborne
        situation.landing = self.airborne and context.phase is FlightPhase.LANDING
        situation.ready = time_us >= self.policy.armable_s * 1e6
        was_ready = situation.position
        situation.position_accuracy_m = situation.health.position_accuracy_m
        limit_m = parameters.position_accuracy_max_m * (_POSITION_HYSTERESIS if was_ready else 1.0)
        situation.position = (
            situation.health.position
            and time_us >= self.policy.position_ready_s * 1e6
            and not situation.position_accuracy_m > limit_m
        )
        if situation.position and not was_ready:
            self.emit(NavigationReady(time_us=time_us))
        situation.setpoint_age_s = self.setpoints.age_s(time_us)
        situation.setpoint_needs_position = self.setpoints.needs_position
        situation.gcs_age_s = self.pilot.gcs_age_s(time_us)
        situation.sticks_age_s = self.pilot.sticks_age_s(time_us, parameters.stick_timeout_s)
        situation.throttle_high = context.sticks.valid and context.sticks.throttle > THROTTLE_HIGH
        situation.home_set = self.home.position is not None
        situation.mission_problem = self.mission_problem
        situation.battery_level = self.battery.level
        roll, pitch, _ = context.nav[nav.EULER_RAD].tolist()
        situation.roll_rad, situation.pitch_rad = roll, pitch
        situation.tilt_rad = math.acos(math.cos(roll) * math.cos(pitch))
        situation.terminated = self.terminated
        self._watch_fence()

    def _watch_fence(self) -> None:
        situation, context, parameters = self.situation, self.context, self.parameters.fence
        position: tuple[float, float, float] | None = None
        if parameters.by_gps:
            position = self._health.gps_position_ned(context.frame)
        elif situation.position:
            north, east, down = context.nav[nav.POS_NED_M].tolist()
            position = (north, east, down)
        if parameters.predicts and position is not None and situation.airborne:
            position = place_ahead(context, position)
        home = tuple(context.home_ned_m.tolist()) if situation.home_set else None
        told = self.fence.update(
            position,
            home,
            context.frame,
            parameters,
            time_us=situation.time_us,
            armed=self.armed,
            airborne=situation.airborne,
            landing=situation.landing,
        )
        self._events.extend(told)
        situation.outside_fence = bool(self.fence.broken)
        situation.fence_present = self.fence.present(parameters)
        situation.fence_breaches = self.fence.breaches
        situation.fence_away_m = self.fence.distance_m

    def _within_fence(self, place_ned_m: flight.Array) -> bool:
        north, east, down = place_ned_m.tolist()
        return self.fence.allows((north, east, down), self.context.frame, self.parameters.fence)

    @property
    def mission_problem(self) -> Reason | None:
        """Why the stored mission can't be flown; None when it can."""
        if len(self.missions.items) <= self.policy.mission_first_item:
            return Reason.MISSION_MISSING
        return None if self._mission_valid() else Reason.MISSION_INVALID

    def _mode_obstacle(self, mode: FlightMode) -> Reason | None:
        if self.terminated:
            return Reason.TERMINATED
        if mode is FlightMode.FOLLOW and not self.parameters.follow_enabled:
            return Reason.MODE_UNAVAILABLE
        if not self.armed:
            return None if mode in self.policy.ground_modes else Reason.MODE_UNAVAILABLE
        if mode not in self.policy.flown_modes:
            return Reason.MODE_UNAVAILABLE
        if self.parameters.fence.locks_mode and self.failsafes.recovers_from_fence and mode is not self.mode:
            return Reason.FENCE_RECOVERY
        missing = shortfalls(mode, self.situation, self.policy, self.parameters)
        return missing[0] if missing else None

    def _command(self, mode: FlightMode) -> None:
        self.commanded_mode = self.situation.mode = mode
        self._disarming.restart(self.time_us)
        self._sticks_at_command = self.context.sticks
        if mode in self.policy.kept_after_disarm:
            self._mode_after_disarm = mode
        if not self.armed:
            self._check_arming()

    def _select(self) -> None:
        """Fly the commanded mode, or what the strongest failsafe asks for."""
        if self.policy.recovers:
            action = self.failsafes.action(self.time_us, self.parameters)
        else:
            action = max((action for _, action in self.failsafes.started), default=FailsafeAction.NONE)
            self._memory.note(self.failsafes.started, self.commanded_mode)
            self.failsafes.started.clear()
            if action > FailsafeAction.WARN:
                # what is up already and left to nobody goes before a weaker newcomer
                action = max(action, self.failsafes.action(self.time_us, self.parameters))
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
                self.guidance.go_to_place(fence_return_place(self.context, self.fence, self.parameters.fence))

    def _enter(self, mode: FlightMode) -> None:
        if mode is self.mode:
            return
        previous, self.mode = self.mode, mode
        self.guidance.forget_speed()
        self.context.look_at(None)
        self.emit(ModeChanged(time_us=self.time_us, mode=mode, previous=previous))
        self.tasks.enter(mode)

    def _disarm(self, reason: DisarmReason) -> None:
        self.armed = False
        self.context.armed = False
        self.situation.armed = False
        self.situation.sticks_at_arming = False
        self.tasks.stop()
        self._events.extend(self.failsafes.update(self.situation, self.parameters))
        self.emit(Disarmed(time_us=self.time_us, reason=reason))
        if self.policy.kept_after_disarm and self.commanded_mode not in self.policy.kept_after_disarm:
            self.commanded_mode = self._mode_after_disarm
        if not self.terminated:
            self._enter(self.commanded_mode)

    def _auto_disarm(self) -> None:
        if not self.armed or not self.context.on_ground:
            return
        reason = self._disarming.due(
            self.time_us,
            self.parameters,
            self.policy,
            lifting_off=self.tasks.lifting_off,
            landing=self.mode in LANDING_MODES or self.tasks.ends_on_ground,
        )
        if reason is not None:
            self._disarm(reason)

    def _follow_home(self) -> None:
        situation = self.situation
        waiting = self.armed or self.time_us < self.policy.home_s * 1e6 or not situation.health.position
        if not waiting and self.home.settle(settled=situation.position, once_a_second=self._ticks % 50 == 1):
            self._tell_home()

    def _tell_home(self) -> None:
        if self.home.position is not None:
            self.emit(HomeSet(time_us=self.time_us, home=self.home.position))

    def _follow_landing(self) -> None:
        if self.armed:
            event = self._disarming.follow(self.time_us, on_ground=self.context.on_ground)
            if event is not None:
                self.emit(event)

    def _report_prearm(self) -> None:
        interval_us = self.policy.prearm_report_s * 1e6
        if interval_us <= 0.0 or not self._booted or self.armable:
            return
        if self.time_us - self._last_prearm_report_us >= interval_us:
            self._last_prearm_report_us = self.time_us
            self._tell_reasons(self.arming_reasons, check_only=True)

    def _take_over_by_sticks(self) -> None:
        """PX4 COM_RC_OVERRIDE: moved sticks end automatic flight."""
        parameters = self.parameters
        offboard = self.mode is FlightMode.OFFBOARD
        allowed = parameters.stick_override_offboard if offboard else parameters.stick_override
        if not allowed or not self.airborne or self.mode in STICK_MODES:
            return
        if stick_travel(self.context.sticks, self._sticks_at_command) > parameters.stick_override_threshold:
            self.set_mode(FlightMode.POSITION if self.situation.position else FlightMode.ALTITUDE)
