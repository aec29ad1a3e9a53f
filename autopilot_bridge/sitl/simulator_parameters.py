"""SIM_* parameters: how users' scripts inject failures into an ArduPilot SITL, and some of PX4's.

A parameter acts when it changes, and acts on the simulated world only. Sources: parameter descriptions
of ArduPilot 4.6's SITL and of PX4 1.16's simulated sensors.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, Final

from autopilot_bridge.firmware.mapping import clamp, number
from autopilot_bridge.parameters import ParameterStore
from flightsim import truth as t
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.sensors import SensorSuite
from flightsim.sensors.fault_kinds import FaultType, SensorUnit
from flightsim.sensors.faults import UnsupportedFaultError
from flightsim.vehicle import Vehicle
from flightsim.wind_profile import WindLaw, WindProfile

Fault = tuple[FaultType, dict[str, Any]]

_SOUND: Final[Fault] = (FaultType.OK, {})
_PASCALS_PER_METRE: Final = -12.0
_FIX_SATELLITES: Final = 4
_FULL_VOLTAGE: Final = 12.6  # SIM_BATT_VOLTAGE of ArduPilot's own battery
_MAX_WIND_M_S: Final = 60.0
_WIND_OVER_HEIGHT: Final = ("SIM_WIND_T", "SIM_WIND_T_ALT", "SIM_WIND_T_COEF")
_SQUARE_ROOT: Final = 0.0  # of SIM_WIND_T
_LINEAR: Final = 2.0
_W20_PER_TURBULENCE: Final = 5.0  # MIL-F-8785C near the ground: longitudinal turbulence of about W20/5


class SimulatorParameters:
    """Applies SIM_* parameters to one vehicle.

    Args:
        vehicle, sensors: the objects that they act on.
        fail_radio: interrupts (True) or restores (False) the pilot's radio.
        weaken_motors: (bit mask, effectiveness): reduces the effectiveness of these motors.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        sensors: SensorSuite,
        fail_radio: Callable[[bool], None],
        weaken_motors: Callable[[int, float], None],
    ) -> None:
        self._vehicle = vehicle
        self._sensors = sensors
        self._fail_radio = fail_radio
        self._weaken_motors = weaken_motors
        self._applied: dict[str, Any] = {}

    def apply(self, store: ParameterStore) -> None:
        """At boot: what differs from its default acts at once, and what acted before and no longer differs
        ends.
        """
        for name, group in _GROUP_OF.items():
            definition = store.find(name)
            if definition is None:
                continue
            differs = store.get(name) != definition.convert(definition.default)
            if differs or group.__name__ in self._applied:
                self.changed(store, name)

    def vehicle_restarted(self) -> None:
        """The simulated vehicle has started again: its air and its motors are as at the start."""
        for group in _OF_VEHICLE:
            self._applied.pop(group, None)

    def changed(self, store: ParameterStore, name: str) -> None:
        """A parameter has a new value."""
        group = _GROUP_OF.get(name)
        if group is None:
            return
        wanted = group(self, store)
        if self._applied.get(group.__name__) != wanted:
            self._applied[group.__name__] = wanted
            self._put(group.__name__, wanted)

    def _put(self, group: str, wanted: Any) -> None:
        unit = _UNITS.get(group)
        if unit is not None:
            failure, options = wanted
            try:
                self._sensors.faults.inject(unit, failure, **options)
            except UnsupportedFaultError:
                return  # no such sensor on this vehicle
        elif group == "_wind":
            self._blow(*wanted)
        elif group == "_radio":
            self._fail_radio(wanted)
        else:
            self._weaken_motors(*wanted)

    def _blow(
        self, speed_m_s: float, from_deg: float, rising_deg: float, turbulence_m_s: float, *over_height: float
    ) -> None:
        to_rad, up_rad = math.radians(from_deg) + math.pi, math.radians(rising_deg)
        level_m_s = speed_m_s * math.cos(up_rad)
        self._vehicle.set_wind(
            (level_m_s * math.cos(to_rad), level_m_s * math.sin(to_rad), -speed_m_s * math.sin(up_rad)),
            profile=_profile(speed_m_s, *over_height),
            wind_at_20_ft_m_s=_W20_PER_TURBULENCE * turbulence_m_s,
        )

    # the fault that a group of parameters defines

    def _gps(self, store: ParameterStore) -> Fault:
        if number(store, "SIM_GPS_DISABLE", 0.0):
            return FaultType.OFF, {}
        satellites = number(store, "SIM_GPS_NUMSATS", number(store, "SIM_GPS_USED", 10.0))
        if satellites < _FIX_SATELLITES or number(store, "SIM_GPS_JAM", 0.0):
            return FaultType.WRONG, {"no_fix": True}
        bias = [
            *self._glitch(*(number(store, f"SIM_GPS_GLITCH_{axis}", 0.0) for axis in "XYZ")),
            *(number(store, f"SIM_GPS_VERR_{axis}", 0.0) for axis in "XYZ"),
        ]
        return (FaultType.WRONG, {"bias": bias}) if any(bias) else _SOUND

    def _glitch(self, lat_deg: float, lon_deg: float, up_m: float) -> tuple[float, float, float]:
        """Offsets in degrees of latitude and longitude as metres north and east, where the vehicle is."""
        truth = self._vehicle.truth
        lat_rad, lon_rad, alt_m = (float(truth[place]) for place in (t.LAT_RAD, t.LON_RAD, t.ALT_M))
        here = GeodeticPosition(lat_deg=math.degrees(lat_rad), lon_deg=math.degrees(lon_rad), alt_m=alt_m)
        lat_deg = clamp(here.lat_deg + lat_deg, -90.0, 90.0)
        north, east, _ = LocalFrame(here).ned_from_geodetic(lat_deg, here.lon_deg + lon_deg, alt_m)
        return north, east, up_m

    def _barometer(self, store: ParameterStore) -> Fault:
        if number(store, "SIM_BARO_DISABLE", 0.0):
            return FaultType.OFF, {}
        if number(store, "SIM_BARO_FREEZE", 0.0):
            return FaultType.STUCK, {}
        drift_m_s = number(store, "SIM_BARO_DRIFT", 0.0)
        if drift_m_s:
            return FaultType.DRIFT, {"drift_per_s": [_PASCALS_PER_METRE * drift_m_s]}
        pressure_pa = number(store, "SIM_BARO_OFF_P", 0.0)
        pressure_pa += _PASCALS_PER_METRE * number(store, "SIM_BARO_GLITCH", 0.0)
        bias = [pressure_pa, number(store, "SIM_BARO_OFF_T", 0.0)]
        return (FaultType.WRONG, {"bias": bias}) if any(bias) else _SOUND

    def _magnetometer(self, store: ParameterStore) -> Fault:
        if number(store, "SIM_MAG1_FAIL", 0.0):
            return FaultType.OFF, {}
        return _biased(store, "SIM_MAG_OFFSET_")

    def _gyro(self, store: ParameterStore) -> Fault:
        if int(number(store, "SIM_GYR_FAIL_MSK", 0.0)) & 1:
            return FaultType.STUCK, {}
        return _biased(store, "SIM_GYR1_BIAS_")

    def _accelerometer(self, store: ParameterStore) -> Fault:
        if int(number(store, "SIM_ACC_FAIL_MSK", 0.0)) & 1:
            return FaultType.STUCK, {}
        return _biased(store, "SIM_ACC1_BIAS_")

    def _airspeed(self, store: ParameterStore) -> Fault:
        failed = number(store, "SIM_ARSPD_FAIL", 0.0)
        return (FaultType.WRONG, {"blocked": True}) if failed else _SOUND

    def _battery(self, store: ParameterStore) -> Fault:
        drop_v = number(store, "SIM_BATT_VOLTAGE", _FULL_VOLTAGE) - _FULL_VOLTAGE
        return (FaultType.WRONG, {"bias": [drop_v]}) if abs(drop_v) > 1e-3 else _SOUND

    def _motors(self, store: ParameterStore) -> tuple[int, float]:
        mask = int(clamp(number(store, "SIM_ENGINE_FAIL", 0.0), 0.0, 0xFFFF))
        return mask, clamp(number(store, "SIM_ENGINE_MUL", 1.0), 0.0, 1.0)

    def _radio(self, store: ParameterStore) -> bool:
        return number(store, "SIM_RC_FAIL", 0.0) != 0.0

    def _wind(self, store: ParameterStore) -> tuple[float, ...]:
        return (
            clamp(number(store, "SIM_WIND_SPD", 0.0), 0.0, _MAX_WIND_M_S),
            number(store, "SIM_WIND_DIR", 180.0),
            clamp(number(store, "SIM_WIND_DIR_Z", 0.0), -90.0, 90.0),
            clamp(number(store, "SIM_WIND_TURB", 0.0), 0.0, 10.0),
            number(store, "SIM_WIND_T", 0.0),
            clamp(number(store, "SIM_WIND_T_ALT", 60.0), 1.0, 1000.0),
            clamp(number(store, "SIM_WIND_T_COEF", 0.01), -1.0, 1.0),
        )


def _profile(speed_m_s: float, law: float, height_m: float, gradient_1_s: float) -> WindProfile:
    """Wind over height by SIM_WIND_T of ArduPilot 4.6.3.

    0: it grows with the square root of height up to SIM_WIND_T_ALT; 2: linearly; otherwise it is constant.
    """
    if law == _SQUARE_ROOT:
        return WindProfile(law=WindLaw.POWER, exponent=0.5, reference_height_m=height_m, top_m=height_m)
    if law == _LINEAR and speed_m_s > 0.0:
        gradient_1_m = clamp(gradient_1_s / speed_m_s, -10.0, 10.0)
        return WindProfile(law=WindLaw.LINEAR, gradient_1_m=gradient_1_m, reference_height_m=height_m)
    return WindProfile()


def _biased(store: ParameterStore, prefix: str) -> Fault:
    bias = [number(store, prefix + axis, 0.0) for axis in "XYZ"]
    return (FaultType.WRONG, {"bias": bias}) if any(bias) else _SOUND


Group = Callable[[SimulatorParameters, ParameterStore], Any]

_P: Final = SimulatorParameters
_GROUPS: Final[Mapping[Group, tuple[str, ...]]] = {
    _P._gps: (
        "SIM_GPS_DISABLE",
        "SIM_GPS_NUMSATS",
        "SIM_GPS_USED",
        "SIM_GPS_JAM",
        *(f"SIM_GPS_GLITCH_{axis}" for axis in "XYZ"),
        *(f"SIM_GPS_VERR_{axis}" for axis in "XYZ"),
    ),
    _P._barometer: (
        "SIM_BARO_DISABLE",
        "SIM_BARO_FREEZE",
        "SIM_BARO_DRIFT",
        "SIM_BARO_GLITCH",
        "SIM_BARO_OFF_P",
        "SIM_BARO_OFF_T",
    ),
    _P._magnetometer: ("SIM_MAG1_FAIL", *(f"SIM_MAG_OFFSET_{axis}" for axis in "XYZ")),
    _P._gyro: ("SIM_GYR_FAIL_MSK", *(f"SIM_GYR1_BIAS_{axis}" for axis in "XYZ")),
    _P._accelerometer: ("SIM_ACC_FAIL_MSK", *(f"SIM_ACC1_BIAS_{axis}" for axis in "XYZ")),
    _P._airspeed: ("SIM_ARSPD_FAIL",),
    _P._battery: ("SIM_BATT_VOLTAGE",),
    _P._motors: ("SIM_ENGINE_FAIL", "SIM_ENGINE_MUL"),
    _P._radio: ("SIM_RC_FAIL",),
    _P._wind: ("SIM_WIND_SPD", "SIM_WIND_DIR", "SIM_WIND_DIR_Z", "SIM_WIND_TURB", *_WIND_OVER_HEIGHT),
}
_GROUP_OF: Final = {name: group for group, names in _GROUPS.items() for name in names}
_OF_VEHICLE: Final = ("_wind", "_motors")
_UNITS: Final = {
    "_gps": SensorUnit.GPS,
    "_barometer": SensorUnit.BARO,
    "_magnetometer": SensorUnit.MAG,
    "_gyro": SensorUnit.GYRO,
    "_accelerometer": SensorUnit.ACCEL,
    "_airspeed": SensorUnit.AIRSPEED,
    "_battery": SensorUnit.BATTERY,
}
