"""ArduPilot's log messages converted to the MAVLink messages that estimators need.

Source: ArduPilot's log message documentation (ardupilot.org, "Onboard Message Log Messages", 4.x) and the
formats that logs of 2013 to 2026 describe: angles in degrees, pressures in pascal, IMU in SI.
`dataflash_state` handles modes and events.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import to_e7
from estimators.logs.ardupilot_firmware import Firmware
from estimators.logs.dataflash_state import firmware, state_parts, throttle
from estimators.logs.mapped import Array, Part, Records, each_second, mavlink_part, value_at
from flightsim.foundation.vectors import wrap_pi

_ACCELEROMETER_AND_GYRO: Final = 0b111111
_HOME: Final = 1  # ORGN.Type
_FILTERS: Final = ("XKF1", "NKF1", "EKF1")
"""Solutions of the navigation filters, the newest filter first."""


def map_messages(tables: Mapping[str, Records], unix_offset_us: int | None, banner: str = "") -> list[Part]:
    """Convert the log's tables to MAVLink messages.

    Args:
        tables: tables by name.
        unix_offset_us: Unix time of vehicle time 0; None: not known.
        banner: text about the firmware that is in a text log outside its messages.
    """
    made_by = firmware(tables, banner)
    found = [
        *_imu(tables),
        *_attitude(tables),
        *_air(tables, made_by),
        *_positions(tables),
        *_home(tables),
        *_gps(tables),
        *state_parts(tables, made_by, banner),
    ]
    if unix_offset_us is not None:
        times = each_second(tables.values())
        found.append(mavlink_part("SYSTEM_TIME", times, time_unix_usec=times + unix_offset_us))
    return [part for part in found if len(part.time_us)]


def _imu(tables: Mapping[str, Records]) -> list[Part]:
    """Instances of IMU; before 2019 each of them had its own table."""
    names = ("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ")
    found = []
    for number, name in enumerate(("IMU", "IMU2", "IMU3")):
        imu = tables.get(name)
        if imu is not None and imu.has(*names):
            instances = imu.columns.get("I", np.full(len(imu.time_us), number))
            found.append((imu, instances))
    if not found:
        return []

    def joined(column: str, default: float = 0.0) -> Array:
        return np.concatenate(
            [imu.columns.get(column, np.full(len(imu.time_us), default)) for imu, _ in found]
        )

    return [
        mavlink_part(
            "HIGHRES_IMU",
            np.concatenate([imu.time_us for imu, _ in found]),
            **{f"{axis}acc": joined(f"Acc{axis.upper()}") for axis in "xyz"},
            **{f"{axis}gyro": joined(f"Gyr{axis.upper()}") for axis in "xyz"},
            temperature=joined("T"),
            fields_updated=_ACCELEROMETER_AND_GYRO,
            id=np.concatenate([instances for _, instances in found]),
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
                yaw=wrap_pi(np.radians(attitude.columns["Yaw"])),
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
                yaw=wrap_pi(np.radians(truth.columns["Yaw"])),
                lat=to_e7(truth.columns["Lat"]),
                lng=to_e7(truth.columns["Lng"]),
            )
        )
    return found


def _air(tables: Mapping[str, Records], made_by: Firmware) -> list[Part]:
    found = []
    airspeed, baro = tables.get("ARSP"), tables.get("BARO")
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
    speed = _speed(tables, made_by)
    if speed is not None:
        times = speed.time_us
        found.append(
            mavlink_part(
                "VFR_HUD",
                times,
                airspeed=speed.columns["speed"],
                groundspeed=value_at(_first(tables.get("GPS")), "Spd", times),
                heading=np.mod(value_at(tables.get("ATT"), "Yaw", times), 360.0),
                throttle=np.clip(value_at(throttle(tables, made_by), "percent", times), 0.0, 100.0),
                alt=value_at(tables.get("POS"), "Alt", times),
                climb=_climb(tables, times),
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


def _speed(tables: Mapping[str, Records], made_by: Firmware) -> Records | None:
    """Airspeed as in VFR_HUD: measured, else estimated, else (except for fixed wings) ground speed."""
    airspeed = _first(tables.get("ARSP"))
    if airspeed is not None and airspeed.has("Airspeed") and len(airspeed.time_us):
        return Records(airspeed.time_us, {"speed": airspeed.columns["Airspeed"]})
    for name, column in (("CTUN", "As"), ("NTUN", "Arspd"), ("NTUN", "AspE")):
        table = tables.get(name)
        if made_by.vehicle == "plane" and table is not None and table.has(column):
            return Records(table.time_us, {"speed": table.columns[column]})
    tune = tables.get("CTUN")
    if made_by.vehicle == "plane" or tune is None:
        return None
    return Records(tune.time_us, {"speed": value_at(_first(tables.get("GPS")), "Spd", tune.time_us)})


def _climb(tables: Mapping[str, Records], times: Array) -> Array:
    """Rate of climb, m/s, from the navigation filter, else from the altitude controller (cm/s)."""
    ekf, tune = _filter(tables), tables.get("CTUN")
    if ekf is not None and ekf.has("VD"):
        return -value_at(ekf, "VD", times)
    name = next((n for n in ("CRt", "CRate") if tune is not None and n in tune.columns), "")
    return 0.01 * value_at(tune, name, times)


def _filter(tables: Mapping[str, Records]) -> Records | None:
    """The first core of the navigation filter in use."""
    table = next((tables[name] for name in _FILTERS if name in tables), None)
    return _first(table, "C")


def _height(tables: Mapping[str, Records], times: Array, alt_m: Array) -> Array:
    """Height above home, m, from the altitude controller, else relative to the first altitude."""
    tune = tables.get("CTUN")
    for name in ("BAlt", "BarAlt"):
        if tune is not None and name in tune.columns:
            return value_at(tune, name, times)
    return alt_m - (alt_m[0] if len(alt_m) else 0.0)


def _positions(tables: Mapping[str, Records]) -> list[Part]:
    found = []
    ekf, position = _filter(tables), tables.get("POS")
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
                lat=to_e7(c["Lat"]),
                lon=to_e7(c["Lng"]),
                alt=c["Alt"] * 1e3,
                relative_alt=c.get("RelHomeAlt", c.get("RelAlt", _height(tables, times, c["Alt"]))) * 1e3,
                vx=100.0 * value_at(ekf, "VN", times),
                vy=100.0 * value_at(ekf, "VE", times),
                vz=100.0 * value_at(ekf, "VD", times),
                hdg=100.0 * np.mod(value_at(tables.get("ATT"), "Yaw", times), 360.0),
            )
        )
    elif (gps := _fixes(tables)) is not None:  # before 2015 no other message contained the position
        c, times = gps.columns, gps.time_us
        height = c.get("RelAlt", c.get("RAlt"))
        found.append(
            mavlink_part(
                "GLOBAL_POSITION_INT",
                times,
                lat=to_e7(c["Lat"]),
                lon=to_e7(c["Lng"]),
                alt=c["Alt"] * 1e3,
                relative_alt=1e3 * (_height(tables, times, c["Alt"]) if height is None else height),
                vx=100.0 * c["Spd"] * np.cos(np.radians(c["GCrs"])),
                vy=100.0 * c["Spd"] * np.sin(np.radians(c["GCrs"])),
                vz=-100.0 * _climb(tables, times),
                hdg=100.0 * np.mod(value_at(tables.get("ATT"), "Yaw", times), 360.0),
            )
        )
    return found


def _fixes(tables: Mapping[str, Records]) -> Records | None:
    """GPS messages that contain a position."""
    gps = _first(tables.get("GPS"))
    if gps is None or not gps.has("Status", "Lat", "Lng", "Alt", "Spd", "GCrs"):
        return None
    fixes = gps.where((gps.columns["Status"] >= dialect.GPS_FIX_TYPE_3D_FIX) & (gps.columns["Lat"] != 0.0))
    return fixes if len(fixes.time_us) else None


def _home(tables: Mapping[str, Records]) -> list[Part]:
    """HOME_POSITION; its coordinates in the local frame are not set."""
    places = tables.get("ORGN")
    if places is None or not places.has("Type", "Lat", "Lng", "Alt"):
        return []
    home = places.where(places.columns["Type"] == _HOME)
    return [
        mavlink_part(
            "HOME_POSITION",
            home.time_us,
            latitude=to_e7(home.columns["Lat"]),
            longitude=to_e7(home.columns["Lng"]),
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
        own = tables.get("GPS2") if number and "I" not in gps.columns else gps
        if own is None or not own.has("Status", "Lat", "Lng", "Alt", "Spd", "GCrs"):
            continue
        one = own.instance("I", number)
        c = one.columns
        found.append(
            mavlink_part(
                name,
                one.time_us,
                fix_type=c["Status"],
                lat=to_e7(c["Lat"]),
                lon=to_e7(c["Lng"]),
                alt=c["Alt"] * 1e3,
                eph=c["HDop"] * 100.0 if "HDop" in c else 65535,
                epv=65535,
                vel=c["Spd"] * 100.0,
                cog=np.mod(c["GCrs"], 360.0) * 100.0,
                satellites_visible=c.get("NSats", 255),
            )
        )
    return found


def _first(table: Records | None, field: str = "I") -> Records | None:
    return None if table is None else table.instance(field, 0)
