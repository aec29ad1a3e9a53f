"""Flights that show whether the navigation filter's covariance describes its errors, over the whole stack."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.navigation import layout
from autopilot_bridge.sitl.vehicle import usual_sensors
from flightsim import truth as t
from flightsim.environment import Environment
from flightsim.sensors import SensorSuiteParameters
from flightsim.world_spec import VehicleSpec
from tests.flights.flight import Flight
from tests.navigation.bench import attitude_error

Array = NDArray[np.float64]

CURVE_S: Final = 50.0
PARTS: Final = {"attitude": slice(0, 3), "velocity": slice(3, 6), "position": slice(6, 9)}
TUNED: Final[Mapping[str, Mapping[str, float]]] = {
    "px4": {
        "EKF2_GYR_NOISE": 2.5e-3,
        "EKF2_GYR_B_NOISE": 1.2e-4,
        "EKF2_GBIAS_INIT": 0.063,  # relative to 0.1: 1.1e-3 rad/s
        "EKF2_ACC_NOISE": 0.018,
        "EKF2_ACC_B_NOISE": 1.8e-3,
        "EKF2_ABIAS_INIT": 0.025,
        "EKF2_GPS_P_NOISE": 0.25,
        "EKF2_GPS_V_NOISE": 0.085,
        "EKF2_BARO_NOISE": 0.11,
        "EKF2_MAG_NOISE": 0.003,
    },
    "ardupilot": {
        "EK3_GYRO_P_NSE": 2.3e-3,
        "EK3_GBIAS_P_NSE": 1.1e-4,
        "EK3_ACC_P_NSE": 0.0165,
        "EK3_ABIAS_P_NSE": 1.6e-3,
        "EK3_POSNE_M_NSE": 0.25,
        "EK3_VELNE_M_NSE": 0.07,
        "EK3_VELD_M_NSE": 0.158,
        "EK3_ALT_M_NSE": 0.11,
        "EK3_MAG_M_NSE": 0.01,
    },
}
"""What a user sets who has the data sheets of the simulated sensors, and no vibration."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """How a flight's sensors and its filter's parameters fit.

    Attributes:
        gps: receiver.
        tuned: the filter has the parameters `TUNED` instead of its firmware's defaults.
        spoiled: gyro noise x2, accelerometer noise x10, all errors of the receiver x2; the receiver reports
            its accuracy as before.
    """

    gps: str = "differential"
    tuned: bool = False
    spoiled: bool = False

    def sensors(self, flavour: str) -> SensorSuiteParameters:
        """The sensors of a quadrotor."""
        usual = usual_sensors(VehicleSpec(autopilot=flavour, gps=self.gps), aircraft=False)
        if not self.spoiled:
            return usual
        assert usual.imu is not None and usual.gps is not None
        imu = replace(
            usual.imu,
            gyro_noise_density_rad_s_sqrt_hz=2.0 * usual.imu.gyro_noise_density_rad_s_sqrt_hz,
            accel_noise_density_m_s2_sqrt_hz=10.0 * usual.imu.accel_noise_density_m_s2_sqrt_hz,
        )
        errors = {name: 2.0 * getattr(usual.gps, name) for name in _ERRORS}
        gps = replace(usual.gps, **errors, reported_accuracy_scale=0.5)
        return replace(usual, imu=imu, gps=gps)


_ERRORS: Final = (
    "horizontal_noise_m",
    "vertical_noise_m",
    "horizontal_wander_m",
    "vertical_wander_m",
    "velocity_noise_north_m_s",
    "velocity_noise_east_m_s",
    "velocity_noise_down_m_s",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Consistency:
    """What one flight shows, once a second from take-off on.

    Attributes:
        nees: (n, 3), of attitude, velocity and position, three degrees of freedom each.
        errors: (n, 9), truth less estimate: attitude in rad, velocity, position, NED.
        off_curve_m: (m,) distance of the true position from the curve, once it is flown in full.
    """

    nees: Array
    errors: Array
    off_curve_m: Array = field(default_factory=lambda: np.zeros(0))


def fly_consistency(
    seed: int, *, flavour: str = "px4", case: Case | None = None, curve_s: float = CURVE_S
) -> Consistency:
    """Take-off and a three-dimensional curve by position setpoints; every other seed in wind."""
    case = Case() if case is None else case
    air = Environment()
    if seed % 2:
        air = Environment.from_wind(speed_m_s=5.0, from_deg=37.0 * seed % 360.0, turbulence="moderate")
    flight = Flight(
        flavour,
        seed=seed,
        environment=air,
        sensors=case.sensors(flavour),
        parameters=TUNED[flavour] if case.tuned else {},
    )
    filter_, truth = flight.vehicle.autopilot.navigation, flight.truth
    nees: list[list[float]] = []
    errors: list[Array] = []
    off_curve: list[float] = []

    def true_place() -> Array:
        assert filter_.frame is not None
        lat, lon = math.degrees(truth[t.LAT_RAD]), math.degrees(truth[t.LON_RAD])
        return np.array(filter_.frame.ned_from_geodetic(lat, lon, float(truth[t.ALT_M])))

    def look() -> None:
        if round(10.0 * flight.time_s) % 10:
            return
        state, covariance = filter_.state, filter_.covariance
        error = np.concatenate(
            (
                attitude_error(truth[t.Q_NED_FROM_FRD], state[layout.Q_NED_FROM_FRD]),
                truth[t.VEL_NED_M_S] - state[layout.VEL_NED_M_S],
                true_place() - state[layout.POS_NED_M],
            )
        )
        errors.append(error)
        nees.append([error[k] @ np.linalg.solve(covariance[k, k], error[k]) for k in PARTS.values()])
        if flight.time_s > start_s + 10.0:
            times_s = np.arange(flight.time_s - 3.0, flight.time_s, 0.02)
            off_curve.append(float(np.min([np.linalg.norm(true_place() - place(s)) for s in times_s])))

    start_s = math.inf
    flight.get_ready()
    flight.arm()
    if flavour == "px4":
        altitude = flight.newest["HOME_POSITION"].altitude * 1e-3 + 10.0
    else:
        flight.set_mode("guided")
        altitude = 10.0
    flight.command(dialect.MAV_CMD_NAV_TAKEOFF, -1, 0, 0, math.nan, math.nan, math.nan, altitude)
    flight.fly(12.0, look)
    start_s = flight.time_s
    here: Any = flight.newest["LOCAL_POSITION_NED"]

    def place(time_s: float) -> Array:
        s = time_s - start_s
        width_m, a = 25.0 * min(1.0, s / 8.0), 0.25 * s
        return np.array(
            [
                here.x + width_m * math.sin(a),
                here.y + 0.5 * width_m * math.sin(2.0 * a),
                here.z - 4.0 * math.sin(0.5 * a),
            ]
        )

    def curve(time_s: float) -> object:
        north, east, down = place(time_s).tolist()
        yaw = math.remainder(0.4 * (time_s - start_s), math.tau)
        return flight.position_setpoint((north, east, down), yaw_rad=yaw)

    flight.repeat(20.0, curve)
    flight.fly(1.0, look)
    if flavour == "px4":
        flight.set_mode("offboard")
    flight.fly(curve_s, look)
    health = filter_.health
    assert health.filter_resets == 0 and health.position_horizontal_absolute
    return Consistency(nees=np.array(nees), errors=np.array(errors), off_curve_m=np.array(off_curve))
