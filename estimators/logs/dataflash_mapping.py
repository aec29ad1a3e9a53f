"""ArduPilot's log messages as the MAVLink messages that estimators ask for.

Source: ArduPilot's log message documentation (ardupilot.org, "Onboard Message Log Messages", 4.x): angles in
degrees, pressures in pascal, IMU in SI.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from autopilot_bridge.mavlink import dialect
from estimators.logs.mapped import Array, Part, Records, each_second, mavlink_part, newest, value_at

_ACCELEROMETER_AND_GYRO: Final = 0b111111
_EV_ARMED, _EV_DISARMED = 10, 11
_HOME: Final = 1  # ORGN.Type
_TYPES: Final = {
    "ArduCopter": dialect.MAV_TYPE_QUADROTOR,
    "ArduPlane": dialect.MAV_TYPE_FIXED_WING,
    "ArduRover": dialect.MAV_TYPE_GROUND_ROVER,
    "Rover": dialect.MAV_TYPE_GROUND_ROVER,
    "ArduSub": dialect.MAV_TYPE_SUBMARINE,
}


def map_messages(tables: Mapping[str, Records], unix_offset_us: int | None) -> list[Part]:
    """MAVLink messages from what the log has.

    Args:
        tables: by name.
        unix_offset_us: Unix time of vehicle time 0; None: not known.
    """
    found = [
        *_imu(tables),
        *_attitude(tables),
        *_air(tables),
        *_positions(tables),
        *_home(tables),
        *_gps(tables),
        *_state(tables),
    ]
    if unix_offset_us is not None:
        times = each_second(tables.values())
        found.append(mavlink_part("SYSTEM_TIME", times, time_unix_usec=times + unix_offset_us))
    return [part for part in found if len(part.time_us)]


def _imu(tables: Mapping[str, Records]) -> list[Part]:
    imu = tables.get("IMU")
    if imu is None or not imu.has("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"):
        return []
    c = imu.columns
    return [
        mavlink_part(
            "HIGHRES_IMU",
            imu.time_us,
            xacc=c["AccX"],
            yacc=c["AccY"],
            zacc=c["AccZ"],
            xgyro=c["GyrX"],
            ygyro=c["GyrY"],
            zgyro=c["GyrZ"],
            temperature=c.get("T", 0.0),
            fields_updated=_ACCELEROMETER_AND_GYRO,
            id=c.get("I", 0),
        )
    ]


def _attitude(tables: Mapping[str, Records]) -> list[Part]:
    found = []
    attitude = tables.get("ATT")
    if attitude is not None and attitude.has("Roll", "Pitch", "Yaw"):
        times, rates = attitude.time_us, tables.get("RATE")
        found.append(
            mavlink_part(
                "ATTITUDE",
                times,
                **{axis: np.radians(attitude.columns[axis.capitalize()]) for axis in ("roll", "pitch")},
                yaw=_wrapped(np.radians(attitude.columns["Yaw"])),
                rollspeed=np.radians(value_at(rates, "R", times)),
                pitchspeed=np.radians(value_at(rates, "P", times)),
                yawspeed=np.radians(value_at(rates, "Y", times)),
            )
        )
    truth = tables.get("SIM")
    if truth is not None and truth.has("Roll", "Pitch", "Yaw", "Lat", "Lng"):
        found.append(
            mavlink_part(
                "SIMSTATE",
                truth.time_us,
                roll=np.radians(truth.columns["Roll"]),
                pitch=np.radians(truth.columns["Pitch"]),
                yaw=_wrapped(np.radians(truth.columns["Yaw"])),
                lat=truth.columns["Lat"] * 1e7,
                lng=truth.columns["Lng"] * 1e7,
            )
        )
    return found


def _air(tables: Mapping[str, Records]) -> list[Part]:
    found = []
    airspeed, baro, ekf = tables.get("ARSP"), tables.get("BARO"), tables.get("XKF1", tables.get("NKF1"))
    if airspeed is not None and airspeed.has("Airspeed"):
        found.append(
            mavlink_part(
                "AIRSPEED",
                airspeed.time_us,
                id=airspeed.columns.get("I", 0),
                airspeed=airspeed.columns["Airspeed"],
                temperature=100.0 * airspeed.columns.get("Temp", np.zeros(len(airspeed.time_us))),
                raw_press=airspeed.columns.get("DiffPress", np.zeros(len(airspeed.time_us))) / 100.0,
            )
        )
        first = airspeed.instance("I", 0)
        times = first.time_us
        found.append(
            mavlink_part(
                "VFR_HUD",
                times,
                airspeed=first.columns["Airspeed"],
                groundspeed=value_at(_first(tables.get("GPS")), "Spd", times),
                heading=np.mod(value_at(tables.get("ATT"), "Yaw", times), 360.0),
                throttle=value_at(tables.get("CTUN"), "ThO", times),
                alt=value_at(tables.get("POS"), "Alt", times),
                climb=-value_at(_first(ekf, "C"), "VD", times),
            )
        )
    if baro is not None and baro.has("Press"):
        first = baro.instance("I", 0)
        times = first.time_us
        found.append(
            mavlink_part(
                "SCALED_PRESSURE",
                times,
                press_abs=first.columns["Press"] / 100.0,
                press_diff=value_at(_first(airspeed), "DiffPress", times) / 100.0,
                temperature=100.0 * first.columns.get("Temp", np.zeros(len(times))),
            )
        )
    return found


def _positions(tables: Mapping[str, Records]) -> list[Part]:
    found = []
    ekf = _first(tables.get("XKF1", tables.get("NKF1")), "C")
    position = tables.get("POS")
    if ekf is not None and ekf.has("PN", "PE", "PD", "VN", "VE", "VD"):
        c = ekf.columns
        found.append(
            mavlink_part(
                "LOCAL_POSITION_NED",
                ekf.time_us,
                **{axis: c[name] for axis, name in zip("xyz", ("PN", "PE", "PD"), strict=True)},
                **{axis: c[name] for axis, name in zip(("vx", "vy", "vz"), ("VN", "VE", "VD"), strict=True)},
            )
        )
    if position is not None and position.has("Lat", "Lng", "Alt"):
        c, times = position.columns, position.time_us
        found.append(
            mavlink_part(
                "GLOBAL_POSITION_INT",
                times,
                lat=c["Lat"] * 1e7,
                lon=c["Lng"] * 1e7,
                alt=c["Alt"] * 1e3,
                relative_alt=c.get("RelHomeAlt", np.zeros(len(times))) * 1e3,
                vx=100.0 * value_at(ekf, "VN", times),
                vy=100.0 * value_at(ekf, "VE", times),
                vz=100.0 * value_at(ekf, "VD", times),
                hdg=100.0 * np.mod(value_at(tables.get("ATT"), "Yaw", times), 360.0),
            )
        )
    return found


def _home(tables: Mapping[str, Records]) -> list[Part]:
    """Its place in the local frame is not told."""
    places = tables.get("ORGN")
    if places is None or not places.has("Type", "Lat", "Lng", "Alt"):
        return []
    home = places.where(places.columns["Type"] == _HOME)
    return [
        mavlink_part(
            "HOME_POSITION",
            home.time_us,
            latitude=home.columns["Lat"] * 1e7,
            longitude=home.columns["Lng"] * 1e7,
            altitude=home.columns["Alt"] * 1e3,
            **dict.fromkeys(("x", "y", "z", "approach_x", "approach_y", "approach_z", "q"), np.nan),
        )
    ]


def _gps(tables: Mapping[str, Records]) -> list[Part]:
    found = []
    gps = tables.get("GPS")
    if gps is None or not gps.has("Status", "Lat", "Lng", "Alt", "Spd", "GCrs"):
        return []
    for number, name in ((0, "GPS_RAW_INT"), (1, "GPS2_RAW")):
        if number and "I" not in gps.columns:
            continue
        one = gps.instance("I", number)
        c = one.columns
        found.append(
            mavlink_part(
                name,
                one.time_us,
                fix_type=c["Status"],
                lat=c["Lat"] * 1e7,
                lon=c["Lng"] * 1e7,
                alt=c["Alt"] * 1e3,
                eph=c["HDop"] * 100.0 if "HDop" in c else 65535,
                epv=65535,
                vel=c["Spd"] * 100.0,
                cog=np.mod(c["GCrs"], 360.0) * 100.0,
                satellites_visible=c.get("NSats", 255),
            )
        )
    return found


def _state(tables: Mapping[str, Records]) -> list[Part]:
    found = []
    texts = tables.get("MSG")
    if texts is not None and texts.has("Message"):
        text = texts.columns["Message"].astype("S50")
        found.append(mavlink_part("STATUSTEXT", texts.time_us, severity=dialect.MAV_SEVERITY_INFO, text=text))
    mode = tables.get("MODE")
    if mode is None or not mode.has("ModeNum"):
        return found
    armed_us, armed = _armed(tables)
    times = np.union1d(each_second(tables.values()), np.concatenate((mode.time_us, armed_us)))
    times = times[times >= int(mode.time_us.min())]
    is_armed = newest(armed_us, armed, times).astype(bool)
    found.append(
        mavlink_part(
            "HEARTBEAT",
            times,
            type=_vehicle_type(texts),
            autopilot=dialect.MAV_AUTOPILOT_ARDUPILOTMEGA,
            base_mode=dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            + np.where(is_armed, dialect.MAV_MODE_FLAG_SAFETY_ARMED, 0),
            custom_mode=newest(mode.time_us, mode.columns["ModeNum"], times),
            system_status=np.where(is_armed, dialect.MAV_STATE_ACTIVE, dialect.MAV_STATE_STANDBY),
            mavlink_version=3,
        )
    )
    return found


def _armed(tables: Mapping[str, Records]) -> tuple[Array, Array]:
    """When it was armed (1) and disarmed (0)."""
    arm, events = tables.get("ARM"), tables.get("EV")
    if arm is not None and arm.has("ArmState"):
        return arm.time_us, (arm.columns["ArmState"] != 0).astype(np.int64)
    if events is not None and events.has("Id"):
        told = events.where(np.isin(events.columns["Id"], (_EV_ARMED, _EV_DISARMED)))
        return told.time_us, (told.columns["Id"] == _EV_ARMED).astype(np.int64)
    return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)


def _vehicle_type(texts: Records | None) -> int:
    if texts is not None and texts.has("Message"):
        for raw in texts.columns["Message"].tolist():
            word = raw.decode("ascii", "replace").split(" ", 1)[0]
            if word in _TYPES:
                return int(_TYPES[word])
    return int(dialect.MAV_TYPE_GENERIC)


def _first(table: Records | None, field: str = "I") -> Records | None:
    return None if table is None else table.instance(field, 0)


def _wrapped(angles_rad: Array) -> Array:
    wrapped: Array = np.mod(angles_rad + np.pi, 2.0 * np.pi) - np.pi
    return wrapped
