"""The state of an ArduPilot vehicle from its onboard log: type, modes, armed, landed, parameters.

No single message is reliable. Logs that begin with arming contain only the disarming, logs of 2013 contain
neither, and the logged messages depend on the vehicle and LOG_BITMASK.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from autopilot_bridge.mavlink import dialect
from estimators.logs.ardupilot_firmware import Firmware, firmware_of, mode_number
from estimators.logs.mapped import Array, Part, Records, each_second, mavlink_part, newest

_EV_ARMED, _EV_DISARMED, _EV_LANDED, _EV_NOT_LANDED = 10, 11, 18, 28
_RUNNING_PERCENT: Final = 10.0
_MOVING_M_S: Final = 4.0
_PWM_RUNNING: Final = 1150
_PWM_LEAST: Final = 800
_MOTORS: Final = (
    ("C1", "C2", "C3", "C4"),
    ("Ch1", "Ch2", "Ch3", "Ch4"),
    ("Chan1", "Chan2", "Chan3", "Chan4"),
)
_THROTTLE_CHANNEL: Final = 2


def firmware(tables: Mapping[str, Records], banner: str = "") -> Firmware:
    """The firmware that wrote the log; `banner` is text outside the messages."""
    builds = tables["VER"].columns["BU"].tolist() if "VER" in tables and tables["VER"].has("BU") else ()
    return firmware_of([banner, *_texts(tables)], parameters(tables), builds)


def parameters(tables: Mapping[str, Records]) -> dict[str, float]:
    """The vehicle's parameters, newest values."""
    parm = tables.get("PARM")
    if parm is None or not parm.has("Name", "Value"):
        return {}
    names = [name.decode("ascii", "replace") for name in parm.columns["Name"].tolist()]
    return dict(zip(names, parm.columns["Value"].tolist(), strict=True))


def throttle(tables: Mapping[str, Records], made_by: Firmware) -> Records | None:
    """Throttle output to the motors, column `percent`; None when the log has none."""
    tune = tables.get("CTUN")
    name = None if tune is None else next((n for n in ("ThO", "ThrOut") if n in tune.columns), None)
    if tune is not None and name is not None:
        raw = tune.columns[name]
        factor = 1.0
        if made_by.vehicle != "plane":  # since Copter 3.4 a fraction, before that in thousandths
            factor = 100.0 if raw.dtype.kind == "f" and np.nanmax(np.abs(raw)) <= 2.0 else 0.1
        return Records(tune.time_us, {"percent": raw.astype(np.float64) * factor})
    return None


def state_parts(tables: Mapping[str, Records], made_by: Firmware, banner: str = "") -> list[Part]:
    """HEARTBEAT, EXTENDED_SYS_STATE, STATUSTEXT and PARAM_VALUE."""
    found = []
    texts = tables.get("MSG")
    if texts is not None and texts.has("Message"):
        text = texts.columns["Message"].astype("S50")
        found.append(mavlink_part("STATUSTEXT", texts.time_us, severity=dialect.MAV_SEVERITY_INFO, text=text))
    elif banner:
        first = np.array([min(int(records.time_us.min()) for records in tables.values())])
        text = np.array([banner.encode("ascii", "replace")], dtype="S50")
        found.append(mavlink_part("STATUSTEXT", first, severity=dialect.MAV_SEVERITY_INFO, text=text))
    parm = tables.get("PARM")
    if parm is not None and parm.has("Name", "Value"):
        found.append(
            mavlink_part(
                "PARAM_VALUE",
                parm.time_us,
                param_id=parm.columns["Name"].astype("S16"),
                param_value=parm.columns["Value"],
                param_type=dialect.MAV_PARAM_TYPE_REAL32,
                param_count=len(np.unique(parm.columns["Name"])),
                param_index=65535,
            )
        )
    return [*found, *_heartbeats(tables, made_by), *_landed(tables)]


def _heartbeats(tables: Mapping[str, Records], made_by: Firmware) -> list[Part]:
    modes_us, modes = _modes(tables, made_by)
    armed_us, armed = _armed(tables, made_by)
    if not len(modes_us) and not len(armed_us) and not made_by.vehicle:
        return []
    times = np.union1d(each_second(tables.values()), np.concatenate((modes_us, armed_us)))
    before = float(modes[0]) if len(modes) else 0.0  # the mode at the beginning of the log is its first entry
    is_armed = newest(armed_us, armed, times).astype(bool)
    return [
        mavlink_part(
            "HEARTBEAT",
            times,
            type=made_by.mav_type,
            autopilot=dialect.MAV_AUTOPILOT_ARDUPILOTMEGA,
            base_mode=(dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED if len(modes) else 0)
            + np.where(is_armed, dialect.MAV_MODE_FLAG_SAFETY_ARMED, 0),
            custom_mode=newest(modes_us, modes, times, before),
            system_status=np.where(is_armed, dialect.MAV_STATE_ACTIVE, dialect.MAV_STATE_STANDBY),
            mavlink_version=3,
        )
    ]


def _modes(tables: Mapping[str, Records], made_by: Firmware) -> tuple[Array, Array]:
    """Times at which modes began, and the modes."""
    nothing = np.empty(0, dtype=np.int64)
    mode = tables.get("MODE")
    if mode is None:
        return nothing, nothing
    column = mode.columns.get("ModeNum", mode.columns.get("Mode"))
    if column is None:
        return nothing, nothing
    if column.dtype.kind != "S":
        return mode.time_us, column.astype(np.int64)
    numbers = [mode_number(made_by.mav_type, name.decode("ascii", "replace")) for name in column.tolist()]
    known = np.array([number is not None for number in numbers], dtype=bool)
    values = np.array([number or 0 for number in numbers], dtype=np.int64)
    return mode.time_us[known], values[known]


def _armed(tables: Mapping[str, Records], made_by: Firmware) -> tuple[Array, Array]:
    """Times of arming (1) and disarming (0), and these states."""
    times, states = _armed_events(tables)
    start_us = min(int(records.time_us.min()) for records in tables.values())
    if len(times):
        if not states[0]:  # a log that begins with arming contains only the disarming
            times, states = np.concatenate(([start_us], times)), np.concatenate(([1], states))
        return times, states
    running = _running_us(tables, made_by)
    if len(running):
        return np.array([running.min(), running.max() + 1]), np.array([1, 0])
    return times, states


def _armed_events(tables: Mapping[str, Records]) -> tuple[Array, Array]:
    times, states = [], []
    arm, events = tables.get("ARM"), tables.get("EV")
    if arm is not None and arm.has("ArmState"):
        times.append(arm.time_us)
        states.append((arm.columns["ArmState"] != 0).astype(np.int64))
    if events is not None and events.has("Id"):
        reported = events.where(np.isin(events.columns["Id"], (_EV_ARMED, _EV_DISARMED)))
        times.append(reported.time_us)
        states.append((reported.columns["Id"] == _EV_ARMED).astype(np.int64))
    if not times:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    all_times, all_states = np.concatenate(times), np.concatenate(states)
    sorting = np.argsort(all_times, kind="stable")
    return all_times[sorting], all_states[sorting]


def _running_us(tables: Mapping[str, Records], made_by: Firmware) -> Array:
    """Times at which motors ran or the vehicle moved, so that it must have been armed."""
    found = [np.empty(0, dtype=np.int64)]
    power = throttle(tables, made_by)
    if power is not None:
        found.append(power.time_us[power.columns["percent"] > _RUNNING_PERCENT])
    outputs = tables.get("RCOU")
    names = next((n for n in _MOTORS if outputs is not None and outputs.has(*n)), None)
    if power is None and outputs is not None and names is not None:
        pwm = np.column_stack([outputs.columns[name] for name in names])
        if made_by.vehicle not in ("copter", "heli"):
            pwm = pwm[:, _THROTTLE_CHANNEL : _THROTTLE_CHANNEL + 1]
        found.append(
            outputs.time_us[
                np.all((pwm > _PWM_RUNNING) | (pwm < _PWM_LEAST), axis=1) & (pwm.max(axis=1) > _PWM_RUNNING)
            ]
        )
    gps = tables.get("GPS")
    if gps is not None and gps.has("Spd", "Status"):
        found.append(
            gps.time_us[
                (gps.columns["Spd"] > _MOVING_M_S) & (gps.columns["Status"] >= dialect.GPS_FIX_TYPE_3D_FIX)
            ]
        )
    return np.concatenate(found)


def _landed(tables: Mapping[str, Records]) -> list[Part]:
    """EXTENDED_SYS_STATE, when the log contains the output of the land detector."""
    events = tables.get("EV")
    if events is None or not events.has("Id"):
        return []
    reported = events.where(
        np.isin(events.columns["Id"], (_EV_ARMED, _EV_DISARMED, _EV_LANDED, _EV_NOT_LANDED))
    )
    codes = reported.columns["Id"]
    if not np.isin(codes, (_EV_LANDED, _EV_NOT_LANDED)).any():
        return []
    in_air = (codes == _EV_NOT_LANDED).astype(np.int64)
    before = 1.0 if codes[0] in (_EV_LANDED, _EV_DISARMED) else 0.0
    times = np.union1d(each_second(tables.values()), reported.time_us)
    state = np.where(
        newest(reported.time_us, in_air, times, before) != 0,
        dialect.MAV_LANDED_STATE_IN_AIR,
        dialect.MAV_LANDED_STATE_ON_GROUND,
    )
    return [mavlink_part("EXTENDED_SYS_STATE", times, landed_state=state)]


def _texts(tables: Mapping[str, Records]) -> list[str]:
    texts = tables.get("MSG")
    if texts is None or not texts.has("Message"):
        return []
    return [text.decode("ascii", "replace") for text in texts.columns["Message"].tolist()]
