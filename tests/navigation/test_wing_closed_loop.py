"""The filter in the loop: JSBSim's Aerosonde from the catapult, default sensors, control on the filter's
state; wind and turbulence, GPS lost in an orbit."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing import FixedWingController, FixedWingParameters
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.navigation import NavigationFilter, NavigationParameters, layout
from autopilot_bridge.navigation import states as s
from estimators.tracking import metrics
from flightsim import truth as t
from flightsim.environment import Environment, Turbulence
from flightsim.sensors.airspeed import AirspeedParameters
from flightsim.sensors.fault_kinds import FaultType, SensorUnit
from flightsim.sensors.suite import SensorSuite, SensorSuiteParameters
from flightsim.vehicle import InitialState
from flightsim.world import World, WorldParameters
from tests.navigation.bench import attitude_error
from tests.navigation.matched import MATCHED

Array = NDArray[np.float64]

RATE_HZ = 250
LAUNCH_S = 8.0
LOST_S = 90.0
END_S = 270.0
SEEDS = 4
WIND_NED_M_S = (-3.2, 2.4, 0.0)


def setpoint(out: Array, time_s: float) -> None:
    """On the launcher, climb-out, level orbit with a bank of 22 degrees."""
    out[:] = math.nan
    out[sp.LEVEL] = sp.IDLE if time_s < LAUNCH_S + 0.3 else sp.FLY
    if time_s < LAUNCH_S + 12.0:
        out[sp.ROLL_RAD], out[sp.PITCH_RAD], out[sp.THROTTLE] = 0.0, 0.2, 1.0
    else:
        out[sp.ROLL_RAD] = math.radians(22.0)
        out[sp.DOWN_M], out[sp.AIRSPEED_M_S] = -100.0, 25.0


def fly(seed: int) -> tuple[Array, NavigationFilter]:
    """(n, 9) once a second from 20 s on: NEES over degrees of freedom of attitude, horizontal velocity,
    position, wind; tilt deg, velocity m/s, position m, wind m/s, position 1-sigma."""
    environment = Environment(wind_ned_m_s=WIND_NED_M_S, turbulence=Turbulence.LIGHT)
    world = World(WorldParameters(seed=seed, environment=environment))
    vehicle = world.add_vehicle("aerosonde", initial=InitialState(launch="catapult"))
    truth = vehicle.truth
    suite = SensorSuite(
        SensorSuiteParameters(airspeed=AirspeedParameters()),
        physics_rate_hz=RATE_HZ,
        truth=truth,
        seeds=lambda name: world.streams.child("vehicle", 0, "sensor", name),
    )
    nav = NavigationFilter(
        NavigationParameters(fixed_wing=True, **MATCHED), readings=suite.readings, physics_rate_hz=RATE_HZ
    )
    controller = FixedWingController(FixedWingParameters(), physics_rate_hz=RATE_HZ, nav=nav.state)
    rows = []
    for step in range(round(END_S * RATE_HZ)):
        time_s = step / RATE_HZ
        if step == round(LAUNCH_S * RATE_HZ):
            vehicle.launch()
        if step == round(LOST_S * RATE_HZ):
            suite.faults.inject(SensorUnit.GPS, FaultType.OFF)
        if step % 5 == 0:
            setpoint(controller.setpoint, time_s)
        controller.step()
        vehicle.step(controller.actuators)
        world.advance()
        suite.step(world.time_us)
        nav.vehicle_at_rest = time_s < LAUNCH_S + 0.2
        nav.step(world.time_us)
        if time_s > 20.0 and step % RATE_HZ == 0:
            rows.append(measure(nav, truth))
    return np.array(rows), nav


def measure(nav: NavigationFilter, truth: Array) -> list[float]:
    state, p = nav.state, nav.covariance
    assert nav.frame is not None
    place = nav.frame.ned_from_geodetic(
        math.degrees(truth[t.LAT_RAD]), math.degrees(truth[t.LON_RAD]), float(truth[t.ALT_M])
    )
    errors = {
        s.ATT: attitude_error(truth[t.Q_NED_FROM_FRD], state[layout.Q_NED_FROM_FRD]),
        s.VEL: (truth[t.VEL_NED_M_S] - state[layout.VEL_NED_M_S])[:2],
        s.POS: (np.array(place) - state[layout.POS_NED_M])[:2],
        s.WIND: np.array(WIND_NED_M_S[:2]) - state[layout.WIND_NED_M_S][:2],
    }
    nees = [float(metrics.nees(e, p[i : i + len(e), i : i + len(e)])) / len(e) for i, e in errors.items()]
    sizes = [float(np.hypot(*errors[i][:2])) for i in (s.VEL, s.POS, s.WIND)]
    tilt = math.degrees(np.hypot(*errors[s.ATT][:2]))
    return [*nees, tilt, *sizes, nav.health.position_horizontal_accuracy_m]


@pytest.fixture(scope="module")
def runs() -> Array:
    out = []
    for seed in range(SEEDS):
        rows, nav = fly(seed)
        health = nav.health
        assert health.filter_resets == 0 and health.position_resets == 1
        assert health.wind_dead_reckoning and health.airspeed_valid and health.wind_valid
        assert not health.accel_error and health.magnetometer_in_use
        assert abs(nav.state[layout.POS_NED_M][2] + 100.0) < 10.0  # control flies on it
        out.append(rows)
    return np.array(out)


@pytest.mark.slow
def test_with_gps(runs: Array) -> None:
    part = runs[:, : round(LOST_S - 22.0)]
    nees = part[:, :, :4].mean(axis=(0, 1))
    assert (nees[:3] > 0.4).all() and (nees < 1.5).all()
    rms = np.sqrt((part**2).mean(axis=(0, 1)))
    assert rms[4] < 0.3 and rms[5] < 0.06 and rms[6] < 0.3


@pytest.mark.slow
def test_dead_reckoning(runs: Array) -> None:
    part = runs[:, round(LOST_S - 20.0) :]
    nees = part[:, :, :4].mean(axis=(0, 1))
    assert (nees > 0.1).all() and (nees < 1.3).all()
    assert np.sqrt((part[:, :, 4] ** 2).mean()) < 0.4 and part[:, :, 4].max() < 1.0
    assert np.sqrt((part[:, -1, 7] ** 2).mean()) < 1.0
    assert (part[:, -1, 6] < 2.5 * part[:, -1, 8]).all() and part[:, -1, 6].max() < 150.0
