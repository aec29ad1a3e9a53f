"""PX4's onboard logs from before 2016 (sdlog2, .bin, .px4log), converted to the messages that estimators
need.

Source: the messages of PX4's sdlog2 module (`sdlog2_messages.h`, 1.0 to 1.6): SI units, radians, PX4's body
frame. `GPS` is in degrees.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import to_e7
from estimators.logs.mapped import Array, Part, Records, each_second, mavlink_part, newest, value_at

_ACCELEROMETER_AND_GYRO: Final = 0b111111
_ARMED: Final = 2  # STAT.ArmS: ARMING_STATE_ARMED
_IN_ERROR: Final = 3
_MAIN_AUTO: Final = 4
_CUSTOM_MODES: Final = {  # STAT.MainState (commander_state): PX4's main and sub mode
    0: (1, 0),
    1: (2, 0),
    2: (3, 0),
    3: (_MAIN_AUTO, 4),
    4: (_MAIN_AUTO, 3),
    5: (_MAIN_AUTO, 5),
    6: (5, 0),
    7: (6, 0),
    8: (7, 0),
    9: (8, 0),
    10: (_MAIN_AUTO, 2),
    11: (_MAIN_AUTO, 6),
    12: (_MAIN_AUTO, 8),
}


def map_sdlog2(tables: Mapping[str, Records], unix_offset_us: int | None, banner: str = "") -> list[Part]:
    """Convert the log's tables to MAVLink messages; arguments as in `dataflash_mapping.map_messages`."""
    found = [*_imu(tables), *_attitude(tables), *_positions(tables), *_air(tables), *_state(tables)]
    if unix_offset_us is not None:
        times = each_second(tables.values())
        found.append(mavlink_part("SYSTEM_TIME", times, time_unix_usec=times + unix_offset_us))
    return [part for part in found if len(part.time_us)]


def _imu(tables: Mapping[str, Records]) -> list[Part]:
    found = []
    for number, name in enumerate(("IMU", "IMU1", "IMU2")):
        imu = tables.get(name)
        if imu is None or not imu.has("AccX", "AccY", "AccZ", "GyroX", "GyroY", "GyroZ"):
            continue
        # The writer repeats the newest samples whenever any other sensor changes.
        values = np.column_stack(
            [imu.columns[k] for k in ("AccX", "AccY", "AccZ", "GyroX", "GyroY", "GyroZ")]
        )
        fresh = imu.where(np.concatenate(([True], np.any(np.diff(values, axis=0) != 0.0, axis=1))))
        found.append((number, fresh))
    if not found:
        return []

    def joined(column: str) -> Array:
        return np.concatenate([imu.columns[column] for _, imu in found])

    return [
        mavlink_part(
            "HIGHRES_IMU",
            np.concatenate([imu.time_us for _, imu in found]),
            **{f"{axis}acc": joined(f"Acc{axis.upper()}") for axis in "xyz"},
            **{f"{axis}gyro": joined(f"Gyro{axis.upper()}") for axis in "xyz"},
            fields_updated=_ACCELEROMETER_AND_GYRO,
            id=np.repeat([number for number, _ in found], [len(imu.time_us) for _, imu in found]),
        )
    ]


def _attitude(tables: Mapping[str, Records]) -> list[Part]:
    attitude = tables.get("ATT")
    if attitude is None or not attitude.has("Roll", "Pitch", "Yaw"):
        return []
    c = attitude.columns
    zero = np.zeros(len(attitude.time_us))
    return [
        mavlink_part(
            "ATTITUDE",
            attitude.time_us,
            roll=c["Roll"],
            pitch=c["Pitch"],
            yaw=c["Yaw"],
            rollspeed=c.get("RollRate", zero),
            pitchspeed=c.get("PitchRate", zero),
            yawspeed=c.get("YawRate", zero),
        )
    ]


def _positions(tables: Mapping[str, Records]) -> list[Part]:
    found = []
    local = tables.get("LPOS")
    if local is not None and local.has("X", "Y", "Z", "VX", "VY", "VZ"):
        axes = ("X", "Y", "Z", "VX", "VY", "VZ")
        found.append(
            mavlink_part(
                "LOCAL_POSITION_NED", local.time_us, **{axis.lower(): local.columns[axis] for axis in axes}
            )
        )
    place = tables.get("GPOS")
    if place is not None and place.has("Lat", "Lon", "Alt", "VelN", "VelE", "VelD"):
        c = place.columns
        found.append(
            mavlink_part(
                "GLOBAL_POSITION_INT",
                place.time_us,
                lat=to_e7(c["Lat"]),
                lon=to_e7(c["Lon"]),
                alt=c["Alt"] * 1e3,
                relative_alt=-1e3 * value_at(local, "Z", place.time_us),
                vx=100.0 * c["VelN"],
                vy=100.0 * c["VelE"],
                vz=100.0 * c["VelD"],
                hdg=100.0 * np.mod(np.degrees(value_at(tables.get("ATT"), "Yaw", place.time_us)), 360.0),
            )
        )
    gps = tables.get("GPS")
    if gps is not None and gps.has("Fix", "Lat", "Lon", "Alt", "VelN", "VelE"):
        c = gps.columns
        found.append(
            mavlink_part(
                "GPS_RAW_INT",
                gps.time_us,
                fix_type=c["Fix"],
                lat=to_e7(c["Lat"]),
                lon=to_e7(c["Lon"]),
                alt=c["Alt"] * 1e3,
                eph=65535,
                epv=65535,
                vel=100.0 * np.hypot(c["VelN"], c["VelE"]),
                cog=65535,
                satellites_visible=c.get("nSat", 255),
            )
        )
    return found


def _air(tables: Mapping[str, Records]) -> list[Part]:
    found = []
    local, airspeed, sensors = tables.get("LPOS"), tables.get("AIRS"), tables.get("SENS")
    thrust = tables.get("ATTC")
    source = airspeed if airspeed is not None and airspeed.has("IAS") else thrust
    if source is not None:
        times = source.time_us
        speed = np.hypot(value_at(local, "VX", times), value_at(local, "VY", times))
        found.append(
            mavlink_part(
                "VFR_HUD",
                times,
                airspeed=airspeed.columns["IAS"] if airspeed is source else speed,
                groundspeed=speed,
                heading=np.mod(np.degrees(value_at(tables.get("ATT"), "Yaw", times)), 360.0),
                throttle=100.0 * np.clip(value_at(thrust, "Thrust", times), 0.0, 1.0),
                alt=value_at(tables.get("GPOS"), "Alt", times),
                climb=-value_at(local, "VZ", times),
            )
        )
    if sensors is not None and sensors.has("BaroPres"):
        found.append(
            mavlink_part(
                "SCALED_PRESSURE",
                sensors.time_us,
                press_abs=sensors.columns["BaroPres"],
                temperature=100.0 * sensors.columns.get("BaroTemp", np.zeros(len(sensors.time_us))),
            )
        )
    return found


def _state(tables: Mapping[str, Records]) -> list[Part]:
    found = []
    status = tables.get("STAT")
    if status is not None and status.has("MainState"):
        c = status.columns
        modes = np.array([_custom_mode(int(state)) for state in c["MainState"]], dtype=np.int64)
        states = c.get("ArmS", c.get("ArmState", np.zeros(len(modes))))
        armed = (states == _ARMED) | (states == _IN_ERROR)
        rotors = c.get("IsRotWing", np.zeros(len(modes))) != 0
        times = np.union1d(each_second(tables.values()), status.time_us)
        is_armed = newest(status.time_us, armed, times).astype(bool)
        kind = np.where(rotors, dialect.MAV_TYPE_QUADROTOR, dialect.MAV_TYPE_FIXED_WING)
        found.append(
            mavlink_part(
                "HEARTBEAT",
                times,
                type=newest(status.time_us, kind, times, dialect.MAV_TYPE_GENERIC),
                autopilot=dialect.MAV_AUTOPILOT_PX4,
                base_mode=dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
                + np.where(is_armed, dialect.MAV_MODE_FLAG_SAFETY_ARMED, 0),
                custom_mode=newest(status.time_us, modes, times),
                system_status=np.where(is_armed, dialect.MAV_STATE_ACTIVE, dialect.MAV_STATE_STANDBY),
                mavlink_version=3,
            )
        )
    landed = tables.get("LAND")
    if landed is not None and landed.has("Landed"):
        times = each_second(tables.values())
        times = np.union1d(times[times >= int(landed.time_us.min())], landed.time_us)
        on_ground = value_at(landed, "Landed", times) != 0
        state = np.where(on_ground, dialect.MAV_LANDED_STATE_ON_GROUND, dialect.MAV_LANDED_STATE_IN_AIR)
        found.append(mavlink_part("EXTENDED_SYS_STATE", times, landed_state=state))
    return found


def _custom_mode(main_state: int) -> int:
    main, sub = _CUSTOM_MODES.get(main_state, (0, 0))
    return main << 16 | sub << 24
