"""Parameters and the gains made from a flight envelope."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from autopilot_bridge.control.fixed_wing import FixedWingController, FixedWingParameters
from autopilot_bridge.navigation.layout import NAV_SIZE
from tests.control.fixed_wing.aerosonde import AEROSONDE


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"airspeed_trim_m_s": math.nan}, "airspeed_trim_m_s = nan is not accepted: a finite number above 0"),
        ({"rate_roll_p": -0.1}, "rate_roll_p = -0.1 is not accepted: a finite number of at least 0"),
        (
            {"roll_time_constant_s": 0.0},
            "roll_time_constant_s = 0.0 is not accepted: .* above 0",
        ),
        ({"throttle_max": 1.2}, "throttle_max = 1.2 is not in 0..1"),
        ({"trim_elevator": -1.5}, "trim_elevator = -1.5 is not in -1..1"),
        ({"airspeed_min_m_s": 21.0}, "airspeed_min_m_s = 21.0 is not below airspeed_max_m_s = 20.0"),
        ({"airspeed_trim_m_s": 9.0}, "airspeed_trim_m_s = 9.0 is not in"),
        ({"pitch_min_rad": 0.6}, "pitch_min_rad = 0.6 is not below"),
        ({"roll_limit_rad": 1.5}, "roll_limit_rad = 1.5 is more than 80"),
        ({"load_factor_max": 0.9}, "load_factor_max = 0.9 is not 1 or more"),
        ({"speed_weight": 2.5}, "speed_weight = 2.5 is not in 0..2"),
    ],
)
def test_a_bad_value_is_named(changes: dict[str, float], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        FixedWingParameters(**changes)  # type: ignore[arg-type]


def test_gains_scale_with_the_aircraft() -> None:
    small = FixedWingParameters.for_envelope(AEROSONDE)
    assert small.rate_roll_ff == pytest.approx(1.0 / AEROSONDE.roll_rate_per_aileron_rad_s)
    assert small.airspeed_trim_m_s == small.scaling_airspeed_m_s == AEROSONDE.airspeed_trim_m_s
    sluggish = replace(
        AEROSONDE, roll_time_constant_s=0.4, short_period_frequency_rad_s=3.0, roll_rate_per_aileron_rad_s=1.5
    )
    big = FixedWingParameters.for_envelope(sluggish)
    assert big.roll_time_constant_s > small.roll_time_constant_s
    assert big.pitch_time_constant_s > small.pitch_time_constant_s
    assert big.height_time_constant_s > small.height_time_constant_s
    assert big.rate_roll_ff == pytest.approx(2.0 * 1.515 / 1.5 * small.rate_roll_ff, rel=1e-3)


def test_a_glider_flies_its_airspeed_by_pitch() -> None:
    glider = replace(
        AEROSONDE, powered=False, trim_throttle=0.0, climb_max_m_s=-1.0, sink_min_m_s=1.0, sink_max_m_s=4.0
    )
    parameters = FixedWingParameters.for_envelope(glider)
    assert not parameters.powered
    assert parameters.speed_weight == 2.0


@pytest.mark.parametrize("field", ["roll_rate_per_aileron_rad_s", "pitch_rate_per_elevator_rad_s"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan])
def test_a_control_without_effect_is_refused(field: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"aerosonde: {field} = "):
        FixedWingParameters.for_envelope(replace(AEROSONDE, **{field: value}))  # type: ignore[arg-type]


def test_without_a_rudder_nothing_is_asked_of_it() -> None:
    parameters = FixedWingParameters.for_envelope(
        replace(AEROSONDE, yaw_acceleration_per_rudder_rad_s2=0.0, sideslip_per_rudder_rad=0.0)
    )
    assert parameters.rate_yaw_p == parameters.rate_yaw_i == parameters.rate_yaw_ff == 0.0
    assert parameters.sideslip_gain_rad_s_per_m_s2 == 0.0


def test_every_field_is_packed_as_a_number() -> None:
    for field in fields(FixedWingParameters):
        assert isinstance(field.default, float | bool), field.name


@pytest.mark.parametrize(
    ("rate", "shape", "text"),
    [(20.0, (NAV_SIZE,), "physics_rate_hz = 20"), (250.0, (3,), r"nav has shape \(3,\)")],
)
def test_controller_refuses_bad_arguments(rate: float, shape: tuple[int], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        FixedWingController(physics_rate_hz=rate, nav=np.zeros(shape))
