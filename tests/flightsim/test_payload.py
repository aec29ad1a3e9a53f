"""The composed payload and the survey magnetometer: errors as specified, separate streams, bits of a seed."""

import math
from dataclasses import fields, replace
from typing import Any, get_type_hints

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from flightsim import truth as t
from flightsim.foundation.options import without_none
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import (
    LEVEL,
    CameraParameters,
    Carrier,
    GaussianSignature,
    Gimbal,
    GimbalParameters,
    GroundTargetParameters,
    GroundTargets,
    MagneticField,
    MagneticMap,
    Payload,
    PayloadParameters,
    RandomWalk,
    SurveyMagnetometer,
    SurveyMagnetometerParameters,
)

Array = NDArray[np.float64]

HOME = Home()
STEP_US = 4000
FLAT = MagneticMap(
    north_m=np.array([-2000.0, 2000.0]),
    east_m=np.array([-2000.0, 2000.0]),
    total_field_nt=np.full((2, 2), 48000.0),
    vertical_gradient_nt_m=np.full((2, 2), -0.02),
    height_m=100.0,
    home=HOME,
)
QUIET = {"noise_nt": 0.0, "heading_error_nt": 0.0, "drift_nt": 0.0, "quantum_nt": 0.0}
EVERYTHING = PayloadParameters(
    gimbal=GimbalParameters(),
    camera=CameraParameters(false_detections_per_frame=0.5),
    magnetometer=SurveyMagnetometerParameters(),
)


def write_truth(truth: Array, step: int) -> None:
    """A turn over the targets."""
    s = step / 250.0
    lat_deg, lon_deg = HOME.offset(20.0 * math.sin(0.2 * s), 20.0 * math.cos(0.2 * s))
    truth[t.LAT_RAD], truth[t.LON_RAD] = math.radians(lat_deg), math.radians(lon_deg)
    truth[t.ALT_M] = HOME.alt_m + 100.0 + math.sin(s)
    q = Rotation.from_euler("ZYX", [-0.2 * s, 0.05, 0.2 * math.sin(0.5 * s)]).as_quat()
    truth[t.Q_NED_FROM_FRD] = np.roll(q, 1)
    truth[t.RATES_FRD_RAD_S] = (0.0, 0.0, -0.2)
    truth[t.MAG_NED_GAUSS] = (0.21, 0.01, 0.43)


def make(
    parameters: PayloadParameters = EVERYTHING, *, targets: int = 2, vehicle: int = 0, seed: int = 1
) -> tuple[Payload, Array]:
    streams = RandomStreams(seed)
    truth = np.zeros(t.TRUTH_SIZE)
    write_truth(truth, 0)
    walk = RandomWalk(south_m=-40.0, west_m=-40.0, north_m=40.0, east_m=40.0, speed_m_s=1.0)
    payload = Payload(
        parameters,
        Carrier(
            truth=truth,
            home=HOME,
            physics_rate_hz=250,
            seeds=lambda name: streams.child("vehicle", vehicle, "sensor", name),
            targets=GroundTargets(
                [GroundTargetParameters(motion=walk, tag_id=index) for index in range(targets)],
                seeds=lambda index: streams.child("target", index),
            ),
            magnetic_field=MagneticField(FLAT, [GaussianSignature(north_m=0.0, east_m=0.0)]),
        ),
    )
    return payload, truth


def fly(payload: Payload, truth: Array, steps: int = 2500) -> dict[str, list[Any]]:
    log: dict[str, list[Any]] = {"gimbal": [], "camera": [], "magnetometer": []}
    gimbal = payload.get(Gimbal)
    if gimbal is not None:
        gimbal.command(LEVEL, pitch_rad=-0.5 * math.pi)
    for step in range(steps):
        write_truth(truth, step)
        payload.step(step * STEP_US)
        for name, reading in payload.readings.items():
            log[name].append(reading if gimbal is None or name != "gimbal" else attitude_of(gimbal))
    return log


def attitude_of(gimbal: Gimbal) -> bytes:
    return gimbal.measured_q_ned_from_gimbal.tobytes()


def test_rates() -> None:
    log = fly(*make())
    assert len(log["gimbal"]) == 500
    assert len(log["magnetometer"]) == 100
    assert len(log["camera"]) == 99  # the last one is under way
    assert sum(len(frame.detections) for frame in log["camera"]) > 100


@pytest.mark.parametrize("removed", ["gimbal", "magnetometer", "camera"])
@pytest.mark.sampled(1)
def test_removing_a_device_changes_no_other(removed: str) -> None:
    # A camera looks elsewhere without its gimbal: then only the others can be compared.
    whole = fly(*make())
    without = fly(*make(replace(EVERYTHING, **{removed: None})))
    assert without[removed] == []
    for name in {"gimbal", "magnetometer", "camera"} - {removed}:
        if (removed, name) != ("gimbal", "camera"):
            assert without[name] == whole[name]


def test_only_a_magnetometer_alone_rests_between_its_readings() -> None:
    alone = PayloadParameters(magnetometer=SurveyMagnetometerParameters())
    names = {each.name for each in fields(PayloadParameters)} - {"magnetometer", "others", "outages"}
    hints = get_type_hints(PayloadParameters)

    def next_us(parameters: PayloadParameters) -> int:
        payload, _ = make(parameters)
        payload.step(STEP_US)
        return payload.next_us

    assert next_us(alone) > STEP_US
    for name in names:
        parameters, _ = without_none(hints[name])
        assert next_us(replace(alone, **{name: parameters()})) == 0


def test_one_target_more_changes_no_other() -> None:
    def of(log: dict[str, list[object]], tags: set[int]) -> list[object]:
        return [d for frame in log["camera"] for d in frame.detections if d.target_id in tags]  # type: ignore[attr-defined]

    two, three = fly(*make(targets=2)), fly(*make(targets=3))
    assert of(two, {0, 1}) == of(three, {0, 1}) != []
    assert of(two, {-1}) == of(three, {-1}) != []
    assert of(three, {2}) != []
    assert two["magnetometer"] == three["magnetometer"]


def test_same_seed_same_bits_another_seed_or_vehicle_other_bits() -> None:
    first, again = fly(*make()), fly(*make())
    assert first == again
    for other in (fly(*make(seed=2)), fly(*make(vehicle=1))):
        for name in first:
            assert first[name] != other[name]


def test_a_payload_of_nothing_and_one_without_a_field() -> None:
    payload, truth = make(PayloadParameters())
    assert fly(payload, truth, 100) == {"gimbal": [], "camera": [], "magnetometer": []}
    with pytest.raises(ValueError, match="needs a magnetic map"):
        Payload(
            PayloadParameters(magnetometer=SurveyMagnetometerParameters()),
            Carrier(truth=truth, home=HOME, physics_rate_hz=250, seeds=RandomStreams(1).child),
        )
    blind = Payload(
        PayloadParameters(camera=CameraParameters(latency_s=0.0)),
        Carrier(truth=truth, home=HOME, physics_rate_hz=250, seeds=RandomStreams(1).child),
    )
    blind.step(0)
    assert blind.readings["camera"].detections == ()


# --- survey magnetometer ---


def readings(
    parameters: SurveyMagnetometerParameters, *, count: int = 1, seed: int = 1, yaw_deg: float = 0.0
) -> Array:
    truth = np.zeros(t.TRUTH_SIZE)
    write_truth(truth, 0)
    truth[t.ALT_M] = HOME.alt_m + 100.0
    truth[t.Q_NED_FROM_FRD] = np.roll(Rotation.from_euler("z", yaw_deg, degrees=True).as_quat(), 1)
    sensor = SurveyMagnetometer(
        parameters,
        truth=truth,
        field=MagneticField(FLAT),
        physics_rate_hz=250,
        seed=RandomStreams(seed).child("survey_magnetometer"),
    )
    taken = []
    step = 0
    while len(taken) < count:
        reading = sensor.step(step * STEP_US)
        if reading is not None:
            taken.append(reading.total_field_nt)
        step += 1
    return np.array(taken)


def test_a_perfect_magnetometer_reads_the_field_where_it_is() -> None:
    payload, truth = make(PayloadParameters(magnetometer=SurveyMagnetometerParameters(**QUIET)))
    field = MagneticField(FLAT, [GaussianSignature(north_m=0.0, east_m=0.0)])
    for step in range(0, 1000):
        write_truth(truth, step)
        payload.step(step * STEP_US)
        if "magnetometer" in payload.readings:
            reading = payload.readings["magnetometer"]
            assert reading.time_us == step * STEP_US
            s = step / 250.0
            place = (20.0 * math.sin(0.2 * s), 20.0 * math.cos(0.2 * s), 100.0 + math.sin(s))
            assert reading.total_field_nt == pytest.approx(field.total_nt(*place), abs=1e-5)


def test_noise_quantum_and_latency() -> None:
    values = readings(
        SurveyMagnetometerParameters(heading_error_nt=0.0, drift_nt=0.0, quantum_nt=0.05), count=4000
    )
    assert np.var(values) == pytest.approx(0.2**2 + 0.05**2 / 12.0, rel=5.0 * math.sqrt(2.0 / 4000))
    assert values.mean() == pytest.approx(48000.0, abs=0.02)
    np.testing.assert_allclose(values / 0.05, np.round(values / 0.05), atol=1e-6)
    late, truth = make(PayloadParameters(magnetometer=SurveyMagnetometerParameters(latency_s=0.25)))
    for step in range(200):
        write_truth(truth, step)
        late.step(step * STEP_US)
        if "magnetometer" in late.readings:
            assert step * STEP_US - late.readings["magnetometer"].time_us == 248_000  # whole steps


def test_heading_error_has_the_form_of_tolles_and_lawson() -> None:
    parameters = SurveyMagnetometerParameters(**(QUIET | {"heading_error_nt": 2.0}))
    turns_deg = np.arange(0.0, 360.0, 30.0)
    values = np.array([readings(parameters, yaw_deg=float(yaw))[0] for yaw in turns_deg]) - 48000.0
    # permanent terms on level ground: a constant and one wave per turn, nothing more
    spectrum = np.abs(np.fft.rfft(values)) / turns_deg.size
    assert spectrum[1] > 0.05
    np.testing.assert_allclose(spectrum[2:], 0.0, atol=1e-5)
    specimens = np.array([readings(parameters, seed=seed)[0] for seed in range(400)]) - 48000.0
    assert np.var(specimens) == pytest.approx(4.0, rel=5.0 * math.sqrt(2.0 / 400))


def test_drift_is_gauss_markov() -> None:
    parameters = SurveyMagnetometerParameters(**(QUIET | {"drift_nt": 1.0, "drift_time_constant_s": 2.0}))
    drift_nt = readings(parameters, count=20_000) - 48000.0
    assert np.var(drift_nt) == pytest.approx(1.0, rel=0.2)
    lag = 20
    correlation = np.mean(drift_nt[lag:] * drift_nt[:-lag]) / np.var(drift_nt)
    assert correlation == pytest.approx(math.exp(-1.0), abs=0.08)
