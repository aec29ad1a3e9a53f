"""The navigation filter's covariance describes its errors, over the whole stack and many seeds."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.navigation import layout
from flightsim import truth as t
from flightsim.environment import Environment
from tests.flights.flight import Flight
from tests.navigation.bench import attitude_error
from tests.slow import slow_after

SEEDS = (6, 20)  # by default, and for the slow tests
CURVE_S = 50.0
PARTS = {"attitude": slice(0, 3), "velocity": slice(3, 6), "position": slice(6, 9)}


def errors_in_flight(seed: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """NEES (n, 3) and errors (n, 9), once a second from takeoff on; every other seed in wind."""
    air = Environment()
    if seed % 2:
        air = Environment.from_wind(speed_m_s=5.0, from_deg=37.0 * seed % 360.0, turbulence="moderate")
    flight = Flight(seed=seed, environment=air)
    filter_, truth = flight.vehicle.autopilot.navigation, flight.truth
    nees: list[list[float]] = []
    errors: list[NDArray[np.float64]] = []

    def look() -> None:
        if round(10.0 * flight.time_s) % 10:
            return
        state, covariance, frame = filter_.state, filter_.covariance, filter_.frame
        assert frame is not None
        place = frame.ned_from_geodetic(
            math.degrees(truth[t.LAT_RAD]), math.degrees(truth[t.LON_RAD]), float(truth[t.ALT_M])
        )
        error = np.concatenate(
            (
                attitude_error(truth[t.Q_NED_FROM_FRD], state[layout.Q_NED_FROM_FRD]),
                truth[t.VEL_NED_M_S] - state[layout.VEL_NED_M_S],
                place - state[layout.POS_NED_M],
            )
        )
        errors.append(error)
        nees.append([error[k] @ np.linalg.solve(covariance[k, k], error[k]) for k in PARTS.values()])

    flight.get_ready()
    flight.arm()
    altitude = flight.newest["HOME_POSITION"].altitude * 1e-3 + 10.0
    flight.command(dialect.MAV_CMD_NAV_TAKEOFF, -1, 0, 0, math.nan, math.nan, math.nan, altitude)
    flight.fly(12.0, look)
    start_s = flight.time_s
    here = flight.newest["LOCAL_POSITION_NED"]

    def curve(time_s: float) -> object:
        s = time_s - start_s
        width_m, a = 25.0 * min(1.0, s / 8.0), 0.25 * s
        return flight.position_setpoint(
            (
                here.x + width_m * math.sin(a),
                here.y + 0.5 * width_m * math.sin(2.0 * a),
                here.z - 4.0 * math.sin(0.5 * a),
            ),
            yaw_rad=math.remainder(0.4 * s, math.tau),
        )

    flight.repeat(20.0, curve)
    flight.fly(1.0, look)
    flight.set_mode("offboard")
    flight.fly(CURVE_S, look)
    health = filter_.health
    assert health.filter_resets == 0 and health.position_horizontal_absolute
    return np.array(nees), np.array(errors)


@pytest.fixture(scope="module", params=slow_after(1, SEEDS))
def flights(request: pytest.FixtureRequest) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """NEES (seed, second, 3) and errors (seed, second, 9)."""
    runs = [errors_in_flight(seed) for seed in range(request.param)]
    count = min(len(nees) for nees, _ in runs)
    return np.array([nees[:count] for nees, _ in runs]), np.array([errors[:count] for _, errors in runs])


@pytest.mark.parametrize(("index", "part"), list(enumerate(PARTS)))
def test_nees_is_in_its_95_percent_band_on_average(
    flights: tuple[NDArray[np.float64], NDArray[np.float64]], index: int, part: str
) -> None:
    seeds = len(flights[0])
    low, high = chi2.ppf([0.025, 0.975], 3 * seeds) / seeds
    assert low < flights[0][:, :, index].mean() < high, part


def test_errors_with_default_sensors(flights: tuple[NDArray[np.float64], NDArray[np.float64]]) -> None:
    errors = flights[1]
    per_seed = np.sqrt((errors**2).mean(axis=1))
    position_m = np.linalg.norm(per_seed[:, PARTS["position"]], axis=1)
    attitude_deg = np.degrees(np.linalg.norm(per_seed[:, PARTS["attitude"]], axis=1))
    assert position_m.max() < 1.5 and attitude_deg.max() < 3.5
    assert np.sqrt((position_m**2).mean()) < 0.5  # required: 1.5 m
    assert np.sqrt((attitude_deg**2).mean()) < 1.0  # required: 1.5 deg
