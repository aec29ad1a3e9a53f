"""Target fusion on flights of two quadrotors in the embedded SITL (`benchmarks/target_fusion.py`)."""

import importlib.util
import math
import statistics
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from estimators.lissajous import LissajousEstimator, LissajousParameters
from estimators.runner import Runner

pytestmark = pytest.mark.slow

BENCHMARK = Path(__file__).parents[3] / "benchmarks" / "target_fusion.py"


def load() -> ModuleType:
    specification = importlib.util.spec_from_file_location("target_fusion_benchmark", BENCHMARK)
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules["target_fusion_benchmark"] = module
    specification.loader.exec_module(module)
    return module


bench = load()
SETTING = bench.Setting()


@pytest.fixture(scope="module")
def flights():
    return [bench.fly(seed, SETTING) for seed in (0, 10)]


def test_proposed_is_better_than_kalman_and_that_than_unfiltered(flights) -> None:
    means = {}
    for form in bench.FORMS:
        scores = [bench.score(flight, bench.base_station(form, SETTING)) for flight in flights]
        assert all(score.detections > 1000 for score in scores)
        means[form] = statistics.fmean(score.rmse_m for score in scores)
    assert means["frequency"] < means["proposed"] < means["kalman"] < means["measurement"] < 1.5


def test_a_recorded_flight_gives_the_same_bits_again(flights) -> None:
    tables = []
    for _ in range(2):
        runner = Runner(bench.base_station("proposed", SETTING))
        for frame in flights[0].frames:
            runner.feed(frame)
        tables.append(runner.tables["TargetEstimate"].values)
    assert np.array_equal(*tables)


@pytest.mark.parametrize("vehicle", [1, 2])
def test_the_frequencies_that_were_flown_are_found(flights, vehicle: int) -> None:
    """Within one per cent, from a nominal value that is 1.8 % off (one sigma)."""
    omega_x, omega_y = SETTING.omega_rad_s
    estimator = LissajousEstimator(
        LissajousParameters(
            frequency=True,
            omega_x_rad_s=omega_x,
            omega_y_rad_s=omega_y,
            epsilon_rad_s=SETTING.epsilon_rad_s,
            centre_east_m=-5.0 * (vehicle - 1),  # the first one's home; they stand 5 m apart
            acceleration_psd_m2_s3=3e-4,
        )
    )
    runner = Runner(estimator, system_id=vehicle)
    for frame in flights[0].frames:
        runner.feed(frame)
    table = runner.tables["LissajousEstimate"]
    last = int(np.searchsorted(table.time_us, flights[0].end_us)) - 1
    pace = bench.paces(0)[vehicle - 1]
    true_x = omega_x + math.sqrt(SETTING.epsilon_rad_s * omega_x) * pace
    assert table["omega_x_rad_s"][last] == pytest.approx(true_x, rel=0.01)
    assert table["omega_y_rad_s"][last] == pytest.approx(2.0 * true_x, rel=0.01)
