"""The input of arming checks and failsafes: one snapshot of the vehicle, and its update at 50 Hz."""

import math
from dataclasses import dataclass, field
from typing import Final

from autopilot_bridge.commander.battery import BatteryMonitor
from autopilot_bridge.commander.events import BatteryLevel, Event, NavigationLost, NavigationReady
from autopilot_bridge.commander.health import VehicleHealth
from autopilot_bridge.commander.home import Home
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.parameters import CommanderParameters
from autopilot_bridge.commander.pilot import PilotInput, lifts
from autopilot_bridge.commander.policy import CommanderPolicy
from autopilot_bridge.commander.vehicle_tasks import SetpointStream
from autopilot_bridge.commander.verdict import Reason
from autopilot_bridge.flight.context import FlightContext, FlightPhase
from autopilot_bridge.navigation import layout as nav


@dataclass(slots=True)
class Situation:
    """Snapshot of the vehicle for the checks.

    Attributes:
        time_us: vehicle time.
        mode: the commanded mode.
        armed, airborne: motors may turn; off the ground.
        landing: the vehicle is landing.
        ready: the boot timeline allows arming.
        health: sensors and navigation.
        position: navigation provides a position, for long enough after boot.
        setpoint_age_s: age of the last streamed setpoint; infinite when there is none.
        setpoint_needs_position: the stream commands positions or velocities.
        gcs_age_s: age of the last heartbeat of a ground station; infinite when none was received.
        sticks_age_s: age of the last stick input; infinite when there is none, 0 for a built-in radio.
        sticks_at_arming: there was stick input when the vehicle was armed.
        throttle: the throttle stick, -1..1; NaN: there is none.
        centred_sticks: roll, pitch and yaw, -1..1; NaN: there are none.
        throttle_lifts: in a mode in which the stick is the thrust, it would lift the vehicle.
        home_set: home is known.
        mission_problem: why the stored mission can't be flown; None when it can.
        takeoff_missing: the vehicle stands on the ground, and its mission does not start with a take-off
            where that is required.
        landing_sequence: the mission mode is selected, and a landing that the mission has begun blocks
            arming.
        battery_level: warning level.
        outside_fence: the vehicle is outside the geofence.
        fence_present: a geofence is set up.
        fence_breaches: number of new breaches so far.
        fence_away_m: how far the vehicle is outside the fence's cylinder.
        position_accuracy_m: 1-sigma of the horizontal position; NaN while not known.
        roll_rad, pitch_rad: attitude.
        tilt_rad: angle between the body's down axis and the vertical.
        terminated: flight termination was commanded.
        calibrating: a sensor is being calibrated.
    """

    time_us: int = 0
    mode: FlightMode = FlightMode.HOLD
    armed: bool = False
    airborne: bool = False
    landing: bool = False
    ready: bool = False
    health: VehicleHealth = field(default_factory=VehicleHealth)
    position: bool = False
    setpoint_age_s: float = math.inf
    setpoint_needs_position: bool = False
    gcs_age_s: float = math.inf
    sticks_age_s: float = math.inf
    sticks_at_arming: bool = False
    throttle: float = math.nan
    centred_sticks: tuple[float, float, float] = (math.nan, math.nan, math.nan)
    throttle_lifts: bool = False
    home_set: bool = False
    mission_problem: Reason | None = Reason.MISSION_MISSING
    takeoff_missing: bool = False
    landing_sequence: bool = False
    battery_level: BatteryLevel = BatteryLevel.OK
    outside_fence: bool = False
    fence_present: bool = False
    fence_breaches: int = 0
    fence_away_m: float = 0.0
    position_accuracy_m: float = math.nan
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    tilt_rad: float = 0.0
    terminated: bool = False
    calibrating: bool = False


_POSITION_HYSTERESIS: Final = (
    2.5  # how much worse than required a position may become before it is lost (PX4)
)


class SituationUpdate:
    """Fills a `Situation` from its sources; the geofence and the commander add their own parts.

    Args:
        situation: the snapshot to update.
        context: navigation, sticks and the flight task's state.
        policy: the flavour's boot timeline.
        setpoints, pilot: provide the age of their newest input.
        home: provides whether home is known.
        battery: provides the warning level.
    """

    def __init__(
        self,
        situation: Situation,
        context: FlightContext,
        policy: CommanderPolicy,
        *,
        setpoints: SetpointStream,
        pilot: PilotInput,
        home: Home,
        battery: BatteryMonitor,
    ) -> None:
        self._situation = situation
        self._context = context
        self._policy = policy
        self._setpoints = setpoints
        self._pilot = pilot
        self._home = home
        self._battery = battery

    def update(
        self,
        parameters: CommanderParameters,
        *,
        mode: FlightMode,
        terminated: bool,
        mission_problem: Reason | None,
    ) -> list[Event]:
        """Update everything; returns the event when a position has become known, or was lost.

        Args:
            mode: the commanded mode.
            terminated: the flight was terminated.
            mission_problem: why the stored mission can't be flown.
        """
        situation, context = self._situation, self._context
        time_us = situation.time_us
        situation.mode = mode
        situation.terminated = terminated
        situation.mission_problem = mission_problem
        situation.armed = context.armed
        situation.airborne = context.armed and not context.on_ground
        situation.landing = situation.airborne and context.phase is FlightPhase.LANDING
        situation.ready = time_us >= self._policy.armable_s * 1e6
        was_known = situation.position
        situation.position = self._position_known(parameters)
        situation.setpoint_age_s = self._setpoints.age_s(time_us)
        situation.setpoint_needs_position = self._setpoints.needs_position
        situation.gcs_age_s = self._pilot.gcs_age_s(time_us)
        situation.sticks_age_s = self._pilot.sticks_age_s(time_us, parameters.stick_timeout_s)
        sticks = context.sticks
        situation.throttle = sticks.throttle if sticks.valid else math.nan
        situation.centred_sticks = (
            (sticks.roll, sticks.pitch, sticks.yaw) if sticks.valid else (math.nan, math.nan, math.nan)
        )
        situation.throttle_lifts = sticks.valid and lifts(sticks.throttle, context.hover_thrust)
        situation.home_set = self._home.position is not None
        situation.battery_level = self._battery.level
        roll, pitch, _ = context.nav[nav.EULER_RAD].tolist()
        situation.roll_rad, situation.pitch_rad = roll, pitch
        situation.tilt_rad = math.acos(math.cos(roll) * math.cos(pitch))
        if situation.position == was_known:
            return []
        return [(NavigationLost if was_known else NavigationReady)(time_us=time_us)]

    def _position_known(self, parameters: CommanderParameters) -> bool:
        situation = self._situation
        situation.position_accuracy_m = situation.health.position_accuracy_m
        limit_m = parameters.position_accuracy_max_m * (_POSITION_HYSTERESIS if situation.position else 1.0)
        return (
            situation.health.position
            and situation.time_us >= self._policy.position_ready_s * 1e6
            and not situation.position_accuracy_m > limit_m
        )
