"""Compensation of an aircraft's field, with the simulator's magnetometer on a moving body."""

import json
import math

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.survey.compensation import (
    CYCLES,
    TERMS,
    Compensation,
    compensation_bytes,
    direction_cosines,
    figure_of_merit_nt,
    fit_compensation,
    load_compensation,
    noise_figure_nt,
)
from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import (
    MagneticField,
    MagneticMap,
    MainField,
    SurveyMagnetometer,
    SurveyMagnetometerParameters,
    VehicleFieldParameters,
)

RATE_HZ = 10
TURN_S = 20.0
PERIOD_S = 5.0
AMPLITUDES = {"roll": math.radians(10.0), "pitch": math.radians(5.0), "yaw": math.radians(5.0)}
HOME = Home()
DIRECTION = MainField(HOME).direction_ned


def manoeuvres():
    """Rolls, pitches and yaws of `CYCLES` cycles each on four headings, with turns between: (n, 3) attitudes,
    and the slice of each manoeuvre. The end is the begin of the next flight.
    """
    attitudes, slices = [], []
    cycles = round(CYCLES * PERIOD_S * RATE_HZ)
    turning = round(TURN_S * RATE_HZ)
    for number in range(4):
        heading = 0.3 + 0.5 * math.pi * number
        for axis, name in enumerate(("roll", "pitch", "yaw")):
            wave = AMPLITUDES[name] * np.sin(2.0 * math.pi * np.arange(cycles) / (PERIOD_S * RATE_HZ))
            block = np.zeros((cycles, 3))
            block[:, 2] = heading
            block[:, axis] += wave
            start = sum(map(len, attitudes))
            attitudes.append(block)
            slices.append(slice(start, start + cycles))
        share = np.arange(turning) / turning
        turn = np.zeros((turning, 3))
        turn[:, 0] = math.radians(20.0) * np.sin(math.pi * share) ** 2
        turn[:, 2] = heading + 0.5 * math.pi * (share - np.sin(math.tau * share) / math.tau)
        attitudes.append(turn)
    return np.concatenate(attitudes), slices


def readings(attitudes, parameters, seed):
    """The simulator's magnetometer on a body with these attitudes over a field without anomalies."""
    lines = np.array([-1e5, 1e5])
    plain = MagneticMap(
        north_m=lines, east_m=lines, total_field_nt=np.full((2, 2), 48_000.0), height_m=0.0, home=HOME
    )
    truth = np.zeros(t.TRUTH_SIZE)
    truth[t.LAT_RAD], truth[t.LON_RAD] = math.radians(HOME.lat_deg), math.radians(HOME.lon_deg)
    truth[t.ALT_M] = HOME.alt_m + 500.0
    truth[t.MAG_NED_GAUSS] = 0.48 * DIRECTION
    magnetometer = SurveyMagnetometer(
        parameters,
        truth=truth,
        field=MagneticField(plain),
        physics_rate_hz=RATE_HZ,
        seed=RandomStreams(seed).child("vehicle", 0, "sensor", "survey_magnetometer"),
    )
    euler_rates = np.gradient(np.unwrap(attitudes, axis=0), 1.0 / RATE_HZ, axis=0)
    out = []
    for k, (roll, pitch, yaw) in enumerate(attitudes):
        half = 0.5 * np.array([roll, pitch, yaw])
        (cr, cp, cy), (sr, sp, sy) = np.cos(half), np.sin(half)
        truth[t.Q_NED_FROM_FRD] = (
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        )
        rr, pr, yr = euler_rates[k]
        truth[t.RATES_FRD_RAD_S] = (
            rr - yr * math.sin(pitch),
            pr * math.cos(roll) + yr * math.sin(roll) * math.cos(pitch),
            -pr * math.sin(roll) + yr * math.cos(roll) * math.cos(pitch),
        )
        out.append(magnetometer.step(k * 1_000_000 // RATE_HZ).total_field_nt)
    return np.array(out)


def cosines_of(attitudes, error_rad=0.0):
    times = np.arange(len(attitudes)) / RATE_HZ
    reported = attitudes + error_rad
    return times, direction_cosines(*reported.T, times, DIRECTION)  # type: ignore[call-arg]


RAW = SurveyMagnetometerParameters(
    noise_nt=0.05, heading_error_nt=0.0, drift_nt=0.0, vehicle_field=VehicleFieldParameters()
)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.sampled(1)
def test_the_figure_of_merit_falls_by_ten_times_and_more(seed):
    """One flight calibrates, the next one is judged; attitudes are 0.3 degrees off."""
    attitudes, slices = manoeuvres()
    times, (cosines, rates) = cosines_of(attitudes, error_rad=math.radians(0.3))
    calibration, raw = np.split(readings(np.concatenate((attitudes, attitudes)), RAW, seed), 2)
    fitted = fit_compensation(times, calibration, cosines, rates)
    compensated = raw - fitted.field_nt(cosines, rates)
    before = figure_of_merit_nt([raw[s] for s in slices], rate_hz=RATE_HZ)
    after = figure_of_merit_nt([compensated[s] for s in slices], rate_hz=RATE_HZ)
    assert before > 10.0 * after


def test_noise_alone_has_the_figure_of_merit_that_is_stated_for_it():
    rng = np.random.default_rng(5)
    flown = [np.zeros(round(length_s * RATE_HZ)) for length_s in (24.0, 30.0, 48.0)] * 4
    stated = noise_figure_nt(flown, 0.2, rate_hz=RATE_HZ)
    trend = [0.1 * np.arange(len(values)) for values in flown]
    drawn = [
        figure_of_merit_nt([0.2 * rng.standard_normal(len(t)) + t for t in trend], rate_hz=RATE_HZ)
        for _ in range(20)
    ]
    assert stated == pytest.approx(np.mean(drawn), rel=0.1)
    # whatever the compensation, a figure of merit does not fall far below it
    assert min(drawn) > 0.7 * stated


@pytest.mark.slow
def test_a_compensation_of_another_aircraft_does_not_help():
    attitudes, slices = manoeuvres()
    times, (cosines, rates) = cosines_of(attitudes)
    fitted = fit_compensation(times, readings(attitudes, RAW, 1), cosines, rates)
    other = readings(attitudes, RAW, 2)
    wrong = other - fitted.field_nt(cosines, rates)
    after = figure_of_merit_nt([wrong[s] for s in slices], rate_hz=RATE_HZ)
    assert after > 0.3 * figure_of_merit_nt([other[s] for s in slices], rate_hz=RATE_HZ)


def test_flights_that_make_no_compensation_are_refused():
    attitudes = np.zeros((600, 3))
    times, (cosines, rates) = cosines_of(attitudes)
    with pytest.raises(EstimatorError, match="roll, pitch and yaw on four headings"):
        fit_compensation(times, np.zeros(600), cosines, rates)
    with pytest.raises(EstimatorError, match="has 100 readings; 300 or more"):
        fit_compensation(times[:100], np.zeros(100), cosines[:100], rates[:100])
    with pytest.raises(EstimatorError, match="figure of merit of 3 manoeuvres"):
        figure_of_merit_nt([np.zeros(30)] * 3, rate_hz=10.0)


def test_a_compensation_can_be_read_again_also_with_the_keys_of_older_files(tmp_path):
    made = compensation_bytes(Compensation(coefficients=np.arange(TERMS, dtype=np.float64)))
    (tmp_path / "new.json").write_bytes(made)
    older = json.loads(made) | {"main_nt": 48_000.0, "improvement": 14.58}
    (tmp_path / "old.json").write_text(json.dumps(older))
    for name in ("new.json", "old.json"):
        np.testing.assert_array_equal(load_compensation(tmp_path / name).coefficients, np.arange(TERMS))


@pytest.mark.parametrize(
    ("contents", "words"),
    [
        ("{", "can't be read"),
        ("[]", "is no compensation; accepted is the format flightstack-compensation-1"),
        (
            '{"format": "flightstack-compensation-1"}',
            "coefficients_nt is None; accepted are 16 finite numbers",
        ),
        (
            '{"format": "flightstack-compensation-1", "coefficients_nt": [1, 2]}',
            r"coefficients_nt is \[1, 2\]",
        ),
        (
            f'{{"format": "flightstack-compensation-1", "coefficients_nt": {["a"] * 16}}}'.replace("'", '"'),
            "finite",
        ),
    ],
)
def test_files_that_are_no_compensation_are_refused(tmp_path, contents, words):
    (tmp_path / "c.json").write_text(contents)
    with pytest.raises(EstimatorError, match=words):
        load_compensation(tmp_path / "c.json")
