"""References, interpolation, the part in the air, and statistics of errors, against closed forms."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import dialect
from estimators.airborne import airborne_spans, duration_s, within
from estimators.comparison import comparisons
from estimators.library import estimator_class
from estimators.log_replay import replay
from estimators.logs import open_log, report_of
from estimators.references import Series, error_figures, errors, references
from missions.cli.bodies.log_text import report_lines


def us(*seconds):
    return np.array([round(s * 1e6) for s in seconds], dtype=np.int64)


def test_between_samples_it_is_linear_and_far_from_any_it_is_not_known():
    series = Series("X", us(0.0, 0.2, 0.4, 5.0, 5.2), np.array([0.0, 2.0, 4.0, 50.0, 52.0]), False)
    at = series.at(us(-0.2, -0.05, 0.05, 0.3, 0.45, 2.0, 4.95, 5.0, 5.25, 5.5))
    assert at[2:4].tolist() == pytest.approx([0.5, 3.0])
    assert at[1] == 0.0 and at[7] == 50.0 and at[8] == 52.0
    assert np.isnan(at[[0, 4, 5, 6, 9]]).all()  # beyond 0.1 s, or in a gap that is not bridged


def test_angles_take_the_short_way():
    series = Series("X", us(0.0, 0.1), np.radians([179.0, -179.0]), True)
    assert errors("yaw_rad", series.at(us(0.05)), np.array([math.pi])) == pytest.approx([0.0], abs=1e-12)
    wrapped = errors("yaw_rad", np.radians([179.0, -170.0]), np.radians([-179.0, 175.0]))
    assert np.degrees(wrapped).tolist() == pytest.approx([-2.0, 15.0])


def test_an_empty_series_knows_nothing():
    assert np.isnan(Series("X", us(), np.empty(0), False).at(us(0.0, 1.0))).all()


def test_statistics():
    error = np.radians([1.0, -3.0, np.nan, 100.0])
    found = error_figures("roll_rad", error, np.array([True, True, True, False]))
    assert found.samples == 2
    reported = found.as_summary()
    assert reported == pytest.approx(
        {"roll_mean_deg": -1.0, "roll_rms_deg": 5.0**0.5, "roll_mse_deg2": 5.0, "roll_max_deg": 3.0}
    )
    assert set(error_figures("north_m_s", error, error < 1.0).as_summary()) == {
        "north_mean_m_s", "north_rms_m_s", "north_mse_m2_s2", "north_max_m_s",
    }  # fmt: skip
    assert error_figures("roll_rad", error, np.zeros(4, dtype=bool)) is None


def test_airborne_is_what_the_vehicle_says(make_log):
    log = make_log()
    for k in range(100):
        log.attitude(0.1 * k)
        if k % 10 == 0:
            log.landed(1 if k < 30 or k >= 80 else 2)
    opened = open_log(log.close())
    spans, source = airborne_spans(opened, 1)
    assert source == "EXTENDED_SYS_STATE"
    times = opened.table("ATTITUDE").time_us
    inside = times[within(spans, times)]
    assert (inside.min(), inside.max()) == (3_000_000, 7_900_000)
    assert duration_s(spans, times) == pytest.approx(5.0)


def test_without_the_state_armed_and_high_counts(make_log):
    log = make_log()
    for k in range(100):
        t = 0.1 * k
        log.attitude(t)
        height_mm = 100 if k < 40 else 5000
        log.say(dialect.MAVLink_global_position_int_message(k * 100, 1, 1, 0, height_mm, 0, 0, 0, 0))
        if k % 10 == 0:
            log.landed(0)  # undefined
            log.heartbeat(armed=k < 60)
    opened = open_log(log.close())
    spans, source = airborne_spans(opened, 1)
    assert source == "armed, above 2 m"
    times = opened.table("ATTITUDE").time_us
    inside = times[within(spans, times)]
    assert (inside.min(), inside.max()) == (4_000_000, 5_900_000)


def test_a_log_that_tells_nothing_of_it_counts_all(make_log):
    log = make_log()
    log.attitude(1.0)
    assert airborne_spans(open_log(log.close()), 1)[1] == "all of the log"


def test_truth_of_each_simulator(make_log):
    roll = 0.4
    log = make_log()
    for k in range(30):
        t = 0.1 * k
        log.attitude(t, roll=roll + 0.1)
        log.truth(t, roll)
        log.say(dialect.MAVLink_simstate_message(9.0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0))
    found = references(open_log(log.close()), 1)
    assert set(found) == {"autopilot", "truth"}
    assert found["truth"].sources == ["HIL_STATE_QUATERNION"]  # has its own time: better than SIMSTATE
    assert found["truth"].columns["roll_rad"].values == pytest.approx(np.full(30, roll), abs=1e-6)
    assert "north_m" not in found["truth"].columns  # no home


def test_positions_are_counted_from_home(make_log):
    log = make_log()
    log.attitude(1.0)
    log.say(
        dialect.MAVLink_home_position_message(473977400, 85455900, 500000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0)
    )
    log.say(
        dialect.MAVLink_global_position_int_message(1100, 473977400 + 1000, 85455900, 0, 0, 300, 400, 0, 0)
    )
    columns = references(open_log(log.close()), 1)["autopilot"].columns
    assert columns["north_m"].values == pytest.approx([1e-4 * 111_182], rel=1e-3)
    assert columns["east_m"].values == pytest.approx([0.0])
    assert columns["course_rad"].values == pytest.approx([math.atan2(4.0, 3.0)])


def test_places_that_no_vehicle_can_have_are_no_reference_and_are_counted(make_log):
    log = make_log()
    for k in range(40):
        log.attitude(0.1 * k)
        lat = {10: 2_000_000_000, 20: 483977400}.get(k, 473977400)
        message = dialect.MAVLink_global_position_int_message
        log.say(message(100 * k, lat, 85455900, 500_000, 300, 0, 0, 0, 0))
    opened = open_log(log.close())
    columns = references(opened, 1)["autopilot"].columns
    assert len(columns["alt_m"].values) == len(columns["lat_deg"].values) == 38
    assert np.ptp(columns["lat_deg"].values) == 0.0
    report = report_of(opened)
    (left,) = report.left_out
    assert left.count_by_reason == {"no_place_on_earth": 1, "position_jumped": 1}
    said = "GLOBAL_POSITION_INT of 1/1: places and times that no vehicle can have: no place on earth 1, "
    assert said + "position jumped 1" in list(report_lines(report))


def test_offsets_to_a_target_are_the_short_way_across_180_degrees(make_log):
    log = make_log()
    for k in range(30):
        log.attitude(0.1 * k)
        for system, component, lon in ((1, 25, 1_799_999_000), (251, 1, -1_799_999_000)):
            log.truth(0.1 * k, 0.0, system, component, lon)
    columns = references(open_log(log.close()), 1)["truth"].columns
    assert columns["offset_north_m"].values == pytest.approx(np.zeros(30))
    assert columns["offset_east_m"].values == pytest.approx(np.full(30, 15.1), abs=0.1)


def test_comparison_over_two_boots(make_log, level):
    """The same times twice, with other truths: each boot is compared with its own."""
    found = estimator_class(level)
    log = make_log()
    for offset in (0.1, -0.2):
        for k in range(40):
            t = 5.0 - 4.0 * (offset < 0) + 0.05 * k
            log.attitude(t, roll=0.0)
            log.truth(t, offset)
        log.attitude(t + 0.05, roll=0.0)
    opened = open_log(log.close())
    result = replay(opened, lambda: found())
    (compared,) = comparisons([opened], result.fleet.runners[1])
    error = compared.errors("truth", "roll_rad")
    first = compared.boot == 0
    known = np.isfinite(error)
    assert error[first & known] == pytest.approx(np.full((first & known).sum(), -0.1), abs=1e-6)
    assert error[~first & known] == pytest.approx(np.full((~first & known).sum(), 0.2), abs=1e-6)
    assert compared.figures["autopilot"][0].max == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(ValueError, match="'moon' is not accepted; there are autopilot, truth, both"):
        comparisons([opened], result.fleet.runners[1], "moon")


def test_a_hover_in_a_hall_is_known_by_its_throttle(make_log):
    """No height, no airspeed: the throttle shows it."""
    log = make_log()
    for k in range(400):
        log.attitude(1.0 + 0.05 * k)
        if k % 20 == 0:
            log.heartbeat()
            percent = 45 if 100 <= k < 300 else 8
            log.say(dialect.MAVLink_vfr_hud_message(0.0, 0.0, 0, percent, 0.0, 0.0))
    spans, source = airborne_spans(open_log(log.close()), 1)
    assert source == "armed, throttle above 20 %"
    assert spans == [(6_000_000, 16_000_000)]


def test_never_in_the_air_says_why(make_log):
    made = {}
    for armed in (False, True):
        log = make_log(f"{armed}.tlog")
        for k in range(100):
            log.attitude(1.0 + 0.05 * k)
            if k % 20 == 0:
                log.heartbeat(armed=armed)
                log.say(dialect.MAVLink_vfr_hud_message(0.0, 0.0, 0, 0, 0.0, 0.0))
        made[armed] = airborne_spans(open_log(log.close()), 1)
    assert made[False] == ([], "never armed")
    assert made[True][0] == [] and made[True][1].startswith("armed, but never above 2 m")


def test_a_rover_counts_while_it_is_armed(make_log):
    log = make_log()
    for k in range(100):
        log.attitude(1.0 + 0.05 * k)
        if k % 20 == 0:
            log.say(dialect.MAVLink_heartbeat_message(10, 3, 128, 0, 4, 3))
    spans, source = airborne_spans(open_log(log.close()), 1)
    assert source == "armed" and spans


def test_a_run_on_the_runway_is_no_flight(make_log):
    """Some autopilots say that they fly as soon as they roll."""
    log = make_log()
    heights = [0.0] * 30 + [0.5 * k for k in range(41)] + [20.0 - 0.5 * k for k in range(41)] + [0.0] * 20
    for k, height in enumerate(heights):
        log.attitude(1.0 + 0.1 * k)
        log.say(
            dialect.MAVLink_global_position_int_message(
                1000 + 100 * k, 1, 1, 0, round(1000 * height) - 40_000, 0, 0, 0, 0
            )
        )  # the field lies 40 m below home
        if k % 5 == 0:
            log.landed(2)
    opened = open_log(log.close())
    spans, _ = airborne_spans(opened, 1)
    times = opened.table("ATTITUDE").time_us
    inside = times[within(spans, times)]
    assert inside.min() == 1_000_000 + 100_000 * (30 + 5)
    assert inside.max() == 1_000_000 + 100_000 * (30 + 41 + 35)
