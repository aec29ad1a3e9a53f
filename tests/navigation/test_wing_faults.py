"""What a fixed wing's filter does when pitot tube, GPS or magnetometer fail or are missing, and at launch."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from autopilot_bridge.navigation import NavigationFilter, NavigationParameters, layout
from autopilot_bridge.navigation import states as s
from flightsim import truth as t
from flightsim.interface import SensorReadings
from flightsim.sensors.fault_kinds import FaultType, SensorUnit
from flightsim.sensors.suite import SensorSuiteParameters
from tests.navigation.bench import PARAMETERS, Bench
from tests.navigation.kinematic_flight import fly
from tests.navigation.kinematic_wing import Wing
from tests.navigation.wing_bench import WING_PARAMETERS, WING_SENSORS, WingBench

GOLDEN = [
    0.9940996168180207,
    -0.05061888949222802,
    0.05334939569391911,
    -0.07973406955581708,
    0.013745329716521388,
    -0.1161114397926442,
    -0.14208044784718737,
    -11.922456644274822,
    0.9858833394087131,
    0.8468081223550844,
    12.409082857685261,
    39.482340898527454,
    -11.92656862569805,
]
GOLDEN_TRACE = 0.07172083521376177
ORBIT = Wing(turns=((40.0, 1000.0, 9.5),))


def when(bench: WingBench, condition: Callable[[], bool], until_s: float) -> float:
    """Run until the condition holds; the time."""
    while not condition():
        assert bench.time_s < until_s, f"not before {until_s} s"
        bench.run(bench.time_s + 0.1)
    return bench.time_s


# pitot tube


@pytest.mark.parametrize(
    ("failure", "options"),
    [
        (FaultType.WRONG, {"blocked": True}),
        (FaultType.OFF, {}),
        (FaultType.STUCK, {}),
        (FaultType.GARBAGE, {}),
        (FaultType.WRONG, {"bias": (300.0, 0.0)}),
    ],
    ids=["blocked", "off", "stuck", "garbage", "wrong"],
)
@pytest.mark.sampled(2)
def test_a_failed_pitot_tube_is_found_and_replaced(failure: FaultType, options: dict[str, object]) -> None:
    bench = WingBench(ORBIT, 110.0).run(60.0)
    health, state = bench.filter.health, bench.filter.state
    assert health.airspeed_valid and not health.airspeed_synthetic
    wind = bench.wind_error()
    bench.suite.faults.inject(SensorUnit.AIRSPEED, failure, **options)  # type: ignore[arg-type]
    found_s = when(bench, lambda: not health.airspeed_valid, 66.0)
    assert found_s - 60.0 < 4.5
    assert health.airspeed_synthetic
    bench.run(found_s + 2.0)
    worst = 0.0
    while bench.time_s < 80.0:
        bench.run(bench.time_s + 0.5)
        assert health.airspeed_synthetic and health.position_horizontal_absolute
        worst = max(worst, abs(state[layout.AIRSPEED_TRUE_M_S] - bench.truth[t.AIRSPEED_TRUE_M_S]))
    assert worst < 4.0  # gusts of 1 m/s and the wind's error
    assert np.hypot(*(bench.wind_error() - wind)) < 0.8
    assert bench.tilt_deg < 0.5 and bench.position_error_m < 0.6
    bench.suite.faults.clear(SensorUnit.AIRSPEED)
    back_s = when(bench, lambda: health.airspeed_valid, 90.0)
    assert WING_PARAMETERS.airspeed_start_delay_s - 0.5 <= back_s - 80.0 < 8.0
    assert not health.airspeed_synthetic
    bench.run(105.0)
    assert state[layout.AIRSPEED_TRUE_M_S] == pytest.approx(bench.truth[t.AIRSPEED_TRUE_M_S], abs=1.0)


def test_checks_can_be_switched_off() -> None:
    bench = WingBench(ORBIT, 80.0, parameters=replace(WING_PARAMETERS, airspeed_checks=False)).run(60.0)
    bench.suite.faults.inject(SensorUnit.AIRSPEED, FaultType.WRONG, bias=(300.0, 0.0))
    bench.run(70.0)
    health = bench.filter.health
    assert health.airspeed_valid and health.airspeed_test_ratio > 1.0  # shown, but gated out
    assert not health.airspeed_in_use and bench.tilt_deg < 0.5


def test_pitot_tube_and_gps_lost_together() -> None:
    """The airspeed is taken to have stayed what it was: no position, but level stays level in a turn."""
    bench = WingBench(ORBIT, 240.0).run(80.0)
    health = bench.filter.health
    bench.suite.faults.inject(SensorUnit.GPS, FaultType.OFF)
    bench.run(90.0)
    bench.suite.faults.inject(SensorUnit.AIRSPEED, FaultType.WRONG, blocked=True)
    lost_s = when(bench, lambda: not health.position_horizontal_absolute, 100.0)
    assert lost_s - 90.0 == pytest.approx(WING_PARAMETERS.no_aid_timeout_s, abs=1.0)
    bench.run(lost_s + 0.5)
    assert health.constant_position and not health.velocity_horizontal and not health.dead_reckoning
    tilt = []
    while bench.time_s < 180.0:
        bench.run(bench.time_s + 1.0)
        tilt.append(bench.tilt_deg)
    assert max(tilt) < 1.5 and health.attitude
    assert bench.filter.state[layout.AIRSPEED_M_S] == pytest.approx(24.0, abs=4.0)
    bench.suite.faults.clear(SensorUnit.AIRSPEED)
    when(bench, lambda: health.wind_dead_reckoning, 195.0)
    assert health.position_horizontal_absolute and not health.constant_position
    assert bench.position_error_m < 3.0 * health.position_horizontal_accuracy_m
    bench.run(200.0)
    bench.suite.faults.clear(SensorUnit.GPS)
    bench.run(206.0)
    assert bench.position_error_m < 1.0 and health.filter_resets == 0


def test_no_pitot_tube_at_all() -> None:
    """Sideslip alone finds the wind, in turns."""
    bench = WingBench(ORBIT, 120.0, sensors=replace(WING_SENSORS, airspeed=None)).run(110.0)
    health, state = bench.filter.health, bench.filter.state
    assert health.airspeed_synthetic and not health.airspeed_valid
    assert health.wind_valid and np.hypot(*bench.wind_error()) < 2.0
    assert state[layout.AIRSPEED_TRUE_M_S] == pytest.approx(bench.truth[t.AIRSPEED_TRUE_M_S], abs=3.0)
    assert bench.tilt_deg < 0.5


def test_use_airspeed_off_ignores_the_tube() -> None:
    parameters = replace(WING_PARAMETERS, use_airspeed=False)
    with_tube = WingBench(ORBIT, 60.0, parameters=parameters).run(60.0)
    assert with_tube.filter.health.airspeed_synthetic and not with_tube.filter.health.airspeed_in_use


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e300, -1e300, -50.0])
def test_nonsense_of_the_pitot_tube(bad: float) -> None:
    bench = WingBench(Wing(), 40.0)
    reading = bench.suite.readings.airspeed
    suite_step = bench.suite.step

    class Suite:
        def step(self, time_us: int) -> None:
            suite_step(time_us)
            if 20e6 < time_us < 30e6:
                reading.values[:] = bad

    bench.suite = Suite()  # type: ignore[assignment]
    bench.run(28.0)
    assert not bench.filter.health.airspeed_valid
    bench.run(40.0)
    assert bench.filter.health.airspeed_valid and bench.filter.health.filter_resets == 0
    assert np.isfinite(bench.filter.state[:28]).all() and bench.tilt_deg < 0.5


# GPS


def test_gps_lost_and_back() -> None:
    bench = WingBench(ORBIT, 190.0).run(70.0)
    nav, health = bench.filter, bench.filter.health
    bench.suite.faults.inject(SensorUnit.GPS, FaultType.OFF)
    bench.run(72.5)
    assert health.dead_reckoning and health.wind_dead_reckoning and not health.gps_in_use
    early = health.position_horizontal_accuracy_m
    bench.run(170.0)
    assert health.position_horizontal_absolute and health.velocity_horizontal
    assert not health.constant_position
    assert health.position_horizontal_accuracy_m > 10.0 * early
    assert health.time_since_gps_us > 99_000_000
    assert bench.position_error_m < 3.0 * health.position_horizontal_accuracy_m
    bench.suite.faults.clear(SensorUnit.GPS)
    resets = health.position_resets
    previous = nav.state[:13].copy()
    steps: list[tuple[float, float, float]] = []

    def watch() -> None:
        change = nav.state[:13] - previous
        steps.append(
            (np.hypot(*change[10:12]), np.hypot(*change[7:9]), 2.0 * float(np.linalg.norm(change[1:4])))
        )
        previous[:] = nav.state[:13]

    bench.run(175.0, each=watch)
    assert health.position_resets == resets + 1 == 2
    biggest = np.array(steps).max(axis=0)
    assert math.hypot(*health.position_reset_ne_m) == pytest.approx(biggest[0], abs=0.2)
    assert biggest[1] < 2.0 and np.degrees(biggest[2]) < 1.0  # velocity and attitude hardly notice
    assert bench.position_error_m < 0.6 and not health.dead_reckoning
    assert health.yaw_resets == 0 and health.filter_resets == 0


def test_a_receiver_that_returns_far_off_is_refused_first() -> None:
    bench = WingBench(ORBIT, 110.0).run(70.0)
    health = bench.filter.health
    bench.suite.faults.inject(SensorUnit.GPS, FaultType.OFF)
    bench.run(90.0)
    bench.suite.faults.inject(SensorUnit.GPS, FaultType.WRONG, bias=(500.0, 0.0, 0.0))
    bench.run(96.0)
    assert bench.position_error_m < 20.0
    bench.run(101.0)  # PX4 accepts it in the end
    assert bench.position_error_m == pytest.approx(500.0, abs=5.0)
    assert math.hypot(*health.position_reset_ne_m) > 400.0


def test_launch_without_gps() -> None:
    """Relative position only, and an attitude as good as ever."""
    bench = WingBench(Wing(turns=((30.0, 60.0, 9.0),)), 90.0, sensors=replace(WING_SENSORS, gps=None))
    tilt = []
    bench.run(9.0)
    while bench.time_s < 90.0:
        bench.run(bench.time_s + 1.0)
        tilt.append(bench.tilt_deg)
    health = bench.filter.health
    assert max(tilt) < 1.0
    assert health.position_horizontal_relative and not health.position_horizontal_absolute
    assert health.wind_dead_reckoning and bench.filter.origin is None


# magnetometer


def test_no_magnetometer_course_gives_the_heading() -> None:
    bench = WingBench(ORBIT, 110.0, sensors=replace(WING_SENSORS, magnetometer=None)).run(8.0)
    health = bench.filter.health
    assert not health.yaw_aligned and not health.position_horizontal_absolute
    bench.run(20.0)
    assert health.yaw_aligned and health.position_horizontal_absolute
    bench.run(100.0)
    assert abs(np.degrees(bench.error()[2])) < 1.5 and bench.tilt_deg < 0.5


def test_magnetometer_lost_while_dead_reckoning() -> None:
    bench = WingBench(ORBIT, 200.0).run(70.0)
    bench.suite.faults.inject(SensorUnit.GPS, FaultType.OFF)
    bench.run(90.0)
    bench.suite.faults.inject(SensorUnit.MAG, FaultType.OFF)
    bench.run(200.0)
    error = bench.error()
    assert bench.tilt_deg < 1.0
    assert abs(error[2]) < 3.5 * bench.filter.health.attitude_accuracy_rad[1]


# launch


@pytest.mark.parametrize("late_s", [0.0, 0.2, 6.0])
@pytest.mark.parametrize("push_s", [0.3, 0.8])
def test_catapult(late_s: float, push_s: float) -> None:
    """Three to eight g; the land detector may be late: attitude and velocity stay."""
    bench = WingBench(Wing(push_s=push_s), 20.0, late_s=late_s).run(7.9)
    worst = np.zeros(2)

    def watch() -> None:
        error = bench.error()
        worst[:] = np.maximum(worst, [np.hypot(*error[:2]), np.linalg.norm(error[3:6])])

    bench.run(14.0, each=watch)
    assert np.linalg.norm(bench.truth[t.VEL_NED_M_S]) > 12.0
    assert np.degrees(worst[0]) < 0.8 and worst[1] < 0.7
    health = bench.filter.health
    assert health.filter_resets == 0 and health.position_resets == 1
    assert health.airspeed_in_use and health.sideslip_in_use


def test_estimate_lost_in_flight() -> None:
    """The filter aligns anew on a straight leg and finds its way back to airspeed and sideslip."""
    bench = WingBench(Wing(gust_m_s=(0.3, 0.2)), 120.0).run(50.0)
    bench.filter._solution.p[3, 3] = math.nan
    bench.run(51.0)
    assert bench.filter.health.filter_resets == 1
    bench.run(120.0)
    health = bench.filter.health
    assert health.position_horizontal_absolute and health.sideslip_in_use and health.airspeed_in_use
    assert bench.tilt_deg < 0.6 and bench.position_error_m < 1.0
    assert np.hypot(*bench.wind_error()) < 1.5


def test_no_sideslip_is_assumed_on_the_ground() -> None:
    """A take-off roll in a crosswind: the nose is held by the wheels, not by the air."""
    truth = fly(
        30.0,
        path=lambda time_s: np.stack(
            [np.maximum(time_s - 8.0, 0.0) ** 2, 0.0 * time_s, 0.0 * time_s], axis=-1
        ),
        yaw=lambda time_s: 0.0 * time_s,
    )
    moving = truth[:, 3:6] - [0.0, 5.0, 0.0]
    truth[:, t.AIRSPEED_TRUE_M_S] = np.linalg.norm(moving, axis=1)
    truth[:, t.DYNAMIC_PRESSURE_PA] = 0.5 * truth[:, t.DENSITY_KG_M3] * truth[:, t.AIRSPEED_TRUE_M_S] ** 2
    bench = Bench(truth, sensors=WING_SENSORS, parameters=WING_PARAMETERS).run(20.0)
    health = bench.filter.health
    assert bench.truth[t.AIRSPEED_TRUE_M_S] > 20.0
    assert health.airspeed_in_use and not health.sideslip_in_use


# parameters


def test_a_quadrotor_is_as_it_was() -> None:
    """No wind states, no airspeed, and a pitot tube on board changes no bit."""
    truth = fly(25.0)
    plain = Bench(truth, seed=3).run(25.0)
    tube = Bench(truth, seed=3, sensors=WING_SENSORS).run(25.0)
    assert plain.filter.covariance.shape == (22, 22)
    assert plain.filter.state.tobytes() == tube.filter.state.tobytes()
    assert plain.filter.covariance.tobytes() == tube.filter.covariance.tobytes()
    assert np.isnan(plain.filter.state[[layout.AIRSPEED_M_S, layout.AIRSPEED_TRUE_M_S]]).all()
    assert not (tube.filter.health.airspeed_valid or tube.filter.health.airspeed_synthetic)
    assert math.isnan(tube.filter.health.wind_variance_m2_s2[0])


def test_golden_numbers_of_the_quadrotor() -> None:
    """Recorded before wind states were added, and with a barometer that knows the day."""
    standard_day = replace(PARAMETERS, barometer_scale_error=0.0)
    bench = Bench(fly(25.0), seed=3, parameters=standard_day).run(25.0)
    np.testing.assert_allclose(bench.filter.state[:13], GOLDEN, rtol=0.0, atol=1e-9)
    trace = float(np.trace(bench.filter.covariance))
    assert trace == pytest.approx(GOLDEN_TRACE, rel=1e-9)


def test_kind_of_vehicle_is_fixed_at_boot() -> None:
    nav = NavigationFilter(PARAMETERS, readings=SensorReadings(), physics_rate_hz=250)
    nav.set_parameters(replace(WING_PARAMETERS, airspeed_noise_m_s=0.7))
    assert not nav.parameters.fixed_wing and nav.parameters.airspeed_noise_m_s == 0.7
    assert nav.covariance.shape == (22, 22)
    wing = NavigationFilter(WING_PARAMETERS, readings=SensorReadings(), physics_rate_hz=250)
    assert wing.covariance.shape == (s.ERROR_SIZE_WITH_WIND, s.ERROR_SIZE_WITH_WIND)


def test_tuning_takes_effect_in_flight() -> None:
    bench = WingBench(ORBIT, 70.0).run(60.0)
    bench.filter.set_parameters(replace(WING_PARAMETERS, use_sideslip=False, use_airspeed=False))
    bench.run(62.0)
    health = bench.filter.health
    assert not health.sideslip_in_use and not health.airspeed_in_use and health.airspeed_synthetic
    assert health.wind_valid


@pytest.mark.parametrize(
    ("name", "value"),
    [("airspeed_noise_m_s", 0.0), ("airspeed_scale", -1.0), ("turbulence_length_m", math.inf)],
)
def test_parameters_are_checked(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name):
        NavigationParameters(**{name: value})  # type: ignore[arg-type]


def test_same_inputs_same_bytes() -> None:
    runs = [WingBench(ORBIT, 30.0, seed=seed).run(30.0).filter for seed in (5, 5, 6)]
    assert runs[0].state.tobytes() == runs[1].state.tobytes()
    assert runs[0].covariance.tobytes() == runs[1].covariance.tobytes()
    assert runs[0].state.tobytes() != runs[2].state.tobytes()


def test_sensors_of_the_bench_are_the_defaults_with_a_tube() -> None:
    assert replace(WING_SENSORS, airspeed=None) == SensorSuiteParameters()


@pytest.mark.parametrize("bias", [(0.0, 0.15, 0.0), (0.15, 0.15, 0.0), (0.05, 0.05, 0.0)])
def test_iron_beside_the_launcher(bias: tuple[float, float, float]) -> None:
    """A heading 15 to 45 degrees wrong is found right after the launch, and the magnetometer left out."""
    bench = WingBench(ORBIT, 60.0)
    bench.suite.faults.inject(SensorUnit.MAG, FaultType.WRONG, bias=bias)
    bench.run(8.0)
    assert abs(np.degrees(bench.error()[2])) > 13.0
    bench.run(12.0)
    health = bench.filter.health
    assert health.yaw_resets == 1 and abs(np.degrees(bench.error()[2])) < 6.0
    bench.run(60.0)
    assert not health.magnetometer_in_use and health.yaw_resets == 1 and health.filter_resets == 0
    assert abs(np.degrees(bench.error()[2])) < 2.0 and bench.tilt_deg < 0.6
    assert bench.position_error_m < 0.6


def test_iron_on_board_does_not_turn_a_confirmed_heading() -> None:
    bench = WingBench(ORBIT, 110.0).run(60.0)
    bench.suite.faults.inject(SensorUnit.MAG, FaultType.WRONG, bias=(0.15, 0.15, 0.0))
    bench.run(110.0)
    assert bench.filter.health.yaw_resets == 0 and not bench.filter.health.magnetometer_in_use
    assert abs(np.degrees(bench.error()[2])) < 1.5 and bench.tilt_deg < 0.5
