"""The covariance describes the errors: NEES over 20 seeds with noise that matches the sensors; with the
firmwares' defaults it is never too small, whatever the receiver."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from autopilot_bridge.firmware import FLAVOUR_NAMES, get_flavour
from autopilot_bridge.parameters import ParameterStore
from flightsim.sensors import RECEIVERS, GpsParameters, ImuParameters, SensorSuiteParameters
from tests.navigation.bench import Bench
from tests.navigation.kinematic_flight import MAG_NED_GAUSS, fly
from tests.slow import slow_after

SEEDS = 20
START_S = 12.0  # in the climb, well after alignment
END_S = 90.0


@pytest.fixture(scope="module")
def runs() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """NEES (seed, time, 3) and errors (seed, time, 9), one per second of flight."""
    truth = fly(END_S)
    nees, errors = [], []
    for seed in range(SEEDS):
        bench = Bench(truth, seed=seed)
        for time_s in np.arange(START_S, END_S, 1.0):
            bench.run(float(time_s))
            nees.append(bench.nees())
            errors.append(bench.error())
        assert bench.filter.health.filter_resets == 0
    shape = (SEEDS, -1)
    return np.array(nees).reshape(*shape, 3), np.array(errors).reshape(*shape, 9)


@pytest.mark.parametrize(("index", "name"), [(0, "attitude"), (1, "velocity"), (2, "position")])
@pytest.mark.sampled(1)
def test_nees_is_in_its_95_percent_band(
    runs: tuple[NDArray[np.float64], NDArray[np.float64]], index: int, name: str
) -> None:
    nees = runs[0][:, :, index]
    low, high = chi2.ppf([0.025, 0.975], 3 * SEEDS) / SEEDS  # of the mean over seeds, Bar-Shalom 5.4.2
    over_seeds = nees.mean(axis=0)
    assert low < over_seeds.mean() < high, name
    # Errors are correlated over time, so a run of seconds may lie outside; most must not.
    assert np.mean(over_seeds < high) > 0.85, name
    assert over_seeds.max() < 2.0 * high, name


def test_accuracy(runs: tuple[NDArray[np.float64], NDArray[np.float64]]) -> None:
    errors = runs[1]
    rms = np.sqrt((errors**2).mean(axis=(0, 1)))
    assert np.hypot.reduce(rms[6:9]) < 0.5  # required: 1.5 m
    assert np.degrees(np.hypot.reduce(rms[0:3])) < 0.6  # required: 1.5 deg
    per_seed = np.sqrt((errors**2).mean(axis=1))
    assert np.sqrt((per_seed[:, 6:9] ** 2).sum(axis=1)).max() < 1.5
    assert np.degrees(np.sqrt((per_seed[:, 0:3] ** 2).sum(axis=1)).max()) < 1.5


@pytest.mark.parametrize("seeds", slow_after(1, (6, 20)))
@pytest.mark.parametrize("receiver", RECEIVERS)
@pytest.mark.parametrize("flavour", FLAVOUR_NAMES)
@pytest.mark.sampled(2)
def test_the_firmwares_defaults_cover_the_errors(flavour: str, receiver: str, seeds: int) -> None:
    """Their figures are wider than good sensors', so NEES lies below the band; above it, it never may."""
    store = ParameterStore(get_flavour(flavour).parameter_definitions(), get_flavour(flavour).airframe)
    parameters = replace(get_flavour(flavour).navigation_parameters(store), mag_ned_gauss=MAG_NED_GAUSS)
    imu = ImuParameters()
    noisy = replace(
        imu,
        gyro_noise_density_rad_s_sqrt_hz=2.0 * imu.gyro_noise_density_rad_s_sqrt_hz,
        accel_noise_density_m_s2_sqrt_hz=10.0 * imu.accel_noise_density_m_s2_sqrt_hz,
    )
    truth = fly(60.0)
    nees = []
    for seed in range(seeds):
        sensors = SensorSuiteParameters(gps=GpsParameters.of(receiver), imu=noisy if seed % 2 else imu)
        bench = Bench(truth, seed=seed, sensors=sensors, parameters=parameters)
        for time_s in range(15, 60, 5):
            bench.run(float(time_s))
            nees.append(bench.nees())
    mean = np.mean(nees, axis=0)
    high = chi2.ppf(0.975, 3 * seeds) / seeds
    assert (mean < high).all()
    assert (mean[:2] < 1.5).all()  # attitude and velocity: twice the noise, ten times in the accelerometer
    assert mean[2] > 0.2
