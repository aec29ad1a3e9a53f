"""EKF2_* and EK3_* parameters reach the filter, in flight at once."""

import math
from dataclasses import fields

import numpy as np
import pytest

from autopilot_bridge.firmware import FLAVOUR_NAMES, get_flavour
from autopilot_bridge.navigation import NavigationParameters
from autopilot_bridge.navigation import fusion as f
from autopilot_bridge.parameters import ParameterStore
from tests.system.flying import Flying

EK3_STEP_S = 0.012  # ArduPilot 4.6.3 predicts at about 83 Hz, PX4 1.16.1 at 100 Hz (EKF2_PREDICT_US)
NOISE = [
    ("px4", "EKF2_GPS_P_NOISE", 1.0, "gps_position_noise_m", (1.0, 1.5)),
    ("px4", "EKF2_GPS_V_NOISE", 0.6, "gps_velocity_noise_m_s", (0.6, 0.9)),
    ("px4", "EKF2_BARO_NOISE", 7.0, "barometer_noise_m", 7.0),
    ("px4", "EKF2_MAG_NOISE", 0.1, "magnetometer_noise_gauss", 0.1),
    ("px4", "EKF2_ACC_NOISE", 0.7, "accel_noise_m_s2_sqrt_hz", 0.07),
    ("px4", "EKF2_GYR_NOISE", 0.03, "gyro_noise_rad_s_sqrt_hz", 0.003),
    ("px4", "EKF2_ACC_B_NOISE", 0.006, "accel_bias_walk_m_s2_sqrt_s", 6e-4),
    ("px4", "EKF2_GYR_B_NOISE", 0.002, "gyro_bias_walk_rad_s_sqrt_s", 2e-4),
    ("px4", "EKF2_GBIAS_INIT", 0.05, "gyro_bias_rad_s", 0.5 * 1.75e-3),
    ("px4", "EKF2_ABIAS_INIT", 0.1, "accel_bias_m_s2", 0.1),
    ("ardupilot", "EK3_POSNE_M_NSE", 1.0, "gps_position_noise_m", (1.0, 1.5)),
    ("ardupilot", "EK3_VELNE_M_NSE", 0.6, "gps_velocity_noise_m_s", (0.6, 0.5)),
    ("ardupilot", "EK3_VELD_M_NSE", 1.0, "gps_velocity_noise_m_s", (0.3, 1.0)),
    ("ardupilot", "EK3_ALT_M_NSE", 4.0, "barometer_noise_m", 4.0),
    ("ardupilot", "EK3_MAG_M_NSE", 0.1, "magnetometer_noise_gauss", 0.1),
    ("ardupilot", "EK3_ACC_P_NSE", 0.7, "accel_noise_m_s2_sqrt_hz", 0.7 * math.sqrt(EK3_STEP_S)),
    ("ardupilot", "EK3_GYRO_P_NSE", 0.03, "gyro_noise_rad_s_sqrt_hz", 0.03 * math.sqrt(EK3_STEP_S)),
    ("ardupilot", "EK3_ABIAS_P_NSE", 0.01, "accel_bias_walk_m_s2_sqrt_s", 0.01 * math.sqrt(EK3_STEP_S)),
    ("ardupilot", "EK3_GBIAS_P_NSE", 5e-4, "gyro_bias_walk_rad_s_sqrt_s", 5e-4 * math.sqrt(EK3_STEP_S)),
    ("ardupilot", "EK3_CHECK_SCALE", 200.0, "gps_required_eph_m", 6.0),
]
GATES = [
    ("px4", "EKF2_GPS_P_GATE", 3.0, f.GATE_GPS),
    ("px4", "EKF2_GPS_V_GATE", 3.0, f.GATE_GPS_VEL),
    ("px4", "EKF2_BARO_GATE", 3.0, f.GATE_BARO),
    ("px4", "EKF2_MAG_GATE", 4.0, f.GATE_MAG),
    ("ardupilot", "EK3_POS_I_GATE", 300.0, f.GATE_GPS),
    ("ardupilot", "EK3_VEL_I_GATE", 300.0, f.GATE_GPS_VEL),
    ("ardupilot", "EK3_HGT_I_GATE", 300.0, f.GATE_BARO),
    ("ardupilot", "EK3_MAG_I_GATE", 400.0, f.GATE_MAG),
]
GPS_SWITCH = {"px4": ("EKF2_GPS_CTRL", 7.0), "ardupilot": ("EK3_SRC1_POSXY", 3.0)}


def test_px4s_defaults_are_the_filters() -> None:
    store = ParameterStore(get_flavour("px4").parameter_definitions(), get_flavour("px4").airframe)
    found, own = get_flavour("px4").navigation_parameters(store), NavigationParameters()
    external = found.external  # odometry from outside is as the firmware has it, and not used
    assert not (external.use_position or external.use_height or external.use_velocity or external.use_yaw)
    for field in fields(NavigationParameters):
        if field.name not in ("external", "mag_ned_gauss"):
            assert getattr(found, field.name) == pytest.approx(getattr(own, field.name), rel=1e-6), field.name


@pytest.mark.parametrize(("flavour", "name", "value", "field", "wanted"), NOISE)
def test_noise_is_what_the_firmware_makes_of_its_parameter(
    flavour: str, name: str, value: float, field: str, wanted: float | tuple[float, ...]
) -> None:
    store = ParameterStore(get_flavour(flavour).parameter_definitions(), {name: value})
    mapped = get_flavour(flavour).navigation_parameters(store)
    assert getattr(mapped, field) == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("flavour", FLAVOUR_NAMES)
def test_new_tuning_takes_effect_at_once_and_the_estimate_stays(flavour: str) -> None:
    flying = Flying(flavour)
    flying.step(8.0)
    autopilot = flying.autopilot
    navigation, obs = autopilot.navigation, autopilot.navigation._solution.obs
    state, covariance = navigation.state.copy(), navigation.covariance.copy()
    for own, name, value, index in GATES:
        if own == flavour:
            autopilot.parameters.set(name, value)
            assert obs[index] == pytest.approx(4.0 if index == f.GATE_MAG else 3.0)
    noisy = {"px4": "EKF2_BARO_NOISE", "ardupilot": "EK3_ALT_M_NSE"}[flavour]
    before = float(obs[f.BARO_VAR])
    autopilot.parameters.set(noisy, 2.0 * autopilot.parameters.get(noisy))
    assert obs[f.BARO_VAR] == pytest.approx(4.0 * before)
    assert np.array_equal(navigation.state, state, equal_nan=True)
    assert np.array_equal(navigation.covariance, covariance)
    flying.step(2.0)
    assert navigation.health.filter_resets == 0


def test_what_a_boot_takes_stays_in_flight_and_other_parameters_leave_the_filter_alone() -> None:
    autopilot = Flying("px4").autopilot
    before = autopilot.navigation.parameters
    autopilot.parameters.set("EKF2_REQ_GPS_H", 10.0)
    autopilot.parameters.set("MPC_XY_CRUISE", 3.0)
    assert autopilot.navigation.parameters is before
    booted = Flying("px4", parameters={"EKF2_REQ_GPS_H": 1.0}).autopilot
    assert booted.navigation.parameters.gps_check_time_s == pytest.approx(2.0)


@pytest.mark.parametrize("flavour", FLAVOUR_NAMES)
@pytest.mark.sampled(1)
def test_gps_fusion_can_be_switched_off_and_on_again(flavour: str) -> None:
    name, on = GPS_SWITCH[flavour]
    flying = Flying(flavour)
    health = flying.autopilot.navigation.health
    flying.step(12.0)
    assert health.position_horizontal_absolute
    flying.autopilot.parameters.set(name, 0.0)
    flying.step(8.0)
    assert not health.position_horizontal_absolute
    assert health.gps_quality
    flying.autopilot.parameters.set(name, on)
    flying.step(3.0)
    assert health.position_horizontal_absolute


@pytest.mark.parametrize("flavour", FLAVOUR_NAMES)
def test_without_gps_fusion_from_boot_there_is_no_position(flavour: str) -> None:
    flying = Flying(flavour, parameters={GPS_SWITCH[flavour][0]: 0.0})
    flying.step(15.0)
    assert not flying.autopilot.navigation.health.position_horizontal_absolute
    assert flying.autopilot.navigation.origin is None
