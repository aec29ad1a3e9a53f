"""A fixed wing's estimates and what the filter says of them: with GPS, and dead-reckoned without."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.navigation import layout
from flightsim import truth as t
from flightsim.sensors.fault_kinds import FaultType, SensorUnit
from tests.navigation.kinematic_wing import Wing
from tests.navigation.wing_bench import WingBench

Array = NDArray[np.float64]

SEEDS = 8
LOST_S = 90.0
END_S = 240.0


def wander(seed: int) -> Wing:
    """Straight legs and turns both ways, light turbulence, a trim sideslip of its own."""
    rng = np.random.default_rng(seed)
    turns = tuple((t0, t0 + 10.0, float(rng.choice([-1, 1])) * 9.0) for t0 in np.arange(40.0, END_S, 35.0))
    return Wing(
        turns=turns, heading_rad=float(rng.uniform(-3, 3)), trim_sideslip_rad=float(rng.normal(0.0, 0.01))
    )


@pytest.fixture(scope="module")
def runs() -> Array:
    """(seed, time, values): nees4, tilt deg, position error m, its sigma, wind error m/s, velocity error."""
    out = []
    for seed in range(SEEDS):
        bench = WingBench(wander(seed), END_S, seed=seed)
        rows = []
        for time_s in np.arange(20.0, END_S, 2.0):
            if abs(time_s - LOST_S) < 0.5:
                bench.suite.faults.inject(SensorUnit.GPS, FaultType.OFF)
            bench.run(float(time_s))
            error, health = bench.error(), bench.filter.health
            rows.append(
                [
                    *bench.nees4(),
                    bench.tilt_deg,
                    bench.position_error_m,
                    health.position_horizontal_accuracy_m,
                    np.hypot(*bench.wind_error()),
                    np.hypot(*error[3:5]),
                ]
            )
        assert health.filter_resets == 0 and health.yaw_resets == 0 and health.position_resets == 1
        assert health.wind_dead_reckoning and health.position_horizontal_absolute
        out.append(rows)
    return np.array(out)


def split(runs: Array) -> tuple[Array, Array]:
    times = np.arange(20.0, END_S, 2.0)
    return runs[:, times < LOST_S], runs[:, times > LOST_S + 5.0]


@pytest.mark.parametrize(
    ("index", "low"),
    [(0, 0.5), (1, 0.5), (2, 0.5), (3, 0.3)],
    ids=["attitude", "velocity", "position", "wind"],
)
@pytest.mark.sampled(1)
def test_nees_with_gps(runs: Array, index: int, low: float) -> None:
    """Mean over seeds and time: attitude, velocity, position as they should be, wind on the careful side."""
    assert low < split(runs)[0][:, :, index].mean() < 1.5


@pytest.mark.parametrize("index", [0, 1, 2, 3], ids=["attitude", "velocity", "position", "wind"])
def test_nees_while_dead_reckoning(runs: Array, index: int) -> None:
    """Honest: never claims more than it knows, nor less than a half of it in standard deviations."""
    nees = split(runs)[1][:, :, index]
    assert 0.2 < nees.mean() < 1.3
    assert np.quantile(nees, 0.95) < 4.5


def test_position_uncertainty_grows_with_the_error(runs: Array) -> None:
    lost = split(runs)[1]
    rms, sigma = np.sqrt((lost[:, :, 5] ** 2).mean(axis=0)), lost[:, :, 6].mean(axis=0)
    assert np.diff(sigma).min() > -1.0 and sigma[-1] > 5.0 * sigma[5]  # a turn may tell of what came before
    assert (rms[10:] < 1.5 * sigma[10:]).all() and (rms[10:] > 0.4 * sigma[10:]).all()
    assert rms[-1] < 120.0


def test_accuracy_with_gps(runs: Array) -> None:
    with_gps = split(runs)[0]
    rms = np.sqrt((with_gps**2).mean(axis=(0, 1)))
    assert rms[4] < 0.25  # tilt, deg
    assert rms[5] < 0.3 and rms[8] < 0.06  # position, velocity
    assert np.sqrt((with_gps[:, -1, 7] ** 2).mean()) < 0.9  # wind, in gusts of 1 m/s


def test_turn_of_45_degrees_bank_with_gps() -> None:
    """Sustained coordinated turns, both ways: roll and pitch within half a degree RMS."""
    for seed, rate in ((1, 22.5), (2, -22.5)):
        bench = WingBench(Wing(turns=((40.0, 110.0, rate),)), 110.0, seed=seed).run(43.0)
        tilt, bank = [], []
        while bench.time_s < 110.0:
            bench.run(bench.time_s + 0.2)
            tilt.append(bench.tilt_deg)
            bank.append(abs(bench.filter.state[layout.EULER_RAD][0]))
        assert np.degrees(np.median(bank)) == pytest.approx(45.0, abs=2.0)
        assert np.sqrt(np.mean(np.square(tilt))) < 0.3


@pytest.mark.slow
def test_ten_minutes_of_orbit_without_gps() -> None:
    """150 m radius in 4 m/s of wind and light turbulence: what the GPS-denied missions rely on."""
    wing = Wing(turns=((40.0, 1000.0, math.degrees(25.0 / 150.0)),))
    bench = WingBench(wing, 670.0, seed=4).run(60.0)
    bench.suite.faults.inject(SensorUnit.GPS, FaultType.OFF)
    tilt = []
    while bench.time_s < 669.0:
        bench.run(bench.time_s + 1.0)
        tilt.append(bench.tilt_deg)
    p = bench.filter.covariance
    scale = 1.0 / np.sqrt(np.diag(p))
    np.testing.assert_array_equal(p, p.T)
    assert np.linalg.eigvalsh(p * np.outer(scale, scale)).min() > 1e-9
    assert np.sqrt(np.mean(np.square(tilt))) < 0.4 and max(tilt) < 1.2
    assert abs(np.degrees(bench.error()[2])) < 1.5
    assert np.hypot(*bench.wind_error()) < 1.2
    assert bench.position_error_m < 2.5 * bench.filter.health.position_horizontal_accuracy_m < 1200.0


def test_state_has_wind_and_airspeed() -> None:
    bench = WingBench(Wing(gust_m_s=(0.01, 0.01)), 60.0).run(5.0)
    state = bench.filter.state
    assert np.isnan(state[layout.WIND_NED_M_S]).all() and not bench.filter.health.wind_valid
    assert bench.filter.health.airspeed_valid and state[layout.AIRSPEED_M_S] < 5.0
    bench.run(60.0)
    health = bench.filter.health
    assert health.wind_valid and max(health.wind_variance_m2_s2) < 1.5
    np.testing.assert_allclose(state[layout.WIND_NED_M_S], [-3.2, 2.4, 0.0], atol=0.5)
    true = bench.truth[t.AIRSPEED_TRUE_M_S]
    assert state[layout.AIRSPEED_TRUE_M_S] == pytest.approx(true, abs=0.4)
    equivalent = true * math.sqrt(bench.truth[t.DENSITY_KG_M3] / 1.225)
    assert state[layout.AIRSPEED_M_S] == pytest.approx(equivalent, abs=0.4)
    assert health.airspeed_in_use and health.sideslip_in_use
    assert not (health.wind_dead_reckoning or health.dead_reckoning or health.airspeed_synthetic)
