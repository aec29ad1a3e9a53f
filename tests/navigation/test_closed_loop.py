"""The filter in the loop: JSBSim vehicle, default sensors, filter, control laws; wind and turbulence."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from autopilot_bridge.control.multicopter import MulticopterController
from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.navigation import NavigationFilter, NavigationParameters, layout
from estimators.tracking import metrics
from flightsim import truth as t
from flightsim.environment import Environment, Turbulence
from flightsim.sensors.suite import SensorSuite, SensorSuiteParameters
from flightsim.world import World, WorldParameters
from tests.navigation.bench import attitude_error
from tests.navigation.matched import MATCHED
from tests.slow import slow

SEEDS = 8
DURATION_S = 60.0
RATE_HZ = 250


def fly(seed: int, environment: Environment) -> tuple[np.ndarray, np.ndarray]:
    """NEES (n, 3) and errors (n, 9), once a second of a Lissajous curve flown on the filter's state."""
    world = World(WorldParameters(seed=seed, environment=environment))
    vehicle = world.add_vehicle()
    truth = vehicle.truth
    suite = SensorSuite(
        SensorSuiteParameters(),
        physics_rate_hz=RATE_HZ,
        truth=truth,
        seeds=lambda name: world.streams.child("vehicle", 0, "sensor", name),
    )
    nav = NavigationFilter(NavigationParameters(**MATCHED), readings=suite.readings, physics_rate_hz=RATE_HZ)
    controller = MulticopterController(physics_rate_hz=RATE_HZ, nav=nav.state)
    setpoint = controller.setpoint
    nees, errors = [], []
    for step in range(round(DURATION_S * RATE_HZ)):
        time_s = step / RATE_HZ
        if time_s > 5.0:
            go = min(1.0, max(0.0, (time_s - 10.0) / 5.0)) ** 2
            phase = 2.0 * math.pi / 40.0 * (time_s - 12.0)
            setpoint[sp.LEVEL] = sp.TRAJECTORY
            setpoint[sp.POS_NED_M] = (
                20.0 * go * math.sin(2.0 * phase),
                20.0 * go * math.sin(phase),
                -10.0 * min(1.0, (time_s - 5.0) / 5.0),
            )
            setpoint[sp.YAW_RAD] = 0.8 * math.sin(0.3 * time_s)
        controller.step()
        vehicle.step(controller.actuators)
        world.advance()
        suite.step(world.time_us)
        nav.vehicle_at_rest = time_s < 5.0
        nav.step(world.time_us)
        if time_s > 15.0 and step % RATE_HZ == 0:
            error = np.zeros(9)
            error[0:3] = attitude_error(truth[t.Q_NED_FROM_FRD], nav.state[layout.Q_NED_FROM_FRD])
            error[3:6] = truth[t.VEL_NED_M_S] - nav.state[layout.VEL_NED_M_S]
            assert nav.frame is not None
            position = nav.frame.ned_from_geodetic(
                math.degrees(truth[t.LAT_RAD]), math.degrees(truth[t.LON_RAD]), float(truth[t.ALT_M])
            )
            error[6:9] = position - nav.state[layout.POS_NED_M]
            p = nav.covariance
            nees.append([metrics.nees(error[i : i + 3], p[i : i + 3, i : i + 3]) for i in (0, 3, 6)])
            errors.append(error)
    health = nav.health
    assert health.position_resets == 1 and health.filter_resets == 0
    assert health.position_horizontal_absolute and not health.accel_error
    return np.array(nees), np.array(errors)


@pytest.mark.parametrize(
    "environment",
    [slow(Environment()), Environment(wind_ned_m_s=(5.0, 0.0, 0.0), turbulence=Turbulence.MODERATE)],
    ids=["still", "turbulent"],
)
@pytest.mark.slow
def test_consistent_and_accurate_in_flight(environment: Environment) -> None:
    runs = [fly(seed, environment) for seed in range(SEEDS)]
    nees, errors = np.array([run[0] for run in runs]), np.array([run[1] for run in runs])
    low, high = chi2.ppf([0.025, 0.975], 3 * SEEDS) / SEEDS
    for index, name in enumerate(("attitude", "velocity", "position")):
        assert low < nees[:, :, index].mean() < high, name
    rms = np.sqrt((errors**2).mean(axis=(0, 1)))
    assert np.hypot.reduce(rms[6:9]) < 0.6
    assert math.degrees(np.hypot.reduce(rms[0:3])) < 0.6
    assert np.hypot.reduce(rms[3:6]) < 0.1
