"""`AttitudeEstimator`: messages in, outcomes and estimates out."""

import math

import pytest

from estimators.attitude import AttitudeEstimator, AttitudeParameters
from estimators.attitude.air import AirData, pressure_pa, true_over_equivalent
from estimators.attitude.parameters import AirspeedSource
from estimators.interface import Outcome
from flightsim.foundation.vectors import conjugate, from_euler, rotate
from tests.estimators.attitude.made import G, down_of, heartbeat, highres, made, scaled

ROLL, PITCH = 0.3, -0.2
FORCE = tuple(-G * down_of(ROLL, PITCH))
STEP_US = 20_000


def started(**parameters):
    """A fixed wing's filter, with one second of samples at a tilt and no airspeed."""
    found = AttitudeEstimator(AttitudeParameters(**({"vehicle": "fixed_wing"} | parameters)))
    for k in range(51):
        assert found.handle(k * STEP_US, highres(k * STEP_US, force=FORCE)) is Outcome.UPDATED
    return found


def newest(found):
    (estimate,) = found.estimates
    return estimate


# the board's trim


def board_frame(vector, roll, pitch):
    """A vector of the vehicle's frame in that of a board that is turned by roll and pitch in the vehicle."""
    return rotate(conjugate(from_euler(roll, pitch, 0.0)), vector)


@pytest.mark.parametrize("given", [False, True])
def test_the_boards_trim_is_corrected(given):
    """At rest with tilt, on a board that is turned by 3 and -2 degrees: the vehicle's attitude comes out."""
    trim = math.radians(3.0), math.radians(-2.0)
    settings = {"trim_roll_rad": trim[0], "trim_pitch_rad": trim[1]} if given else {}
    found = AttitudeEstimator(AttitudeParameters(vehicle="fixed_wing", **settings))
    for name, value in zip(("AHRS_TRIM_X", "AHRS_TRIM_Y"), trim, strict=True):
        parameter = made("PARAM_VALUE", param_id=name, param_value=0.1 if given else value)
        assert found.handle(0, parameter) is Outcome.USED
    force = board_frame(FORCE, *trim)
    for k in range(51):
        found.handle(k * STEP_US, highres(k * STEP_US, force=force))
    assert (newest(found).roll_rad, newest(found).pitch_rad) == pytest.approx((ROLL, PITCH), abs=1e-6)
    assert "roll +3.00 deg, pitch -2.00 deg" in found.remarks()["note"]  # type: ignore[operator]


@pytest.mark.parametrize(
    ("name", "value"), [("AHRS_TRIM_X", math.nan), ("AHRS_TRIM_X", 1.0), ("AHRS_EKF_TYPE", 0.1)]
)
def test_what_is_no_trim(name, value):
    found = started()
    before = newest(found)
    assert found.handle(STEP_US, made("PARAM_VALUE", param_id=name, param_value=value)) is Outcome.IGNORED
    assert newest(found) == before and "note" not in found.remarks()


# what it waits for


def test_auto_waits_for_the_kind_of_vehicle():
    found = AttitudeEstimator()
    assert found.handle(0, highres(0)) is Outcome.WAITING
    assert found.estimates == ()
    assert found.publish() == ()
    assert found.handle(0, heartbeat(kind=6)) is Outcome.IGNORED  # a ground station
    assert found.handle(0, heartbeat(kind=1, component=100)) is Outcome.IGNORED  # a camera
    assert found.handle(STEP_US, highres(STEP_US)) is Outcome.WAITING
    assert found.handle(STEP_US, heartbeat(kind=2)) is Outcome.USED
    assert found.handle(2 * STEP_US, highres(2 * STEP_US)) is Outcome.UPDATED
    assert found.remarks()["form"] == "multirotor"


@pytest.mark.parametrize(
    ("kind", "form"),
    [(1, "fixed wing"), (2, "multirotor"), (14, "multirotor"), (21, "fixed wing"), (10, "still")],
)
def test_form_by_type(kind, form):
    found = AttitudeEstimator()
    found.handle(0, heartbeat(kind=kind))
    assert found.remarks()["form"] == form


def test_needs():
    inertial, kind, air, trim = AttitudeEstimator().needs
    assert trim.optional and trim.messages == ("PARAM_VALUE",)
    assert inertial.rate_hz == 20.0
    assert inertial.messages[0] == "HIGHRES_IMU"
    assert not kind.optional
    assert air.optional
    inertial, kind, air, _ = AttitudeEstimator(AttitudeParameters(vehicle="fixed_wing", imu="RAW_IMU")).needs
    assert inertial.messages == ("RAW_IMU",)
    assert kind.optional
    assert not air.optional


# samples


def test_roll_and_pitch_of_rest():
    estimate = newest(started())
    assert (estimate.roll_rad, estimate.pitch_rad) == pytest.approx((ROLL, PITCH), abs=1e-6)
    assert estimate.time_us == 50 * STEP_US
    assert estimate.subject == 1
    assert len(estimate.row()) == len(estimate.COLUMNS)
    assert math.isnan(estimate.alpha_rad)


@pytest.mark.parametrize("name", ["RAW_IMU", "SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3"])
def test_units_of_the_scaled_messages(name):
    """Milli-g and milliradians per second, quantised."""
    found = AttitudeEstimator(AttitudeParameters(vehicle="fixed_wing", imu=name))
    for k in range(51):
        assert found.handle(k * STEP_US, scaled(name, k * STEP_US, force=FORCE)) is Outcome.UPDATED
    estimate = newest(found)
    assert (estimate.roll_rad, estimate.pitch_rad) == pytest.approx((ROLL, PITCH), abs=1e-3)
    rate = math.radians(50.0)
    for k in range(51, 61):
        found.handle(k * STEP_US, scaled(name, k * STEP_US, rate=(rate, 0.0, 0.0), force=FORCE))
    # The first of the ten intervals counts half: the mean of its two rates.
    assert newest(found).roll_rad == pytest.approx(ROLL + rate * 9.5 * 0.02, abs=0.02)


def test_other_inertial_messages_are_ignored_when_one_is_named():
    found = started(imu="HIGHRES_IMU")
    assert found.handle(2_000_000, scaled("RAW_IMU", 2_000_000)) is Outcome.IGNORED


def test_the_best_of_several_is_taken():
    """RAW_IMU first; HIGHRES_IMU takes over once it is seen to be fast enough, and gives way when it ends."""
    found = AttitudeEstimator(AttitudeParameters(vehicle="fixed_wing"))
    for k in range(10):
        assert found.handle(k * STEP_US, scaled("RAW_IMU", k * STEP_US)) is Outcome.UPDATED
    assert found.handle(200_000, highres(200_000)) is Outcome.IGNORED
    assert found.handle(220_000, highres(220_000)) is Outcome.UPDATED
    assert found.handle(240_000, scaled("RAW_IMU", 240_000)) is Outcome.IGNORED
    assert found.remarks()["imu"] == "HIGHRES_IMU"
    assert found.handle(600_000, scaled("RAW_IMU", 600_000)) is Outcome.UPDATED


def test_a_slow_better_message_does_not_take_over():
    found = AttitudeEstimator(AttitudeParameters(vehicle="fixed_wing"))
    for k in range(100):
        found.handle(k * STEP_US, scaled("RAW_IMU", k * STEP_US))
        if k % 25 == 0:
            assert found.handle(k * STEP_US, highres(k * STEP_US)) is Outcome.IGNORED
    assert found.remarks()["imu"] == "RAW_IMU"


@pytest.mark.parametrize("name", ["HIGHRES_IMU", "RAW_IMU"])
def test_instance(name):
    found = AttitudeEstimator(AttitudeParameters(vehicle="fixed_wing", imu=name, imu_instance=1))
    make = highres if name == "HIGHRES_IMU" else lambda t, **values: scaled("RAW_IMU", t, **values)
    assert found.handle(0, make(0, id=0)) is Outcome.IGNORED
    assert found.handle(0, make(0, id=1)) is Outcome.UPDATED


def test_fields_that_are_not_new():
    found = started()
    assert found.handle(2_000_000, highres(2_000_000, fields_updated=7)) is Outcome.IGNORED
    assert found.handle(2_000_000, highres(2_000_000, fields_updated=0)) is Outcome.UPDATED


# guards


@pytest.mark.parametrize(
    ("time_us", "values", "outcome"),
    [
        (1_020_000, {"force": (math.nan, 0.0, -G)}, Outcome.NOT_FINITE),
        (1_020_000, {"rate": (0.0, math.inf, 0.0)}, Outcome.NOT_FINITE),
        (1_000_000, {"force": FORCE}, Outcome.REPEATED),
        (1_000_000, {"force": (0.0, 0.0, -G)}, Outcome.REPEATED),
        (980_000, {"force": FORCE}, Outcome.LATE),
        (1_020_000, {"rate": (90.0, 0.0, 0.0)}, Outcome.IMPLAUSIBLE),
        (1_020_000, {"force": (0.0, 0.0, 0.0)}, Outcome.IMPLAUSIBLE),
    ],
)
def test_what_is_no_sample_changes_nothing(time_us, values, outcome):
    found = started()
    before = newest(found)
    assert found.handle(time_us, highres(time_us, **values)) is outcome
    assert newest(found) == before
    assert found.handle(1_040_000, highres(1_040_000, force=FORCE)) is Outcome.UPDATED
    assert newest(found).roll_rad == pytest.approx(ROLL, abs=1e-6)


@pytest.mark.parametrize("time_us", [10_000_000, 1])
def test_jumps_of_time_start_anew(time_us):
    """A gap of nine seconds, or another boot."""
    found = started()
    for k in range(51, 100):
        found.handle(k * STEP_US, highres(k * STEP_US, force=FORCE))
    assert found.handle(time_us, highres(time_us)) is Outcome.TIME_JUMP
    estimate = newest(found)
    assert (estimate.time_us, estimate.roll_rad) == (time_us, 0.0)


def test_nothing_is_integrated_across_samples_of_no_use():
    """The sensor sends, but nothing that could be, for longer than can be bridged."""
    found = started()
    for k in range(51, 500):
        assert found.handle(k * STEP_US, highres(k * STEP_US, force=(0.0, 0.0, -9e9))) is Outcome.IMPLAUSIBLE
    assert found.handle(500 * STEP_US, highres(500 * STEP_US)) is Outcome.UPDATED
    estimate = newest(found)
    assert (estimate.time_us, estimate.roll_rad) == (500 * STEP_US, 0.0)


def test_a_gap_of_one_second_is_bridged():
    found = started()
    assert found.handle(2_000_000, highres(2_000_000, force=FORCE)) is Outcome.UPDATED
    assert newest(found).roll_rad == pytest.approx(ROLL, abs=1e-6)


def test_what_is_not_the_autopilots_is_ignored():
    found = started()
    other = highres(51 * STEP_US)._replace(src_component=191)
    assert found.handle(51 * STEP_US, other) is Outcome.IGNORED


def test_reset_forgets():
    found = AttitudeEstimator()
    found.handle(0, heartbeat(kind=2))
    found.handle(0, highres(0))
    found.reset()
    assert found.estimates == ()
    assert found.handle(0, highres(0)) is Outcome.WAITING


def test_same_messages_same_estimates():
    def run():
        found = AttitudeEstimator()
        rows = []
        found.handle(0, heartbeat(kind=1))
        for k in range(500):
            if k % 5 == 0:
                found.handle(k * STEP_US, made("VFR_HUD", airspeed=15.0 + 0.01 * k, climb=0.5, throttle=60))
            force = (0.3 * math.sin(0.1 * k), 0.1, -G)
            found.handle(
                k * STEP_US, highres(k * STEP_US, rate=(0.1 * math.cos(0.1 * k), 0.0, 0.1), force=force)
            )
            rows.append(newest(found).row())
        return rows

    first = run()
    assert repr(first) == repr(run())


# air


def wing(**parameters):
    found = AttitudeEstimator(AttitudeParameters(vehicle="fixed_wing", **parameters))
    found.handle(0, highres(0))
    return found


def airspeed_after(found, *messages):
    for time_us, message in messages:
        found.handle(time_us, message)
    found.handle(STEP_US, highres(STEP_US))
    return newest(found).airspeed_m_s


def test_airspeed_of_the_hud_becomes_true_airspeed():
    """1500 m of the standard atmosphere: 845.6 hPa, density ratio 0.8637 (ISO 2533)."""
    speed = airspeed_after(
        wing(), (10, made("SCALED_PRESSURE", press_abs=845.6)), (20, made("VFR_HUD", airspeed=20.0))
    )
    assert speed == pytest.approx(20.0 / math.sqrt(0.8637), rel=1e-3)


def test_airspeed_by_pressure_where_no_message_has_it():
    message = made("SCALED_PRESSURE", press_abs=1013.25, press_diff=0.5 * 1.225 * 20.0**2 / 100.0)
    assert airspeed_after(wing(), (10, message)) == pytest.approx(20.0, rel=1e-6)
    assert airspeed_after(wing(), (5, made("VFR_HUD", airspeed=15.0)), (10, message)) == pytest.approx(15.0)
    named = wing(airspeed="pressure")
    assert airspeed_after(named, (5, made("VFR_HUD", airspeed=15.0)), (10, message)) == pytest.approx(20.0)


def test_differential_pressure_of_highres_imu_counts_where_it_is_marked():
    """ArduPilot fills the field with something negative, PX4's simulator leaves it out."""
    hpa = 0.5 * 1.225 * 20.0**2 / 100.0
    found = wing()
    found.handle(STEP_US, highres(STEP_US, diff_pressure=hpa))
    assert math.isnan(newest(found).airspeed_m_s)
    found.handle(2 * STEP_US, highres(2 * STEP_US, diff_pressure=hpa, fields_updated=63 | 1 << 10))
    assert newest(found).airspeed_m_s == pytest.approx(20.0, rel=1e-6)
    found.handle(3 * STEP_US, highres(3 * STEP_US, diff_pressure=-80.0, fields_updated=65535))
    assert newest(found).airspeed_m_s == pytest.approx(20.0, rel=1e-6)


def test_differential_pressure_of_highres_imu_in_pascal():
    """PX4 1.16.1 fills both pressures of HIGHRES_IMU in pascal; seen: 95617 and 281 at 21 m/s."""
    found = wing(airspeed="pressure")
    marked = {"fields_updated": 8191, "abs_pressure": 101_325.0, "diff_pressure": 0.5 * 1.225 * 20.0**2}
    found.handle(STEP_US, highres(STEP_US, **marked))
    assert newest(found).airspeed_m_s == pytest.approx(20.0, rel=1e-6)


def test_old_airspeed_is_not_used():
    found = wing()
    found.handle(10, made("VFR_HUD", airspeed=20.0))
    for k in range(1, 200):
        found.handle(k * STEP_US, highres(k * STEP_US))
    assert math.isnan(newest(found).airspeed_m_s)


def test_angle_of_attack_is_reported_in_flight():
    found = wing()
    for k in range(1, 500):
        if k % 5 == 0:
            found.handle(k * STEP_US, made("VFR_HUD", airspeed=20.0, throttle=50))
        found.handle(k * STEP_US, highres(k * STEP_US))
    assert abs(newest(found).alpha_rad) < math.radians(1.0)
    assert newest(found).airspeed_m_s == pytest.approx(20.0)
    assert {"lift_1_m", "alpha_mean_rad"} <= found.remarks().keys()


@pytest.mark.parametrize(
    ("field", "pascal"), [(1013.25, 101_325.0), (95_427.9, 95_427.9), (0.0, None), (5.0, None)]
)
def test_pressure_in_hectopascal_or_as_px4_fills_it(field, pascal):
    assert pressure_pa(field) == (None if pascal is None else pytest.approx(pascal))


@pytest.mark.parametrize(
    ("height_m", "pressure", "density"), [(0.0, 101325.0, 1.225), (3000.0, 70108.5, 0.909122)]
)
def test_true_airspeed_by_the_standard_atmosphere(height_m, pressure, density):
    """Authority: the table of ISO 2533."""
    assert true_over_equivalent(pressure) == pytest.approx(math.sqrt(1.225 / density), rel=2e-4)


def test_airspeed_source_goes_over_to_the_next_when_one_ends():
    air = AirData(AirspeedSource.AUTO, 3_000_000)
    assert air.airspeed(0, AirspeedSource.AIRSPEED, 10.0) == 10.0
    assert air.airspeed(0, AirspeedSource.VFR_HUD, 11.0) == 11.0
    assert air.airspeed(1, AirspeedSource.AIRSPEED, 10.0) is None
    assert air.airspeed(3_000_002, AirspeedSource.AIRSPEED, 10.0) == 10.0
    assert air.airspeed(4_000_000, AirspeedSource.VFR_HUD, math.nan) is None
    assert air.airspeed(4_000_000, AirspeedSource.VFR_HUD, 0.0) is None


# what it tells


def test_publishes_attitude_without_yaw():
    found = started()
    found.handle(51 * STEP_US, highres(51 * STEP_US, rate=(0.1, 0.2, 0.3), force=FORCE))
    (message,) = found.publish()
    assert message.get_type() == "ATTITUDE"
    assert message.time_boot_ms == 1020
    estimate = newest(found)
    assert (message.roll, message.pitch) == (estimate.roll_rad, estimate.pitch_rad)
    assert math.isnan(message.yaw)
    assert (message.rollspeed, message.pitchspeed, message.yawspeed) == pytest.approx(
        (0.1, 0.2, 0.3), abs=1e-3
    )


# parameters


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("gain_1_s", -1.0),
        ("gain_1_s", math.nan),
        ("vehicle", "rover"),
        ("imu", "HIL_SENSOR"),
        ("airspeed", "gps"),
        ("imu_instance", 300),
        ("lift_1_m", 0.0),
        ("gap_max_s", math.inf),
    ],
)
def test_wrong_parameters_are_named(name, value):
    with pytest.raises(ValueError, match=name):
        AttitudeParameters(**{name: value})


def test_some_parameters_may_be_infinite():
    AttitudeParameters(side_force_ratio_1_rad=math.inf, drag_learning_m_s=math.inf, climb_time_s=math.inf)
