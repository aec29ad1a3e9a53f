"""Standing, sliding, dropping and tipping over."""

import math

import numpy as np
import pytest

from flightsim import truth as t
from flightsim.airframe import load_airframe
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.initial_state import InitialState, initialise
from flightsim.interface import MAX_ACTUATORS
from flightsim.jsbsim_model import load_fdm
from flightsim.vehicle import Vehicle

OFF = np.zeros(MAX_ACTUATORS)
HOME = Home()


def make(initial: InitialState | None = None, wind: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Vehicle:
    return Vehicle(
        home=HOME,
        environment=Environment(wind_ned_m_s=wind),
        seed_sequence=np.random.SeedSequence(0),
        initial=initial,
    )


def moved_m(vehicle: Vehicle, start: np.ndarray) -> float:
    north = (vehicle.truth[0] - start[0]) * 6.37e6
    east = (vehicle.truth[1] - start[1]) * 6.37e6 * math.cos(start[0])
    return math.hypot(north, east)


def down_in_body(vehicle: Vehicle) -> np.ndarray:
    """Unit vector down in body axes."""
    w, x, y, z = vehicle.truth[t.Q_NED_FROM_FRD]
    return np.array([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)])


@pytest.mark.parametrize("wind_m_s", [0.0, 12.0])
def test_standing_neither_creeps_nor_jitters(wind_m_s: float) -> None:
    vehicle = make(wind=(wind_m_s, 0.0, 0.0))
    start = vehicle.truth.copy()
    heights, forces = [], []
    for _ in range(5000):
        vehicle.step(OFF)
        heights.append(vehicle.truth[t.HEIGHT_ABOVE_GROUND_M])
        forces.append(vehicle.truth[t.SPECIFIC_FORCE_FRD_M_S2].copy())
    assert moved_m(vehicle, start) < 1e-4
    assert np.ptp(heights) < 1e-4
    assert vehicle.truth[t.ON_GROUND] == 1.0
    assert np.std(forces, axis=0).max() < 1e-3
    assert np.linalg.norm(forces[-1]) == pytest.approx(9.8069, abs=1e-3)
    assert forces[-1][2] < -9.8
    assert heights[-1] == pytest.approx(vehicle.airframe.cg_height_at_rest_m, abs=2e-4)


def test_rest_rates_are_the_earths() -> None:
    """A perfect gyro facing north reads (w cos(lat), 0, -w sin(lat))."""
    vehicle = make()
    for _ in range(10):
        vehicle.step(OFF)
    lat = vehicle.truth[t.LAT_RAD]
    rate = 7.292115e-5
    np.testing.assert_allclose(
        vehicle.truth[t.RATES_FRD_RAD_S], [rate * math.cos(lat), 0.0, -rate * math.sin(lat)], atol=1e-6
    )


def test_sliding_is_braked_by_friction() -> None:
    """Dynamic friction 0.6: stops after v^2 / (2 mu g)."""
    speed = 2.0
    vehicle = make(InitialState(height_m=0.0985, vel_ned_m_s=(speed, 0.0, 0.0)))
    start = vehicle.truth.copy()
    for _ in range(250):
        vehicle.step(OFF)
    assert moved_m(vehicle, start) == pytest.approx(speed**2 / (2.0 * 0.6 * 9.807), rel=0.06)
    assert np.max(np.abs(vehicle.truth[t.VEL_NED_M_S])) < 1e-3
    assert down_in_body(vehicle)[2] > 0.999


def test_a_drop_comes_to_rest() -> None:
    vehicle = make(InitialState(height_m=0.6))
    assert vehicle.truth[t.ON_GROUND] == 0.0
    highest_after = 0.0
    for i in range(1000):
        vehicle.step(OFF)
        if i > 200:
            highest_after = max(highest_after, vehicle.truth[t.HEIGHT_ABOVE_GROUND_M])
    assert highest_after < 0.2  # hardly bounces
    assert vehicle.truth[t.HEIGHT_ABOVE_GROUND_M] == pytest.approx(0.0985, abs=3e-4)
    assert np.max(np.abs(vehicle.truth[t.VEL_NED_M_S])) < 1e-4


SIDE_DEG = 90.0 - math.degrees(math.atan2(0.0568, 0.15))  # from foot (0.12, -0.10) to motor (0.1768, 0.05)


@pytest.mark.parametrize(
    ("height_m", "roll_deg", "pitch_deg", "lies"),
    [
        (0.35, 30.0, 0.0, "feet"),
        (0.35, 0.0, -30.0, "feet"),
        (0.35, 170.0, 0.0, "back"),
        (0.15, SIDE_DEG, 0.0, "side"),
        (0.15, 0.0, SIDE_DEG, "side"),
    ],
)
def test_tipping_over(height_m: float, roll_deg: float, pitch_deg: float, lies: str) -> None:
    """Dropped askew it comes to rest on its feet, on its side (foot and motor), or on its motors."""
    vehicle = make(
        InitialState(height_m=height_m, roll_rad=math.radians(roll_deg), pitch_rad=math.radians(pitch_deg))
    )
    for _ in range(2000):
        vehicle.step(OFF)
    down = down_in_body(vehicle)
    assert vehicle.truth[t.ON_GROUND] == 1.0
    assert np.max(np.abs(vehicle.truth[t.VEL_NED_M_S])) < 0.01
    assert np.max(np.abs(vehicle.truth[t.RATES_FRD_RAD_S])) < 0.05
    if lies == "feet":
        assert down[2] > 0.999
    elif lies == "back":
        assert down[2] < -0.999
        assert vehicle.truth[t.HEIGHT_ABOVE_GROUND_M] == pytest.approx(0.05, abs=0.005)
    else:
        tilt = math.degrees(math.acos(down[2]))
        assert tilt == pytest.approx(SIDE_DEG, abs=2.0)


def test_takes_off_and_lands_on_ground_flag() -> None:
    vehicle = make()
    full = OFF.copy()
    full[:4] = 0.7
    for _ in range(250):
        vehicle.step(full)
    assert vehicle.truth[t.ON_GROUND] == 0.0
    assert vehicle.truth[t.HEIGHT_ABOVE_GROUND_M] > 0.5


def test_the_ground_is_felt_again_after_flight() -> None:
    """The model works out ground reactions below 1 m only; a fall from above it must end on the feet."""
    vehicle = make(InitialState(height_m=3.0))
    touched_m = math.nan
    for _ in range(1000):
        vehicle.step(OFF)
        if math.isnan(touched_m) and vehicle.truth[t.ON_GROUND] == 1.0:
            touched_m = float(vehicle.truth[t.HEIGHT_ABOVE_GROUND_M])
    assert 0.06 < touched_m <= 0.1  # at 7.4 m/s a step is 0.03 m
    assert vehicle.truth[t.HEIGHT_ABOVE_GROUND_M] == pytest.approx(0.0985, abs=3e-4)


def test_no_ground_reaction_outlives_a_new_start() -> None:
    """One JSBSim instance, standing and flying in turn: the ground pushes only when there is contact."""
    airframe = load_airframe("iris")
    fdm, _ = load_fdm(airframe, 250)
    weight_lbs = 1.5 * 9.807 * 0.2248089431
    for height_m in (None, 50.0, None, 1.5):
        initialise(fdm, airframe, HOME, Environment(), InitialState(height_m=height_m))
        for _ in range(100 if height_m is None else 5):
            fdm.run()
        if height_m is None:
            assert fdm.get_property_value("forces/fbz-gear-lbs") == pytest.approx(-weight_lbs, rel=1e-2)
        else:
            assert fdm.get_property_value("forces/fbz-gear-lbs") == 0.0
            assert fdm.get_property_value("accelerations/a-pilot-z-ft_sec2") == pytest.approx(0.0, abs=0.02)
