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
        ({"airspeed_trim_m_s": math.nan}, "airspeed_trim_m_s nan"),
        ({"rate_roll_p": -0.1}, "rate_roll_p -0.1"),
        ({"roll_time_constant_s": 0.0}, "roll_time_constant_s 0"),
        ({"throttle_max": 1.2}, "throttle_max 1.2"),
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


def test_without_a_rudder_nothing_is_commanded_to_it() -> None:
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


SEA_LEVEL_DENSITY_KG_M3 = 1.225
G_M_S2 = 9.80665


def aerosonde() -> FixedWingParameters:
    return FixedWingParameters.for_envelope(AEROSONDE)


def test_roll_rate_loop_is_four_times_as_quick_as_the_roll_angle() -> None:
    """p = K a / (tau s + 1): the feed-forward inverts K, and (1 + K P) / tau is the loop's bandwidth."""
    sluggish = replace(AEROSONDE, roll_time_constant_s=0.3)
    gains = FixedWingParameters.for_envelope(sluggish)
    assert gains.roll_time_constant_s == pytest.approx(2.0 * 0.3)
    bandwidth = (1.0 + sluggish.roll_rate_per_aileron_rad_s * gains.rate_roll_p) / 0.3
    assert bandwidth * gains.roll_time_constant_s == pytest.approx(4.0)
    assert gains.rate_roll_ff * sluggish.roll_rate_per_aileron_rad_s == pytest.approx(1.0)
    assert gains.rate_roll_i * sluggish.roll_rate_per_aileron_rad_s == pytest.approx(1.0)
    # a roll that damps itself quickly gets the least gain
    assert pytest.approx(0.2) == aerosonde().rate_roll_p * AEROSONDE.roll_rate_per_aileron_rad_s
    # and a wing whose roll hardly damps itself is not waited for
    assert FixedWingParameters.for_envelope(
        replace(AEROSONDE, roll_time_constant_s=2.0)
    ).roll_time_constant_s == pytest.approx(1.2)


def test_roll_rate_limit_is_what_span_and_ailerons_allow() -> None:
    assert pytest.approx(min(2.6 / math.sqrt(2.8956), 0.6 * 3.03)) == aerosonde().roll_rate_max_rad_s
    weak = FixedWingParameters.for_envelope(replace(AEROSONDE, roll_rate_per_aileron_rad_s=1.0))
    assert weak.roll_rate_max_rad_s == pytest.approx(0.6)
    # 1.2 times the time in which the bank of a turn is rolled out
    slow = FixedWingParameters.for_envelope(
        replace(AEROSONDE, roll_rate_per_aileron_rad_s=0.5, bank_max_rad=1.0)
    )
    assert slow.heading_p_1_s == pytest.approx(1.2 * 0.3 / 1.0)
    assert aerosonde().heading_p_1_s == 0.8885
    assert pytest.approx(
        min(math.radians(90.0), aerosonde().roll_rate_max_rad_s, 0.6 / aerosonde().roll_time_constant_s)
    ) == (aerosonde().roll_slew_rad_s)


@pytest.mark.parametrize(("damping", "closed"), [(0.2, 0.8), (0.7, 0.7 + 0.45)])
def test_pitch_rate_loop_adds_the_damping_that_the_short_period_lacks(damping: float, closed: float) -> None:
    """s^2 + 2 D w s + w^2: a moment against the pitch rate adds to 2 D w; at least 0.9 w is added."""
    envelope = replace(AEROSONDE, short_period_damping=damping)
    gains = FixedWingParameters.for_envelope(envelope)
    natural = envelope.short_period_frequency_rad_s
    added = gains.rate_pitch_p * envelope.pitch_acceleration_per_elevator_rad_s2
    assert damping + added / (2.0 * natural) == pytest.approx(closed)
    assert gains.rate_pitch_ff * envelope.pitch_rate_per_elevator_rad_s == pytest.approx(0.6)
    assert gains.rate_pitch_i == gains.rate_pitch_ff


def test_pitch_angle_waits_for_the_short_period() -> None:
    slow = FixedWingParameters.for_envelope(replace(AEROSONDE, short_period_frequency_rad_s=4.0))
    assert slow.pitch_time_constant_s == pytest.approx(2.5 / 4.0)
    quick = FixedWingParameters.for_envelope(replace(AEROSONDE, short_period_frequency_rad_s=40.0))
    assert quick.pitch_time_constant_s == 0.25
    assert pytest.approx(0.6 * 0.99) == aerosonde().pitch_rate_max_up_rad_s
    assert aerosonde().pitch_rate_max_up_rad_s == aerosonde().pitch_rate_max_down_rad_s
    agile = FixedWingParameters.for_envelope(replace(AEROSONDE, pitch_rate_per_elevator_rad_s=9.0))
    assert agile.pitch_rate_max_up_rad_s == pytest.approx(math.radians(60.0))


@pytest.mark.parametrize(("damping", "added"), [(0.22, 2.0 * (0.6 - 0.22) * 4.4), (0.9, 0.5)])
def test_yaw_damper_adds_what_the_dutch_roll_lacks(damping: float, added: float) -> None:
    envelope = replace(AEROSONDE, dutch_roll_damping=damping)
    gains = FixedWingParameters.for_envelope(envelope)
    assert gains.rate_yaw_p * envelope.yaw_acceleration_per_rudder_rad_s2 == pytest.approx(added)
    assert gains.rate_yaw_i == pytest.approx(2.0 * gains.rate_yaw_p)
    assert gains.rate_yaw_ff == 0.0


@pytest.mark.parametrize("sideslip_per_rudder", [-0.55, 0.55, 0.01])
def test_sideslip_loop_closes_with_its_bandwidth(sideslip_per_rudder: float) -> None:
    """Lateral acceleration -> yaw rate -> integrating rudder -> sideslip -> lateral acceleration: an
    integrator of that bandwidth, 0.8 rad/s."""
    gains = FixedWingParameters.for_envelope(replace(AEROSONDE, sideslip_per_rudder_rad=sideslip_per_rudder))
    pressure_pa = 0.5 * SEA_LEVEL_DENSITY_KG_M3 * 25.0**2
    side_m_s2 = pressure_pa * 0.55 * 0.7 / 11.0 * max(0.05, abs(sideslip_per_rudder))
    assert gains.sideslip_gain_rad_s_per_m_s2 * gains.rate_yaw_i * side_m_s2 == pytest.approx(0.8)


def test_extra_drag_of_a_turn_is_that_of_its_lift() -> None:
    """Induced drag, C_L^2 / (pi e A), grows with the square of the load factor; at 1.2 the linear law of
    the energy control has its slope, and near its value."""
    lift_n = 11.0 * G_M_S2
    pressure_pa = 0.5 * SEA_LEVEL_DENSITY_KG_M3 * 25.0**2
    aspect_ratio = 2.8956**2 / 0.55

    def induced_power_per_mass(load_factor: float) -> float:
        coefficient = load_factor * lift_n / (pressure_pa * 0.55)
        drag_n = pressure_pa * 0.55 * coefficient**2 / (math.pi * 0.85 * aspect_ratio)
        return drag_n * 25.0 / 11.0

    extra = induced_power_per_mass(1.2) - induced_power_per_mass(1.0)
    assert extra == pytest.approx(aerosonde().turn_energy_rate_m2_s3 * 0.2, rel=1e-3)
    assert pytest.approx(lift_n / (pressure_pa * 0.55) / 5.61) == aerosonde().lift_angle_rad


def test_height_and_airspeed_wait_for_the_pitch_angle() -> None:
    for frequency in (2.0, 10.9, 60.0):
        gains = FixedWingParameters.for_envelope(replace(AEROSONDE, short_period_frequency_rad_s=frequency))
        pitch_s = gains.pitch_time_constant_s
        assert gains.height_time_constant_s == pytest.approx(max(1.5, 6.0 * pitch_s))
        assert gains.airspeed_time_constant_s == pytest.approx(max(1.0, 4.0 * pitch_s))
        assert gains.energy_rate_time_constant_s == pytest.approx(max(0.2, 0.8 * pitch_s))
        assert gains.height_acceleration_m_s2 == pytest.approx(min(1.5, 0.4 / pitch_s))
        assert gains.pitch_integral_1_s * gains.height_time_constant_s == pytest.approx(0.45)
        assert gains.throttle_damping * gains.airspeed_time_constant_s == pytest.approx(0.9)
        assert gains.throttle_integral_1_s * gains.airspeed_time_constant_s == pytest.approx(0.24)


@pytest.mark.parametrize(
    ("changes", "climb", "sink_min", "sink_max", "climb_target", "sink_target"),
    [
        ({}, 5.3, 7.5, 9.0, 0.6 * 5.3, 0.8 * 5.3),
        ({"climb_max_m_s": 9.0}, 9.0, 7.5, 9.0, 5.4, 0.6 * 9.0),
        ({"climb_max_m_s": 0.1}, 0.5, 7.5, 9.0, 0.3, 0.4),
        ({"sink_min_m_s": 0.05, "sink_max_m_s": 0.1}, 5.3, 0.2, 0.24, 0.6 * 5.3, 0.6 * 0.24),
        ({"powered": False, "sink_min_m_s": 1.0}, 1.0, 1.0, 9.0, 0.6, 1.0),
    ],
)
def test_climb_and_sink_are_the_envelopes(
    changes: dict[str, float],
    climb: float,
    sink_min: float,
    sink_max: float,
    climb_target: float,
    sink_target: float,
) -> None:
    gains = FixedWingParameters.for_envelope(replace(AEROSONDE, **changes))  # type: ignore[arg-type]
    assert gains.climb_max_m_s == pytest.approx(climb)
    assert gains.sink_min_m_s == pytest.approx(sink_min)
    assert gains.sink_max_m_s == pytest.approx(sink_max)
    assert gains.climb_rate_target_m_s == pytest.approx(climb_target)
    assert gains.sink_rate_target_m_s == pytest.approx(sink_target)


def test_limits_of_the_envelope_are_flown() -> None:
    assert aerosonde().roll_limit_rad == AEROSONDE.bank_max_rad
    assert (aerosonde().pitch_min_rad, aerosonde().pitch_max_rad) == (
        AEROSONDE.pitch_min_rad,
        AEROSONDE.pitch_max_rad,
    )
    assert aerosonde().load_factor_max == 2.5
    steep = FixedWingParameters.for_envelope(replace(AEROSONDE, bank_max_rad=math.radians(75.0)))
    assert steep.load_factor_max == pytest.approx(1.0 / math.cos(math.radians(75.0)))
    assert (aerosonde().airspeed_stall_m_s, aerosonde().airspeed_min_m_s, aerosonde().airspeed_max_m_s) == (
        13.5,
        18.0,
        33.0,
    )
    assert (
        aerosonde().trim_throttle,
        aerosonde().trim_throttle_min_speed,
        aerosonde().trim_throttle_max_speed,
    ) == (0.795, 0.596, 1.0)
    assert aerosonde().trim_elevator == AEROSONDE.trim_elevator
    assert aerosonde().trim_pitch_rad == AEROSONDE.trim_pitch_rad
    glider = FixedWingParameters.for_envelope(replace(AEROSONDE, powered=False, throttle_max=0.4))
    assert glider.throttle_max == 1.0
    assert FixedWingParameters.for_envelope(replace(AEROSONDE, throttle_max=0.4)).throttle_max == 0.4


@pytest.mark.parametrize("rate_hz", [50.0, 4000.0])
def test_controller_takes_the_ends_of_its_rates(rate_hz: float) -> None:
    FixedWingController(physics_rate_hz=rate_hz, nav=np.zeros(NAV_SIZE))
    for beyond in (49.9, 4000.1):
        with pytest.raises(ValueError, match="physics_rate_hz"):
            FixedWingController(physics_rate_hz=beyond, nav=np.zeros(NAV_SIZE))
