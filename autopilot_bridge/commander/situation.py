"""The input of arming checks and failsafes: one snapshot of the vehicle, updated at 50 Hz."""

import math
from dataclasses import dataclass, field

from autopilot_bridge.commander.events import BatteryLevel
from autopilot_bridge.commander.health import VehicleHealth
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason


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
        throttle_high: the throttle stick is up.
        home_set: home is known.
        mission_problem: why the stored mission can't be flown; None when it can.
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
    throttle_high: bool = False
    home_set: bool = False
    mission_problem: Reason | None = Reason.MISSION_MISSING
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
