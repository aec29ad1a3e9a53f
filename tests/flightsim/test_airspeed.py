"""Pitot tube and flow vanes against closed forms: Bernoulli, isentropic flow, lag, incidence."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from flightsim import interface as i
from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.sensors import AirspeedParameters, FlowVaneParameters, RangefinderParameters
from flightsim.sensors.airspeed import impact_pressure_pa, pressure_recovery
from flightsim.sensors.sensor import SensorModel, SensorParameters

Array = NDArray[np.float64]

SEA_LEVEL_PA, SEA_LEVEL_K, SEA_LEVEL_KG_M3 = 101325.0, 288.15, 1.225
PERFECT = AirspeedParameters(
    noise_pa=0.0, zero_offset_pa=0.0, scale_error=0.0, drift_pa=0.0, lag_s=0.0, quantum_pa=0.0
)
PERFECT_VANE = FlowVaneParameters(noise_rad=0.0, misalignment_rad=0.0, lag_s=0.0, quantum_rad=0.0)


def flow(speed_m_s: float, *, alpha_rad: float = 0.0, beta_rad: float = 0.0) -> Array:
    truth = np.zeros(t.TRUTH_SIZE)
    truth[t.PRESSURE_PA], truth[t.TEMPERATURE_K] = SEA_LEVEL_PA, SEA_LEVEL_K
    truth[t.DENSITY_KG_M3] = SEA_LEVEL_KG_M3
    truth[t.AIRSPEED_TRUE_M_S] = speed_m_s
    truth[t.DYNAMIC_PRESSURE_PA] = 0.5 * SEA_LEVEL_KG_M3 * speed_m_s**2
    truth[t.ANGLE_OF_ATTACK_RAD], truth[t.SIDESLIP_RAD] = alpha_rad, beta_rad
    return truth


def build(parameters: SensorParameters, seed: int = 1) -> tuple[SensorModel, np.random.Generator]:
    rng = RandomStreams(seed).generator("specimen")
    return parameters.build(1.0 / parameters.rate_hz, rng), rng


def record(parameters: SensorParameters, truth: Array, samples: int, seed: int = 1) -> Array:
    model, rng = build(parameters, seed)
    normals = rng.standard_normal((samples, model.normals_per_sample))
    out = np.empty((samples, model.size))
    for row in range(samples):
        assert model.kernel(truth, model.constants, model.state, normals, row, out[row])
    return out


@pytest.mark.parametrize("speed_m_s", [0.0, 5.0, 12.0, 25.0, 40.0])
def test_a_perfect_tube_obeys_bernoulli(speed_m_s: float) -> None:
    """Up to 40 m/s compressibility adds less than M^2 / 4 = 0.35 %."""
    pressure_pa = record(PERFECT, flow(speed_m_s), 1)[0, i.AIRSPEED_DIFFERENTIAL_PRESSURE_PA]
    bernoulli_pa = 0.5 * SEA_LEVEL_KG_M3 * speed_m_s**2
    mach = speed_m_s / math.sqrt(1.4 * SEA_LEVEL_PA / SEA_LEVEL_KG_M3)
    assert bernoulli_pa <= pressure_pa <= bernoulli_pa * (1.0 + 0.25 * mach**2 + 1e-4)
    # the equivalent airspeed that an autopilot makes of it
    assert math.sqrt(2.0 * pressure_pa / SEA_LEVEL_KG_M3) == pytest.approx(speed_m_s, rel=2e-3)


@pytest.mark.parametrize(
    ("mach", "ratio"),
    # NACA report 1135, table I: p / p0 of subsonic flow
    [(0.1, 0.9930), (0.3, 0.9395), (0.5, 0.8430), (0.8, 0.6560)],
)
def test_impact_pressure_is_the_isentropic_one(mach: float, ratio: float) -> None:
    dynamic_pa = 0.5 * 1.4 * SEA_LEVEL_PA * mach**2
    total_pa = SEA_LEVEL_PA + impact_pressure_pa(SEA_LEVEL_PA, dynamic_pa)
    assert SEA_LEVEL_PA / total_pa == pytest.approx(ratio, abs=5e-5)


@pytest.mark.parametrize(("alpha_deg", "beta_deg"), [(14.0, 0.0), (0.0, -14.0), (-8.0, 8.0)])
def test_small_incidence_costs_nothing(alpha_deg: float, beta_deg: float) -> None:
    truth = flow(20.0, alpha_rad=math.radians(alpha_deg), beta_rad=math.radians(beta_deg))
    np.testing.assert_array_equal(record(PERFECT, truth, 1), record(PERFECT, flow(20.0), 1))


def test_large_incidence_loses_pressure_down_to_none_from_behind() -> None:
    insensitive = PERFECT.insensitive_angle_rad
    angles = np.radians(np.arange(0.0, 181.0, 1.0))
    recovery = np.array([pressure_recovery(angle, insensitive) for angle in angles.tolist()])
    assert np.all(np.diff(recovery) <= 0.0)
    assert recovery[15] == 1.0 and recovery[90] == 0.0 and recovery[180] == 0.0
    halfway = 0.5 * (insensitive + 0.5 * math.pi)
    assert pressure_recovery(halfway, insensitive) == pytest.approx(0.5)
    assert np.abs(np.diff(recovery)).max() < 0.03  # no steps
    for alpha_rad, beta_rad in ((math.pi, 0.0), (math.pi / 2, 0.0), (0.0, math.pi / 2)):
        backwards = record(PERFECT, flow(20.0, alpha_rad=alpha_rad, beta_rad=beta_rad), 1)
        assert backwards[0, i.AIRSPEED_DIFFERENTIAL_PRESSURE_PA] == pytest.approx(0.0, abs=1e-9)


def test_the_pressure_lags_first_order() -> None:
    parameters = AirspeedParameters(
        noise_pa=0.0, zero_offset_pa=0.0, scale_error=0.0, drift_pa=0.0, quantum_pa=0.0, lag_s=0.2
    )
    model, _ = build(parameters)
    normals, out = np.zeros((1, model.normals_per_sample)), np.empty(model.size)
    model.kernel(flow(0.0), model.constants, model.state, normals, 0, out)
    truth = flow(20.0)
    final_pa = impact_pressure_pa(SEA_LEVEL_PA, truth[t.DYNAMIC_PRESSURE_PA])
    for sample in range(1, 40):
        model.kernel(truth, model.constants, model.state, normals, 0, out)
        expected_pa = final_pa * (1.0 - math.exp(-sample / parameters.rate_hz / 0.2))
        assert out[i.AIRSPEED_DIFFERENTIAL_PRESSURE_PA] == pytest.approx(expected_pa, rel=1e-9)


def test_noise_and_quantum() -> None:
    parameters = AirspeedParameters(drift_pa=0.0, zero_offset_pa=0.0, scale_error=0.0)
    truth = flow(22.0)
    pressure_pa = record(parameters, truth, 20_000)[:, i.AIRSPEED_DIFFERENTIAL_PRESSURE_PA]
    counts = pressure_pa / parameters.quantum_pa
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    variance = parameters.noise_pa**2 + parameters.quantum_pa**2 / 12.0  # Sheppard
    assert np.var(pressure_pa) == pytest.approx(variance, rel=5.0 * math.sqrt(2.0 / 20_000))
    expected_pa = impact_pressure_pa(SEA_LEVEL_PA, truth[t.DYNAMIC_PRESSURE_PA])
    assert pressure_pa.mean() == pytest.approx(expected_pa, abs=0.06)


def test_drift_is_gauss_markov_and_independent_of_the_noise() -> None:
    parameters = AirspeedParameters(
        rate_hz=50,
        noise_pa=2.0,
        zero_offset_pa=0.0,
        scale_error=0.0,
        quantum_pa=0.0,
        drift_pa=2.0,
        drift_time_constant_s=0.02,
    )
    pressure_pa = record(parameters, flow(0.0), 40_000)[:, i.AIRSPEED_DIFFERENTIAL_PRESSURE_PA]
    assert np.var(pressure_pa) == pytest.approx(8.0, rel=0.05)
    assert np.var(np.diff(pressure_pa)) == pytest.approx(8.0 + 8.0 * (1.0 - math.exp(-1.0)), rel=0.05)


def test_specimens_differ_by_offset_and_scale() -> None:
    parameters = AirspeedParameters(noise_pa=0.0, drift_pa=0.0, quantum_pa=0.0, scale_error=0.02)
    full_pa = impact_pressure_pa(SEA_LEVEL_PA, flow(40.0)[t.DYNAMIC_PRESSURE_PA])
    still, fast = (
        np.array(
            [
                record(parameters, flow(v), 1, seed)[0, i.AIRSPEED_DIFFERENTIAL_PRESSURE_PA]
                for seed in range(400)
            ]
        )
        for v in (0.0, 40.0)
    )
    spread = 5.0 * math.sqrt(2.0 / 400)
    assert np.var(still) == pytest.approx(parameters.zero_offset_pa**2, rel=spread)
    assert np.var((fast - still) / full_pa) == pytest.approx(0.02**2, rel=spread)


def test_the_transducer_saturates_and_knows_its_temperature() -> None:
    sample = record(PERFECT, flow(200.0), 1)[0]
    assert sample[i.AIRSPEED_DIFFERENTIAL_PRESSURE_PA] == PERFECT.range_pa
    assert sample[i.AIRSPEED_TEMPERATURE_C] == pytest.approx(15.0 + PERFECT.self_heating_k, abs=0.05)


def test_vanes_read_the_flow_angles() -> None:
    sample = record(PERFECT_VANE, flow(20.0, alpha_rad=0.1, beta_rad=-0.05), 1)[0]
    np.testing.assert_allclose(sample, (0.1, -0.05), rtol=1e-12)
    stops = record(PERFECT_VANE, flow(20.0, alpha_rad=2.0, beta_rad=-1.5), 1)[0]
    np.testing.assert_allclose(stops, (PERFECT_VANE.limit_rad, -PERFECT_VANE.limit_rad), rtol=1e-12)


def test_vanes_stay_where_they_are_without_flow() -> None:
    model, _ = build(PERFECT_VANE)
    normals, out = np.zeros((1, i.VANE_SIZE)), np.empty(i.VANE_SIZE)
    model.kernel(flow(20.0, alpha_rad=0.1, beta_rad=0.02), model.constants, model.state, normals, 0, out)
    model.kernel(flow(1.0, alpha_rad=0.3, beta_rad=0.3), model.constants, model.state, normals, 0, out)
    np.testing.assert_allclose(out, (0.1, 0.02), rtol=1e-12)


def test_vane_noise_misalignment_and_lag() -> None:
    parameters = FlowVaneParameters(misalignment_rad=0.0, quantum_rad=0.0, lag_s=0.0)
    samples = record(parameters, flow(20.0), 10_000)
    assert np.var(samples) == pytest.approx(parameters.noise_rad**2, rel=0.05)
    crooked = FlowVaneParameters(noise_rad=0.0, quantum_rad=0.0)
    offsets = np.array([record(crooked, flow(20.0), 1, seed)[0] for seed in range(300)])
    assert np.var(offsets) == pytest.approx(crooked.misalignment_rad**2, rel=5.0 * math.sqrt(2.0 / 600))
    slow = FlowVaneParameters(noise_rad=0.0, misalignment_rad=0.0, quantum_rad=0.0, lag_s=0.1)
    angles = record(slow, flow(20.0, alpha_rad=0.2), 10)[:, i.VANE_ANGLE_OF_ATTACK_RAD]
    expected = 0.2 * (1.0 - np.exp(-np.arange(1, 11) / slow.rate_hz / 0.1))
    np.testing.assert_allclose(angles, expected, rtol=1e-9)


def test_the_long_range_lidar_sees_the_ground_from_the_approach() -> None:
    truth = flow(15.0)
    truth[t.Q_NED_FROM_FRD] = (1.0, 0.0, 0.0, 0.0)
    truth[t.HEIGHT_ABOVE_GROUND_M] = 60.0
    samples = record(RangefinderParameters.long_range(), truth, 2000)[:, i.RANGE_DISTANCE_M]
    assert samples.mean() == pytest.approx(60.0, abs=0.01)
    assert samples.std() == pytest.approx(0.033, rel=0.15)
    assert RangefinderParameters.long_range(max_range_m=50.0).max_range_m == 50.0


@pytest.mark.parametrize(
    ("parameters", "named"),
    [
        ({"rate_hz": 2.5}, "rate_hz 2.5"),
        ({"lag_s": -0.1}, "lag_s -0.1"),
        ({"range_pa": 0.0}, "range_pa 0"),
        ({"noise_pa": math.nan}, "noise_pa nan"),
        ({"insensitive_angle_rad": 1.6}, "insensitive_angle_rad = 1.6"),
    ],
)
def test_bad_parameters_are_named(parameters: dict[str, float], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        AirspeedParameters(**parameters)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"limit_rad 0"):
        FlowVaneParameters(limit_rad=0.0)
