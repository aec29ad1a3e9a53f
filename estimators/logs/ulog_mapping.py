"""PX4's uORB topics, converted to the MAVLink messages that estimators need.

Source: PX4's message definitions (docs.px4.io, "uORB message reference", 1.12 to 1.16) and MAVLink streams.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import to_e7
from estimators.logs.mapped import Array, Part, Records, each_second, mappable, mavlink_part, newest, value_at
from flightsim.foundation.vectors import euler_from_quaternions

_ACCELEROMETER_AND_GYRO: Final = 0b111111
_TYPE_OF_CLASS: Final = {  # VEHICLE_TYPE of vehicle_status
    1: dialect.MAV_TYPE_QUADROTOR,
    2: dialect.MAV_TYPE_FIXED_WING,
    3: dialect.MAV_TYPE_GROUND_ROVER,
}
_ARMED: Final = 2  # vehicle_status: ARMING_STATE_ARMED
_MAIN_MANUAL, _MAIN_ALTITUDE, _MAIN_POSITION, _MAIN_AUTO, _MAIN_ACRO, _MAIN_OFFBOARD, _MAIN_STABILIZED = (
    range(1, 8)
)
_CUSTOM_MODES: Final = {  # NAVIGATION_STATE of vehicle_status: PX4's main and sub mode
    0: (_MAIN_MANUAL, 0),
    1: (_MAIN_ALTITUDE, 0),
    2: (_MAIN_POSITION, 0),
    3: (_MAIN_AUTO, 4),
    4: (_MAIN_AUTO, 3),
    5: (_MAIN_AUTO, 5),
    10: (_MAIN_ACRO, 0),
    14: (_MAIN_OFFBOARD, 0),
    15: (_MAIN_STABILIZED, 0),
    17: (_MAIN_AUTO, 2),
    18: (_MAIN_AUTO, 6),
    19: (_MAIN_AUTO, 8),
    20: (_MAIN_AUTO, 9),
    21: (_MAIN_POSITION, 1),
}
_LAST_YAW_ROTATION: Final = 7
"""Largest SENS_BOARD_ROT that is a rotation about z, in steps of 45 degrees."""
_LANDED, _IN_AIR = dialect.MAV_LANDED_STATE_ON_GROUND, dialect.MAV_LANDED_STATE_IN_AIR


_WIDTHS: Final = {"q": 4, "xyz": 3, "gyro_rad": 3, "accelerometer_m_s2": 3}
"""Lengths of the arrays that are used here."""

Topics = Mapping[tuple[str, int], Records]
"""Topics by name and instance."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UlogFacts:
    """Data of a log besides its topics.

    Attributes:
        texts: pyulog's logged messages.
        base_us: time of the file at vehicle time 0.
        parameters: parameters of the vehicle at the beginning of the log.
        version: `ver_sw_release`; 0: not known.
    """

    texts: Iterable[Any]
    base_us: int
    parameters: Mapping[str, float]
    version: int


def map_topics(topics: Topics, facts: UlogFacts, unix_offset_us: int | None) -> list[Part]:
    """Convert the log's topics to MAVLink messages.

    Args:
        topics: topics by name and instance.
        facts: data of the log besides its topics.
        unix_offset_us: Unix time of vehicle time 0; None: not known.
    """
    topics = {key: mappable(records, texts=(), widths=_WIDTHS) for key, records in topics.items()}
    found = [
        *_imu(topics, facts.parameters),
        *_attitude(topics),
        *_air(topics),
        *_positions(topics),
        *_home(topics),
        *_gps(topics),
        *_state(topics),
        *_truth(topics),
        *_texts(facts.texts, facts.base_us),
        *_vehicle(topics, facts),
    ]
    if unix_offset_us is not None:
        times = each_second(topics.values())
        found.append(mavlink_part("SYSTEM_TIME", times, time_unix_usec=times + unix_offset_us))
    return [part for part in found if len(part.time_us)]


def _find(topics: Topics, names: Iterable[str], *fields: str) -> Records | None:
    """The first existing topic of the given ones that has these fields."""
    return next((t for name in names if (t := topics.get((name, 0))) is not None and t.has(*fields)), None)


def board_rotation(parameters: Mapping[str, float]) -> Array | None:
    """R_vehicle_from_board of SENS_BOARD_ROT and SENS_BOARD_*_OFF; None when the rotation is not about z.

    PX4 1.16.1 (`sensor_calibration`): the offset's rotation times the board's. It is already applied in
    `sensor_combined`, but not in the topics of single sensors.
    """
    steps = int(parameters.get("SENS_BOARD_ROT", 0.0))
    if not 0 <= steps <= _LAST_YAW_ROTATION:
        return None
    roll, pitch, yaw = (np.radians(parameters.get(f"SENS_BOARD_{axis}_OFF", 0.0)) for axis in "XYZ")
    return _about(2, yaw) @ _about(1, pitch) @ _about(0, roll) @ _about(2, steps * np.pi / 4.0)


def _about(axis: int, angle_rad: float) -> Array:
    """Rotation about x, y or z."""
    rotation = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    rotation[i, i] = rotation[j, j] = np.cos(angle_rad)
    rotation[i, j], rotation[j, i] = -np.sin(angle_rad), np.sin(angle_rad)
    return rotation


def _vehicle(topics: Topics, facts: UlogFacts) -> list[Part]:
    """AUTOPILOT_VERSION and PARAM_VALUE at the beginning of the log."""
    start = min(int(records.time_us.min()) for records in topics.values())
    found = []
    if facts.version:
        found.append(mavlink_part("AUTOPILOT_VERSION", np.array([start]), flight_sw_version=facts.version))
    if facts.parameters:
        names = np.array([name.encode("ascii", "replace") for name in facts.parameters], dtype="S16")
        found.append(
            mavlink_part(
                "PARAM_VALUE",
                np.full(len(names), start),
                param_id=names,
                param_value=np.array(list(facts.parameters.values())),
                param_type=dialect.MAV_PARAM_TYPE_REAL32,
                param_count=len(names),
                param_index=np.arange(len(names)),
            )
        )
    return found


def _imu(topics: Topics, parameters: Mapping[str, float]) -> list[Part]:
    """IMU messages in the vehicle's frame. The voted pair of sensors is number 0; the others follow by
    instance.
    """
    samples: list[tuple[Array, Array, Array, int]] = []  # times, rates, specific forces, number
    combined = _find(topics, ("sensor_combined",), "gyro_rad", "accelerometer_m_s2")
    if combined is not None:
        c = combined.columns
        samples.append((combined.time_us, c["gyro_rad"], c["accelerometer_m_s2"], 0))
    rotation = board_rotation(parameters)
    for number in range(0 if combined is None else 1, 4 if rotation is not None else 0):
        rates, forces = topics.get(("sensor_gyro", number)), topics.get(("sensor_accel", number))
        if rates is None or forces is None or not (rates.has("x", "y", "z") and forces.has("x", "y", "z")):
            continue
        gyro = np.column_stack([rates.columns[axis] for axis in "xyz"])
        force = np.column_stack([value_at(forces, axis, rates.time_us, np.nan) for axis in "xyz"])
        known = np.isfinite(force).all(axis=1)
        assert rotation is not None
        samples.append((rates.time_us[known], gyro[known] @ rotation.T, force[known] @ rotation.T, number))
    if not samples:
        return []
    times, gyros, accelerometers, numbers = zip(*samples, strict=True)
    gyro, accelerometer = np.concatenate(gyros), np.concatenate(accelerometers)
    return [
        mavlink_part(
            "HIGHRES_IMU",
            np.concatenate(times),
            **{f"{axis}gyro": gyro[:, index] for index, axis in enumerate("xyz")},
            **{f"{axis}acc": accelerometer[:, index] for index, axis in enumerate("xyz")},
            fields_updated=_ACCELEROMETER_AND_GYRO,
            id=np.repeat(numbers, [len(part) for part in times]),
        )
    ]


def _attitude(topics: Topics) -> list[Part]:
    attitude = _find(topics, ("vehicle_attitude",), "q")
    if attitude is None:
        return []
    times, q = attitude.time_us, attitude.columns["q"]
    rates = _find(topics, ("vehicle_angular_velocity",), "xyz")
    body = [np.zeros(len(times))] * 3
    if rates is not None:
        body = [newest(rates.time_us, rates.columns["xyz"][:, axis], times) for axis in range(3)]
    speeds = dict(zip(("rollspeed", "pitchspeed", "yawspeed"), body, strict=True))
    roll, pitch, yaw = euler_from_quaternions(q)
    return [
        mavlink_part("ATTITUDE", times, roll=roll, pitch=pitch, yaw=yaw, **speeds),
        mavlink_part("ATTITUDE_QUATERNION", times, q1=q[:, 0], q2=q[:, 1], q3=q[:, 2], q4=q[:, 3], **speeds),
    ]


def _air(topics: Topics) -> list[Part]:
    found = []
    local = _find(topics, ("vehicle_local_position",), "vx", "vy", "vz")
    place = _find(topics, ("vehicle_global_position",), "alt")
    for names, field in (
        (("airspeed_validated",), "calibrated_airspeed_m_s"),
        (("airspeed",), "indicated_airspeed_m_s"),
    ):
        airspeed = _find(topics, names, field)
        if airspeed is not None and np.isfinite(airspeed.columns[field]).any():
            good = np.isfinite(airspeed.columns[field])
            times = airspeed.time_us[good]
            heading = np.degrees(value_at(local, "heading", times))
            thrust = _find(topics, ("vehicle_thrust_setpoint",), "xyz")
            throttle = 0.0 if thrust is None else newest(thrust.time_us, thrust.columns["xyz"][:, 0], times)
            found.append(
                mavlink_part(
                    "VFR_HUD",
                    times,
                    airspeed=airspeed.columns[field][good],
                    groundspeed=np.hypot(value_at(local, "vx", times), value_at(local, "vy", times)),
                    heading=np.mod(heading, 360.0),
                    throttle=100.0 * np.clip(throttle, 0.0, 1.0),
                    alt=value_at(place, "alt", times),
                    climb=-value_at(local, "vz", times),
                )
            )
            break
    pressure = _find(topics, ("vehicle_air_data",), "baro_pressure_pa")
    field = "baro_pressure_pa"
    if pressure is None:
        pressure, field = _find(topics, ("sensor_baro",), "pressure"), "pressure"
    if pressure is not None:
        difference = _find(topics, ("differential_pressure",), "differential_pressure_pa")
        times = pressure.time_us
        found.append(
            mavlink_part(
                "SCALED_PRESSURE",
                times,
                press_abs=pressure.columns[field] / 100.0,
                press_diff=value_at(difference, "differential_pressure_pa", times) / 100.0,
                temperature=100.0 * value_at(pressure, "baro_temp_celcius", times),
            )
        )
    return found


def _positions(topics: Topics) -> list[Part]:
    found = []
    local = _find(topics, ("vehicle_local_position",), "x", "y", "z", "vx", "vy", "vz")
    if local is not None:
        axes = ("x", "y", "z", "vx", "vy", "vz")
        found.append(
            mavlink_part("LOCAL_POSITION_NED", local.time_us, **{axis: local.columns[axis] for axis in axes})
        )
    place = _find(topics, ("vehicle_global_position",), "lat", "lon", "alt")
    if place is not None:
        c, times = place.columns, place.time_us
        home = _valid_home(topics)
        base = value_at(home, "alt", times, float(c["alt"][0]))
        found.append(
            mavlink_part(
                "GLOBAL_POSITION_INT",
                times,
                lat=to_e7(c["lat"]),
                lon=to_e7(c["lon"]),
                alt=c["alt"].astype(np.float64) * 1e3,
                relative_alt=(c["alt"] - base) * 1e3,
                **{axis: 100.0 * value_at(local, axis, times) for axis in ("vx", "vy", "vz")},
                hdg=100.0 * np.mod(np.degrees(value_at(local, "heading", times)), 360.0),
            )
        )
    return found


def _home(topics: Topics) -> list[Part]:
    home = _valid_home(topics)
    if home is None:
        return []
    c = home.columns
    return [
        mavlink_part(
            "HOME_POSITION",
            home.time_us,
            latitude=to_e7(c["lat"]),
            longitude=to_e7(c["lon"]),
            altitude=c["alt"].astype(np.float64) * 1e3,
            **{axis: c.get(axis, np.nan) for axis in "xyz"},
            **dict.fromkeys(("approach_x", "approach_y", "approach_z", "q"), np.nan),
        )
    ]


def _valid_home(topics: Topics) -> Records | None:
    home = _find(topics, ("home_position",), "lat", "lon", "alt")
    if home is None or not home.has("valid_hpos"):
        return home
    known = home.columns["valid_hpos"] != 0
    return Records(home.time_us[known], {name: column[known] for name, column in home.columns.items()})


def _gps(topics: Topics) -> list[Part]:
    gps = _find(topics, ("vehicle_gps_position", "sensor_gps"), "fix_type")
    if gps is None:
        return []
    c, times = gps.columns, gps.time_us
    if gps.has("latitude_deg", "longitude_deg", "altitude_msl_m"):  # since 1.14
        place = to_e7(c["latitude_deg"]), to_e7(c["longitude_deg"]), c["altitude_msl_m"] * 1e3
    elif gps.has("lat", "lon", "alt"):
        place = c["lat"], c["lon"], c["alt"]
    else:
        return []
    nothing = np.zeros(len(times))
    return [
        mavlink_part(
            "GPS_RAW_INT",
            times,
            fix_type=c["fix_type"],
            lat=place[0],
            lon=place[1],
            alt=place[2],
            eph=c.get("hdop", nothing) * 100.0,
            epv=c.get("vdop", nothing) * 100.0,
            vel=c.get("vel_m_s", nothing) * 100.0,
            cog=np.mod(np.degrees(c.get("cog_rad", nothing)), 360.0) * 100.0,
            satellites_visible=c.get("satellites_used", 255),
            h_acc=c.get("eph", nothing) * 1e3,
            v_acc=c.get("epv", nothing) * 1e3,
            vel_acc=c.get("s_variance_m_s", nothing) * 1e3,
        )
    ]


def _state(topics: Topics) -> list[Part]:
    found = []
    status = _find(topics, ("vehicle_status",), "nav_state", "arming_state")
    if status is not None:
        times = np.union1d(each_second(topics.values()), status.time_us)
        times = times[times >= int(status.time_us.min())]
        armed = value_at(status, "arming_state", times) == _ARMED
        modes = np.array(
            [_custom_mode(int(state)) for state in status.columns["nav_state"]], dtype=np.float64
        )
        kind = _mav_types(status)
        found.append(
            mavlink_part(
                "HEARTBEAT",
                times,
                type=newest(status.time_us, kind, times),
                autopilot=dialect.MAV_AUTOPILOT_PX4,
                base_mode=dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
                + np.where(armed, dialect.MAV_MODE_FLAG_SAFETY_ARMED, 0),
                custom_mode=newest(status.time_us, modes, times),
                system_status=np.where(armed, dialect.MAV_STATE_ACTIVE, dialect.MAV_STATE_STANDBY),
                mavlink_version=3,
            )
        )
    landed = _find(topics, ("vehicle_land_detected",), "landed")
    if landed is not None:
        times = each_second(topics.values())
        times = np.union1d(times[times >= int(landed.time_us.min())], landed.time_us)
        on_ground = value_at(landed, "landed", times) != 0
        state = np.where(on_ground, _LANDED, _IN_AIR)
        found.append(mavlink_part("EXTENDED_SYS_STATE", times, landed_state=state))
    return found


def _truth(topics: Topics) -> list[Part]:
    attitude = _find(topics, ("vehicle_attitude_groundtruth",), "q")
    if attitude is None:
        return []
    times = attitude.time_us
    place = _find(topics, ("vehicle_global_position_groundtruth",), "lat", "lon", "alt")
    local = _find(topics, ("vehicle_local_position_groundtruth",), "vx", "vy", "vz")
    return [
        mavlink_part(
            "HIL_STATE_QUATERNION",
            times,
            attitude_quaternion=attitude.columns["q"],
            lat=to_e7(value_at(place, "lat", times)),
            lon=to_e7(value_at(place, "lon", times)),
            alt=1e3 * value_at(place, "alt", times),
            **{axis: 100.0 * value_at(local, axis, times) for axis in ("vx", "vy", "vz")},
        )
    ]


def _texts(texts: Iterable[Any], base_us: int) -> list[Part]:
    rows = [(int(item.timestamp) - base_us, _severity(item.log_level), str(item.message)) for item in texts]
    if not rows:
        return []
    text = np.array([message.encode("ascii", "replace")[:50] for _, _, message in rows], dtype="S50")
    times = np.array([time_us for time_us, _, _ in rows], dtype=np.int64)
    return [mavlink_part("STATUSTEXT", times, severity=np.array([s for _, s, _ in rows]), text=text)]


def _severity(log_level: Any) -> int:
    """Severity of a ULog message, whose log levels are syslog levels as ASCII digits."""
    number = ord(log_level) if isinstance(log_level, (str, bytes)) and len(log_level) == 1 else int(log_level)
    number = number - ord("0") if number >= ord("0") else number
    return min(max(number, 0), dialect.MAV_SEVERITY_DEBUG)


def _mav_types(status: Records) -> Array:
    """MAV_TYPE of each vehicle_status; from the class of the vehicle when an old log has no system_type."""
    if "system_type" in status.columns:
        return status.columns["system_type"]
    classes = status.columns.get("vehicle_type", np.zeros(len(status.time_us), dtype=np.int64))
    return np.array([_TYPE_OF_CLASS.get(int(item), dialect.MAV_TYPE_GENERIC) for item in classes])


def _custom_mode(nav_state: int) -> int:
    main, sub = _CUSTOM_MODES.get(nav_state, (0, 0))
    return main << 16 | sub << 24
