"""Checks of the state that the autopilot reports: sensors, arming, GPS, filter, home, battery, pilot."""

import math
from typing import Final

from autopilot_bridge.mavlink import dialect, enum_name, wire_units
from flightsim.foundation.geodesy import LocalFrame
from missions.preflight.finding import Finding, ok, problem, warning
from missions.preflight.snapshot import Snapshot
from missions.vehicle.arming_reasons import PREARM_BIT, bit_names, reasons_against_arming

_RC_BIT: Final = dialect.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
_NEEDED: Final = (
    dialect.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | dialect.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | dialect.MAV_SYS_STATUS_SENSOR_3D_MAG
    | dialect.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
    | dialect.MAV_SYS_STATUS_SENSOR_GPS
    | dialect.MAV_SYS_STATUS_AHRS
)
_SAID_ELSEWHERE: Final = PREARM_BIT | _RC_BIT | dialect.MAV_SYS_STATUS_SENSOR_BATTERY
_TERRAIN_BIT: Final = dialect.MAV_SYS_STATUS_TERRAIN
TERRAIN_PARAMETERS: Final = ("TERRAIN_FOLLOW", "RTL_ALT_TYPE")
"""ArduPilot flies by terrain data if one of them is not 0."""
_UNKNOWN_EPH: Final = 65535
_SATELLITES: Final = 6
_HDOP_WARN: Final = 2.0
_RATIO_BAD, _RATIO_WARN = 1.0, 0.5
_VARIANCE_BAD, _VARIANCE_WARN = 0.8, 0.5
_EKF_NEEDED: Final = 0x01 | 0x02 | 0x04 | 0x10 | 0x20  # attitude, velocities, absolute positions
_EKF_CONST_POS: Final = 0x80
_HOME_AWAY_M: Final = 30.0
_BATTERY_LOW, _BATTERY_HALF = 20, 50


def health_findings(snapshot: Snapshot) -> list[Finding]:
    """All health findings, in the order of a manual inspection."""
    return [
        *sensors(snapshot),
        arming(snapshot),
        gps(snapshot),
        navigation(snapshot),
        home(snapshot),
        battery(snapshot),
        remote_control(snapshot),
    ]


def sensors(snapshot: Snapshot) -> list[Finding]:
    """Finding about SYS_STATUS: sensors that are present and enabled, but not healthy."""
    enabled = snapshot.whole("SYS_STATUS", "onboard_control_sensors_enabled")
    health = snapshot.whole("SYS_STATUS", "onboard_control_sensors_health")
    present = snapshot.whole("SYS_STATUS", "onboard_control_sensors_present")
    if enabled is None or health is None or present is None:
        return [problem("sensors", "their health was not reported (SYS_STATUS)", "wait, or look at the link")]
    sick = enabled & present & ~health & ~_SAID_ELSEWHERE
    if not any(snapshot.parameters.get(name) for name in TERRAIN_PARAMETERS):
        sick &= ~_TERRAIN_BIT  # there is no terrain data here, and no use for it
    missing = _NEEDED & ~present & ~dialect.MAV_SYS_STATUS_AHRS
    findings = []
    if missing:
        findings.append(
            warning(
                "sensors", f"not fitted: {bit_names(missing)}", "see that this vehicle is meant to fly so"
            )
        )
    if sick & _NEEDED:
        findings.append(
            problem("sensors", f"not healthy: {bit_names(sick & _NEEDED)}", "calibrate or mend, and reboot")
        )
    if sick & ~_NEEDED:
        findings.append(warning("sensors", f"not healthy: {bit_names(sick & ~_NEEDED)}", "look at each"))
    return findings or [ok("sensors", f"healthy: {bit_names(enabled & present & health & _NEEDED)}")]


def arming(snapshot: Snapshot) -> Finding:
    """Whether it could be armed, and the reported reasons if not."""
    health = snapshot.whole("SYS_STATUS", "onboard_control_sensors_health")
    base_mode = snapshot.whole("HEARTBEAT", "base_mode") or 0
    if base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED:
        return warning("arming", "the vehicle is armed", "keep away from it")
    reasons = reasons_against_arming(snapshot.texts)
    if health is None:
        return problem("arming", "it is not known whether it could be armed", "wait, or look at the link")
    if health & PREARM_BIT:
        return ok("arming", "the pre-arm checks are passed")
    why = ": " + " / ".join(reasons) if reasons else ", and the autopilot does not say why"
    return problem("arming", f"the pre-arm checks are not passed{why}", "mend what it names")


def gps(snapshot: Snapshot) -> Finding:
    """Finding about fix, satellites and dilution."""
    fix = snapshot.whole("GPS_RAW_INT", "fix_type")
    if fix is None:
        return warning("GPS", "no receiver was reported", "a flight to places needs one")
    satellites = snapshot.whole("GPS_RAW_INT", "satellites_visible") or 0
    eph = snapshot.whole("GPS_RAW_INT", "eph")
    hdop = None if eph is None or eph == _UNKNOWN_EPH else eph / 100.0
    shown = f"{satellites} satellites" + ("" if hdop is None else f", HDOP {hdop:.1f}")
    if fix < dialect.GPS_FIX_TYPE_3D_FIX:
        name = enum_name("GPS_FIX_TYPE", fix) or f"fix type {fix}"
        return problem("GPS", f"{name}, {shown}", "wait for a 3D fix, under open sky")
    if satellites < _SATELLITES or (hdop is not None and hdop > _HDOP_WARN):
        return warning(
            "GPS", f"3D fix, {shown}", f"wait for {_SATELLITES} satellites and HDOP {_HDOP_WARN:g}"
        )
    return ok("GPS", f"3D fix, {shown}")


def navigation(snapshot: Snapshot) -> Finding:
    """Finding about the filter's flags and the test ratios of its measurements."""
    if "EKF_STATUS_REPORT" in snapshot.messages:
        return _ekf_status_report(snapshot)
    flags = snapshot.whole("ESTIMATOR_STATUS", "flags")
    if flags is None:
        return warning("navigation", "the filter's state is not reported", "ask for it, or look at the link")
    if not flags & dialect.ESTIMATOR_POS_HORIZ_ABS or not flags & dialect.ESTIMATOR_ATTITUDE:
        return problem(
            "navigation", "the filter has no position or no attitude", "wait for GPS, keep it still"
        )
    ratios = {
        name: snapshot.number("ESTIMATOR_STATUS", f"{name}_ratio") or 0.0
        for name in ("vel", "pos_horiz", "pos_vert", "mag")
    }
    return _fit(ratios, "test ratio", _RATIO_WARN, _RATIO_BAD)


def _ekf_status_report(snapshot: Snapshot) -> Finding:
    flags = snapshot.whole("EKF_STATUS_REPORT", "flags") or 0
    if flags & _EKF_NEEDED != _EKF_NEEDED or flags & _EKF_CONST_POS:
        return problem(
            "navigation", "the filter has no position or no attitude", "wait for GPS, keep it still"
        )
    names = ("velocity", "pos_horiz", "pos_vert", "compass")
    variances = {n: snapshot.number("EKF_STATUS_REPORT", f"{n}_variance") or 0.0 for n in names}
    return _fit(variances, "variance", _VARIANCE_WARN, _VARIANCE_BAD)


def _fit(values: dict[str, float], what: str, warn: float, bad: float) -> Finding:
    name, worst = max(values.items(), key=lambda entry: entry[1])
    text = f"position and attitude are estimated, largest {what} {worst:.2f} ({name})"
    if worst > bad:
        return problem("navigation", text, f"measurements don't fit: wait until it is below {bad:g}")
    if worst > warn:
        return warning("navigation", text, "measurements fit badly: look at compass and GPS")
    return ok("navigation", text)


def home(snapshot: Snapshot) -> Finding:
    """Finding about the home position and the vehicle's place."""
    lat = snapshot.whole("HOME_POSITION", "latitude")
    lon = snapshot.whole("HOME_POSITION", "longitude")
    alt = snapshot.whole("HOME_POSITION", "altitude")
    place = None if lat is None or lon is None or alt is None else wire_units.home(lat, lon, alt)
    if place is None:
        return problem(
            "home", "not set: there would be no way back", "wait for GPS; it is set when it is ready"
        )
    text = f"{place.lat_deg:.6f}, {place.lon_deg:.6f}, {place.alt_m:.0f} m"
    lat, lon = snapshot.whole("GLOBAL_POSITION_INT", "lat"), snapshot.whole("GLOBAL_POSITION_INT", "lon")
    if lat is not None and lon is not None:
        north, east, _ = LocalFrame(place).ned_from_geodetic(
            wire_units.degrees(lat), wire_units.degrees(lon), place.alt_m
        )
        away_m = math.hypot(north, east)
        armed = (snapshot.whole("HEARTBEAT", "base_mode") or 0) & dialect.MAV_MODE_FLAG_SAFETY_ARMED
        if away_m > _HOME_AWAY_M and not armed:
            return warning(
                "home", f"{text}, {away_m:.0f} m from the vehicle", "arming sets it anew, or set it"
            )
    return ok("home", text)


def battery(snapshot: Snapshot) -> Finding:
    """Finding about voltage and charge."""
    voltage_mv = snapshot.whole("SYS_STATUS", "voltage_battery")
    remaining = snapshot.whole("SYS_STATUS", "battery_remaining")
    if voltage_mv in (None, 0, 0xFFFF) and remaining in (None, -1):
        return warning(
            "battery", "not measured", "there will be no warning before it is empty: set the monitor up"
        )
    parts = []
    if voltage_mv not in (None, 0, 0xFFFF):
        parts.append(f"{(voltage_mv or 0) * 1e-3:.1f} V")
    if remaining in (None, -1):
        return warning("battery", f"{parts[0]}, charge not known", "see that it is full")
    parts.append(f"{remaining} %")
    assert remaining is not None
    if remaining < _BATTERY_LOW:
        return problem("battery", ", ".join(parts), "charge it")
    if remaining < _BATTERY_HALF:
        return warning("battery", ", ".join(parts), "see that it lasts")
    return ok("battery", ", ".join(parts))


def remote_control_received(snapshot: Snapshot) -> bool:
    """Whether the autopilot receives a remote control, so that a pilot has sticks."""
    present = snapshot.whole("SYS_STATUS", "onboard_control_sensors_present") or 0
    health = snapshot.whole("SYS_STATUS", "onboard_control_sensors_health") or 0
    if present & _RC_BIT:  # a receiver that has lost its transmitter may still send its last channels
        return bool(health & _RC_BIT)
    return (snapshot.whole("RC_CHANNELS", "chancount") or 0) > 0


def remote_control(snapshot: Snapshot) -> Finding:
    """Finding on whether a pilot could take over."""
    if remote_control_received(snapshot):
        rssi = snapshot.whole("RC_CHANNELS", "rssi")
        strength = "" if rssi in (None, 255, 0) else f", signal {100 * (rssi or 0) // 254} %"
        return ok("remote control", f"received{strength}")
    return warning(
        "remote control",
        "none is received",
        "a pilot can take over by this link only; make sure that you want that",
    )
