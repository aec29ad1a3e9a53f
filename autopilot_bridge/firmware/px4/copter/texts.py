"""PX4's texts of events (docs/firmware/px4.md, sections 7 to 9).

PX4 gives the reasons of a refused arming in EVENT messages (`px4_events`), which need its metadata to be
read. Here they are sent as texts too, in the words of the events, for clients without support for events. The
status text service ends texts that events repeat with a tab, so that clients that read events do not show
them twice.
"""

from collections.abc import Mapping
from typing import Final

from autopilot_bridge.commander import events
from autopilot_bridge.commander.events import Aid, BatteryLevel, DisarmReason, FailsafeAction
from autopilot_bridge.commander.verdict import Reason
from autopilot_bridge.firmware.px4.copter.modes import MODE_NAMES
from autopilot_bridge.firmware.texts import Notice, Severity

_REASONS: Final[Mapping[Reason, str]] = {
    Reason.BOOTING: "System is starting up",
    Reason.GYRO: "Gyro data missing or unhealthy",
    Reason.ACCELEROMETER: "Accelerometer data missing or unhealthy",
    Reason.BAROMETER: "Barometer data missing or unhealthy",
    Reason.COMPASS: "Compass data missing or unhealthy",
    Reason.AIRSPEED: "Airspeed data missing or unhealthy",
    Reason.GPS: "GNSS data fusion stopped or no 3D fix",
    Reason.ATTITUDE: "Attitude estimate invalid",
    Reason.ALTITUDE: "Altitude estimate invalid",
    Reason.POSITION: "Position estimate invalid",
    Reason.HOME: "Home position not set",
    Reason.BATTERY_LOW: "Low battery",
    Reason.BATTERY_FAILSAFE: "Critical battery",
    Reason.MANUAL_CONTROL: "No manual control input",
    Reason.GCS_LOST: "No connection to the ground control station",
    Reason.MISSION_MISSING: "No valid mission available",
    Reason.MISSION_INVALID: "Mission is not feasible",
    Reason.NO_SETPOINTS: "No offboard signal",
    Reason.MODE_NOT_ARMABLE: "Mode not suitable for takeoff",
    Reason.OUTSIDE_FENCE: "Geofence violation",
    Reason.TERMINATED: "Flight termination active",
    Reason.CALIBRATING: "Calibrating",
    Reason.LEANING: "Attitude too far from level",
    Reason.THROTTLE_HIGH: "Throttle above center",
}

_DISARMED: Final[Mapping[DisarmReason, str]] = {
    DisarmReason.COMMAND: "Disarmed by external command",
    DisarmReason.FORCED: "Disarmed by external command",
    DisarmReason.PREFLIGHT_TIMEOUT: "Disarmed by auto preflight disarming",
    DisarmReason.LANDED: "Disarmed by landing",
    DisarmReason.FAILSAFE: "Disarmed by failsafe",
    DisarmReason.TERMINATION: "Disarmed by flight termination",
}

_COMMANDS: Final[Mapping[tuple[int, Reason], Notice]] = {
    (300, Reason.MISSION_MISSING): Notice(Severity.CRITICAL, "Mission start denied! No valid mission"),
    (300, Reason.MISSION_INVALID): Notice(Severity.CRITICAL, "Mission start denied! No valid mission"),
    (192, Reason.OUTSIDE_FENCE): Notice(Severity.CRITICAL, "Reposition is outside geofence"),
    (400, Reason.BAD_PARAMETER): Notice(Severity.CRITICAL, "Unsupported ARM_DISARM param"),
    (176, Reason.MODE_UNKNOWN): Notice(Severity.CRITICAL, "Unsupported auto mode"),
}

_SWITCHING: Final = "Switching to {} is currently not available"
_BATTERY: Final[Mapping[BatteryLevel, str]] = {
    BatteryLevel.LOW: "Low battery level, return advised",
    BatteryLevel.CRITICAL: "Critical battery level, land now",
    BatteryLevel.EMERGENCY: "Dangerous battery level, land immediately",
}
_ARMED: Final = Notice(Severity.INFO, "Armed by external command")
_ARMING_DENIED: Final = Notice(Severity.CRITICAL, "Arming denied: Resolve system health failures first")
_DISARMING_DENIED: Final = Notice(Severity.CRITICAL, "Disarming denied: not landed")
_TAKEOFF: Final = Notice(Severity.INFO, "Takeoff detected")
_LANDING: Final = Notice(Severity.INFO, "Landing detected")
_MISSION_FINISHED: Final = Notice(Severity.INFO, "Mission finished, loitering")
_GPS_STOPPED: Final = Notice(Severity.WARNING, "GNSS data fusion stopped")
_GPS_STARTED: Final = Notice(Severity.INFO, "GNSS data fusion started")

FIXED: Final = (
    _ARMED,
    _ARMING_DENIED,
    _DISARMING_DENIED,
    _TAKEOFF,
    _LANDING,
    _MISSION_FINISHED,
    _GPS_STOPPED,
    _GPS_STARTED,
    *(Notice(Severity.INFO, text) for text in dict.fromkeys(_DISARMED.values())),
    *(Notice(Severity.CRITICAL, _SWITCHING.format(name)) for name in dict.fromkeys(MODE_NAMES.values())),
    *(Notice(Severity.CRITICAL, text) for text in _BATTERY.values()),
    *dict.fromkeys(_COMMANDS.values()),
)
"""Texts without numbers that have a separate event."""


def notices(event: events.Event) -> tuple[Notice, ...]:
    """The STATUSTEXTs of an event, in order."""
    match event:
        case events.Armed():
            return (_ARMED,)
        case events.Disarmed(reason=reason):
            return (Notice(Severity.INFO, _DISARMED[reason]),)
        case events.ArmingDenied(reasons=reasons, check_only=check_only):
            why = tuple(
                Notice(Severity.CRITICAL, f"Preflight Fail: {describe(reason)}") for reason in reasons
            )
            if check_only:
                return why
            return (_ARMING_DENIED, *why)
        case events.DisarmingDenied():
            return (_DISARMING_DENIED,)
        case events.ModeDenied(mode=mode) if mode is not None:
            return (Notice(Severity.CRITICAL, _SWITCHING.format(MODE_NAMES[mode])),)
        case events.CommandDenied(command=command, reason=reason):
            known = _COMMANDS.get((command, reason))
            return () if known is None else (known,)
        case events.FailsafeActivated(action=action) if action > FailsafeAction.WARN:
            return (Notice(Severity.CRITICAL, "Failsafe activated"),)
        case events.FailsafeActivated(action=FailsafeAction.WARN):
            return (Notice(Severity.CRITICAL, "Failsafe warning triggered"),)
        case events.BatteryWarning(level=level):
            text = _BATTERY.get(level)
            return () if text is None else (Notice(Severity.CRITICAL, text),)
        case events.AidChanged(aid=Aid.GPS, present=present):
            return (_GPS_STARTED if present else _GPS_STOPPED,)
        case events.TakeoffDetected():
            return (_TAKEOFF,)
        case events.LandingDetected():
            return (_LANDING,)
        case events.MissionFinished():
            return (_MISSION_FINISHED,)
    return ()


def describe(reason: Reason) -> str:
    """One reason in PX4's words."""
    return _REASONS.get(reason, reason.name.replace("_", " ").capitalize())
