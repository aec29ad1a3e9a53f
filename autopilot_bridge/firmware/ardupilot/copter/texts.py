"""ArduCopter's texts of events (docs/firmware/ardupilot.md, sections 1, 3, 5 and 6)."""

from collections.abc import Mapping
from typing import Final

from autopilot_bridge.commander import events
from autopilot_bridge.commander.events import BatteryLevel, DisarmReason, FailsafeAction, FailsafeKind
from autopilot_bridge.commander.geofence_parameters import FenceType
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason
from autopilot_bridge.firmware.ardupilot.copter.modes import MODE_NAMES, REFUSED_NAMES
from autopilot_bridge.firmware.texts import Notice, Severity

_REASONS: Final[Mapping[Reason, str]] = {
    Reason.BOOTING: "System not initialised",
    Reason.GYRO: "Gyros not healthy",
    Reason.ACCELEROMETER: "Accels not healthy",
    Reason.BAROMETER: "Barometer not healthy",
    Reason.COMPASS: "Compass not healthy",
    Reason.AIRSPEED: "Airspeed 1 not healthy",
    Reason.GPS: "GPS 1: Bad fix",
    Reason.ATTITUDE: "AHRS: EKF3 not ready",
    Reason.ALTITUDE: "Need Alt Estimate",
    Reason.POSITION: "Need Position Estimate",
    Reason.HOME: "waiting for home",
    Reason.BATTERY_LOW: "Battery 1 low voltage failsafe",
    Reason.BATTERY_FAILSAFE: "Battery 1 critical voltage failsafe",
    Reason.MANUAL_CONTROL: "Radio failsafe on",
    Reason.GCS_LOST: "GCS failsafe on",
    Reason.MISSION_MISSING: "Mode requires mission",
    Reason.MISSION_INVALID: "Mode requires mission",
    Reason.OUTSIDE_FENCE: "vehicle outside fence",
    Reason.FENCE_MISSING: "Fences enabled, but none selected",
    Reason.FENCE_PARAMETERS: "FENCE_MARGIN too big",
    Reason.TERMINATED: "Vehicle is terminated",
    Reason.CALIBRATING: "Calibration running",
    Reason.LEANING: "Leaning",
    Reason.THROTTLE_HIGH: "Throttle too high",
    Reason.LANDING_SEQUENCE: "In landing sequence",
}
_MODE_REASONS: Final[Mapping[Reason, str]] = {
    Reason.POSITION: "requires position",
    Reason.ALTITUDE: "need alt estimate",
    Reason.ATTITUDE: "need attitude estimate",
    Reason.HOME: "requires home",
    Reason.MISSION_MISSING: "requires mission",
    Reason.MISSION_INVALID: "requires mission",
    Reason.MANUAL_CONTROL: "requires radio",
    Reason.TERMINATED: "terminated",
    Reason.FENCE_RECOVERY: "in fence recovery",
}
_FAILSAFES: Final[Mapping[FailsafeKind, str]] = {
    FailsafeKind.GCS_LOST: "GCS Failsafe",
    FailsafeKind.MANUAL_LOST: "Radio Failsafe",
    FailsafeKind.BATTERY_LOW: "Battery Failsafe",
    FailsafeKind.BATTERY_CRITICAL: "Battery Failsafe",
}
_CLEARED: Final[Mapping[FailsafeKind, Notice]] = {
    FailsafeKind.GCS_LOST: Notice(Severity.WARNING, "GCS Failsafe Cleared"),
    FailsafeKind.MANUAL_LOST: Notice(Severity.WARNING, "Radio Failsafe Cleared"),
    FailsafeKind.POSITION_LOST: Notice(Severity.CRITICAL, "EKF Failsafe Cleared"),
    FailsafeKind.GEOFENCE: Notice(Severity.NOTICE, "Fence breach cleared"),
}
_WALLS: Final = {
    FenceType.HEIGHT_MAX: "Max Alt",
    FenceType.CIRCLE: "Circle",
    FenceType.SHAPES: "Polygon",
    FenceType.HEIGHT_MIN: "Min Alt",
}
_EKF_MODES: Final = {FailsafeAction.LAND: FlightMode.LAND, FailsafeAction.ALTITUDE: FlightMode.ALTITUDE}
_COMMANDS: Final[Mapping[tuple[int, Reason], Notice]] = {
    (193, Reason.WRONG_MODE): Notice(Severity.INFO, "Failed to pause"),
}


def notices(event: events.Event) -> tuple[Notice, ...]:
    """The STATUSTEXTs of an event, in order."""
    match event:
        case events.Booted():
            return (Notice(Severity.INFO, "ArduPilot Ready"),)
        case events.NavigationReady():
            return (Notice(Severity.INFO, "EKF3 IMU0 is using GPS"),)
        case events.NavigationLost():
            return (Notice(Severity.WARNING, "EKF3 IMU0 stopped aiding"),)
        case events.Armed():
            return (Notice(Severity.INFO, "Arming motors"),)
        case events.Disarmed(reason=reason):
            stopped = Notice(Severity.INFO, "Disarming motors")
            if reason is DisarmReason.TERMINATION:
                return (Notice(Severity.EMERGENCY, "Terminating due to GCS request"), stopped)
            return (stopped,)
        case events.ArmingDenied():
            return arming_denied(event, MODE_NAMES)
        case events.ModeDenied(mode=mode, reason=reason, custom_mode=number):
            return (_mode_denied(mode, reason, number),)
        case events.CommandDenied(command=command, reason=reason):
            known = _COMMANDS.get((command, reason))
            return () if known is None else (known,)
        case events.FailsafeActivated(kind=FailsafeKind.POSITION_LOST, action=action):
            variance = Notice(Severity.CRITICAL, "EKF variance")
            mode = _EKF_MODES.get(action)
            if mode is None:
                return (variance,)
            return (
                variance,
                Notice(Severity.CRITICAL, f"EKF Failsafe: changed to {MODE_NAMES[mode]} Mode"),
            )
        case events.FailsafeActivated(kind=kind) if kind in _FAILSAFES:
            return (Notice(Severity.WARNING, _FAILSAFES[kind]),)
        case events.FailsafeCleared(kind=kind) if kind in _CLEARED:
            return (_CLEARED[kind],)
        case events.FenceBreached(walls=walls):
            return (Notice(Severity.NOTICE, f"{fence_names(walls)} breached"),)
        case events.FenceSwitched(walls=walls, on=on):
            return (Notice(Severity.NOTICE, f"{fence_names(walls)} auto-{'enabled' if on else 'disabled'}"),)
        case events.Crashed(angle_error_deg=error_deg, acceleration_m_s2=acceleration):
            text = f"Crash: Disarming: AngErr={error_deg:.0f}>30, Accel={acceleration:.1f}<3.0"
            return (Notice(Severity.EMERGENCY, text),)
        case events.BatteryWarning():
            return battery_warning(event)
        case events.MissionItemReached(index=index, navigation=True):
            return (Notice(Severity.INFO, f"Reached command #{index}"),)
    return ()


def arming_denied(event: events.ArmingDenied, mode_names: Mapping[FlightMode, str]) -> tuple[Notice, ...]:
    """A text for each reason, the same for both of ArduPilot's vehicles."""
    prefix = "PreArm" if event.check_only else "Arm"
    return tuple(
        Notice(Severity.CRITICAL, f"{prefix}: {describe(reason, event.mode, mode_names)}")
        for reason in event.reasons
        if not (event.check_only and reason is Reason.MODE_NOT_ARMABLE)
    )


def fence_names(walls: int) -> str:
    """The walls of a fence in ArduPilot's words."""
    names = [name for wall, name in _WALLS.items() if wall & walls]
    listed = ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else "".join(names)
    return f"{listed} fence{'s' if len(names) > 1 else ''}"


def battery_warning(event: events.BatteryWarning) -> tuple[Notice, ...]:
    """Both vehicles' texts about a battery."""
    word = "low" if event.level <= BatteryLevel.LOW else "critical"
    text = f"Battery 1 is {word} {event.voltage_v:.2f}V used {event.used_ah * 1000.0:.0f} mAh"
    return (Notice(Severity.WARNING, text),)


def describe(reason: Reason, mode: FlightMode, mode_names: Mapping[FlightMode, str] = MODE_NAMES) -> str:
    """One reason in ArduPilot's words."""
    if reason is Reason.MODE_NOT_ARMABLE:
        return f"{mode_names.get(mode, mode.name)} mode not armable"
    return _REASONS.get(reason, reason.name.replace("_", " ").capitalize())


def _mode_denied(mode: FlightMode | None, reason: Reason, number: int | None) -> Notice:
    if mode is None:
        name = REFUSED_NAMES.get(number) if number is not None else None
        if name is None:
            return Notice(Severity.WARNING, f"No such mode {number}")
        return Notice(Severity.WARNING, f"Mode change to {name} failed: init failed")
    why = _MODE_REASONS.get(reason, "init failed")
    return Notice(Severity.WARNING, f"Mode change to {MODE_NAMES.get(mode, mode.name)} failed: {why}")
