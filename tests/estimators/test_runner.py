"""The one loop: who is received, boots, columns, failures; frames and logs give the same."""

import random
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import pytest

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.tlog import TlogReader
from estimators.errors import EstimatorError, EstimatorFailure
from estimators.fleet import MAX_VEHICLES, Fleet
from estimators.interface import Need, Outcome
from estimators.library import estimator_class
from estimators.log_replay import log_rate_hz, replay
from estimators.logs import open_log
from estimators.runner import Runner
from estimators.target_fusion import TargetFusionEstimator, TargetFusionParameters


def feed(path, fleet):
    """All frames of a log, as a link would bring them."""
    for _, frame in TlogReader(path):
        fleet.feed(frame)
    return fleet


def columns(fleet):
    return {
        (system, name): (
            table.time_us.tolist(),
            table.boot.tolist(),
            table.subject.tolist(),
            table.values.tobytes(),
        )
        for system, runner in fleet.runners.items()
        for name, table in runner.tables.items()
    }


@pytest.fixture
def make(level):
    found = estimator_class(level)
    return lambda: found()


@dataclass(frozen=True, slots=True, kw_only=True)
class Wrong:
    """An estimate of anything."""

    COLUMNS: ClassVar[tuple[str, ...]] = ("roll_rad",)
    time_us: Any
    values: Any
    subject: int = 1

    def row(self):
        return self.values


def test_estimates_become_columns(make_log, make):
    log = make_log()
    for k in range(50):
        log.attitude(1.0 + 0.05 * k, roll=0.01 * k)
    runner = feed(log.close(), Fleet(make)).runners[1]
    table = runner.tables["Level"]
    assert len(table) == 50
    assert table.columns == ("roll_rad", "pitch_rad")
    assert table.time_us[:2].tolist() == [1_000_000, 1_050_000]
    assert table.values.shape == (50, 2)
    expected = 0.0
    for k in range(50):
        expected += 0.3 * (float(np.float32(0.01 * k)) - expected)
    assert table["roll_rad"][-1] == pytest.approx(expected, abs=1e-12)
    with pytest.raises(KeyError, match="there are roll_rad, pitch_rad"):
        table["yaw_rad"]


def test_truth_and_estimators_are_not_received(make_log, make):
    log = make_log()
    for k in range(20):
        t = 1.0 + 0.05 * k
        log.truth(t, 0.9)
        log.attitude(t, roll=0.1)
        log.attitude(t, roll=0.9, component=191)
        log.attitude(t, roll=0.9, component=25)
    runner = feed(log.close(), Fleet(make)).runners[1]
    assert runner.outcomes == {Outcome.UPDATED: 20}
    assert runner.left_out == {"from an estimator": 20, "truth": 20}
    assert np.allclose(runner.tables["Level"]["roll_rad"], 0.1)


def test_what_an_onboard_computer_measures_is_received(make_log):
    """A camera's software on a companion computer is received, estimates from there are not."""
    log = make_log()
    for k in range(50):
        t = 1.0 + 0.1 * k
        log.attitude(t)
        log.attitude(t, component=191)
        place = 473977400, 85455900, 500000
        log.say(dialect.MAVLink_gps_raw_int_message(round(t * 1e6), 3, *place, 1, 1, 500, 0, 9))
        log.say(
            dialect.MAVLink_home_position_message(*place, 0.0, 0.0, 0.0, (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
        )
        seen = dialect.MAVLink_landing_target_message(round(t * 1e6), 3, 12, 0.1, 0.1, 20.0, 0.02, 0.02)
        log.say(seen, component=191)
    opened = open_log(log.close())
    done = replay(
        [opened], lambda: TargetFusionEstimator(TargetFusionParameters(mount="fixed", heading="yaw"))
    )
    assert log_rate_hz(opened, 1, "LANDING_TARGET") > 9.0
    assert done.fleet.runners[0].left_out == {"from an estimator": 50}
    assert done.fleet.runners[0].tables["TargetEstimate"]["target"][0] == 3.0


def test_each_vehicle_has_a_runner_and_one_can_be_chosen(make_log, make):
    log = make_log()
    for k in range(20):
        log.attitude(1.0 + 0.05 * k, system=1)
        log.attitude(300.0 + 0.05 * k, system=7, roll=0.2)
        log.attitude(1.0 + 0.05 * k, system=230)  # of a ground station: no vehicle
    path = log.close()
    assert set(feed(path, Fleet(make)).runners) == {1, 7}
    assert set(feed(path, Fleet(make, single=True)).runners) == {1}
    only = feed(path, Fleet(make, system_ids=(7,))).runners
    assert set(only) == {7}
    assert only[7].tables["Level"].subject.tolist() == [7] * 20


def test_a_crowd_of_false_system_ids_makes_a_limited_number_of_runners(make_log, make):
    log = make_log()
    for system in range(1, 250):
        log.attitude(1.0, system=system)
    assert len(feed(log.close(), Fleet(make)).runners) == MAX_VEHICLES


def test_a_new_boot_starts_the_estimator_anew(make_log, make):
    log = make_log()
    for start in (100.0, 2.0, 1.0):
        for k in range(80):
            log.attitude(start + 0.05 * k, roll=start / 1000.0)
    path = log.close()
    table = feed(path, Fleet(make)).runners[1].tables["Level"]
    assert np.unique(table.boot, return_counts=True)[1].tolist() == [80, 80, 80]
    assert np.allclose(table["roll_rad"], np.repeat([0.1, 0.002, 0.001], 80))
    assert columns(replay(open_log(path), make).fleet) == columns(feed(path, Fleet(make)))


def test_frames_and_log_give_the_same_bits_however_mixed_up(make_log, make):
    """Late, repeated, unstamped, other components and vehicles, NaN, boots: in any order."""
    chance = random.Random(4)
    log = make_log()
    t = {1: 10.0, 2: 500.0}
    for _ in range(3000):
        system = chance.choice((1, 1, 1, 2))
        t[system] = t[system] + chance.choice((0.01, 0.01, 0.02, 0.0, -0.005))
        if chance.random() < 0.004:
            t[system] += chance.choice((3.0, 60.0, -0.5, -1.5))
        if chance.random() < 0.002:
            t[system] = 1.0
        kind = chance.randrange(6)
        if kind < 3:
            roll = float("nan") if chance.random() < 0.05 else chance.uniform(-1, 1)
            log.attitude(t[system], roll=roll, system=system, component=chance.choice((1, 1, 1, 191, 100)))
        elif kind == 3:
            log.truth(t[system], 0.1, system=system)
        elif kind == 4:
            log.say(dialect.MAVLink_vfr_hud_message(12.0, 12.0, 0, 50, 0.0, 0.0), system)
        else:
            log.heartbeat(system)
    path = log.close()
    live = feed(path, Fleet(make))
    again = replay(open_log(path), make)
    assert len(live.runners[1].tables["Level"]) > 200
    assert columns(live) == columns(again.fleet)
    for system, runner in live.runners.items():
        assert runner.outcomes == again.fleet.runners[system].outcomes
        assert runner.outcomes[Outcome.NOT_FINITE] > 0


def test_an_estimator_that_needs_truth_is_refused(make):
    cheat = type(
        "Cheat",
        (type(make()),),
        {"needs": property(lambda self: (Need(messages=("SIM_STATE",), rate_hz=1, purpose="truth"),))},
    )
    with pytest.raises(EstimatorError, match="SIM_STATE: truth is for comparison"):
        Runner(cheat())


def test_an_unknown_message_is_refused(make):
    odd = type(
        "Odd",
        (type(make()),),
        {"needs": property(lambda self: (Need(messages=("RAW_IMMU",), rate_hz=1, purpose="x"),))},
    )
    with pytest.raises(EstimatorError, match="RAW_IMMU: no such message"):
        Runner(odd())


def test_an_error_of_the_estimator_names_message_and_time(make_log, make):
    def fail(self, time_us, message):
        raise ZeroDivisionError("oops")

    broken = type("Broken", (type(make()),), {"handle": fail})
    log = make_log()
    for k in range(30):
        log.attitude(2.5 + 0.05 * k)
    path = log.close()
    with pytest.raises(
        EstimatorFailure, match=r"level failed at ATTITUDE of 2\.500 s: ZeroDivisionError: oops"
    ):
        feed(path, Fleet(broken))
    result = replay(open_log(path), broken)
    assert result.partial
    assert "oops" in result.failure


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ({"handle": lambda *_: None}, "handle gave None, which is no Outcome"),
        ({"handle": lambda *_: "updated"}, "handle gave 'updated', which is no Outcome"),
        ({"estimates": property(lambda _: [1.0])}, "estimates holds float, which has no COLUMNS"),
        ({"estimates": property(lambda _: 1.0)}, "TypeError: 'float' object is not iterable"),
        ({"estimates": property(lambda _: [Wrong(time_us=1, values=(1.0, 2.0))])}, "gives 2 values"),
        ({"estimates": property(lambda _: [Wrong(time_us=1, values=("a",))])}, "must be real number"),
        ({"estimates": property(lambda _: [Wrong(time_us=0.5, values=(1.0,))])}, "'float' object"),
    ],
)
def test_what_is_no_estimate_is_the_estimators_failure(make_log, make, changes, reported):
    log = make_log()
    for k in range(30):
        log.attitude(2.5 + 0.05 * k)
    found = replay(open_log(log.close()), type("Odd", (type(make()),), changes))
    assert reported in found.failure and "level failed at ATTITUDE of 2.500 s" in found.failure
    for table in found.fleet.runners[1].tables.values():
        assert len(table) == len(table.values) == 0


@pytest.mark.parametrize("needs", [None, (), [("ATTITUDE", 20.0)]])
def test_needs_that_are_none_are_refused(make, needs):
    with pytest.raises(EstimatorError, match=r"needs of level is .*; give one or more"):
        Fleet(type("Odd", (type(make()),), {"needs": needs}))


def test_what_can_not_be_published_is_the_estimators_failure(make):
    def too_large(_self):
        return [dialect.MAVLink_attitude_message(-1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)]

    for publish, reported in (
        (too_large, "time_boot_ms"),
        (lambda _: [3], "int"),
        (lambda _: 1 / 0, "division"),
    ):
        runner = Runner(type("Odd", (type(make()),), {"publish": publish})())
        with pytest.raises(EstimatorFailure, match=rf"level\.publish\(\) failed.*{reported}"):
            runner.publish()


def test_remarks_that_fail_lose_nothing_else(make):
    runner = Runner(type("Odd", (type(make()),), {"remarks": lambda _: 1 / 0})())
    assert "division by zero" in runner.remarks["remarks_failed"]  # type: ignore[operator]
