"""Logs through estimators: what is lacking, parts of logs, teams and their common time, real logs."""

from dataclasses import dataclass
from typing import ClassVar

import pytest

from autopilot_bridge.tlog import TlogReader
from estimators.comparison import comparisons
from estimators.errors import EstimatorError
from estimators.fleet import Fleet
from estimators.interface import Estimator, Need, Outcome
from estimators.library import estimator_class
from estimators.log_replay import replay
from estimators.logs import open_log
from estimators.vehicle_time import TeamTime
from tests.recorded_logs import each_recorded_log

UNIX_S = 1.7e9


@pytest.fixture
def make(level):
    found = estimator_class(level)
    return lambda: found()


@dataclass(frozen=True, slots=True, kw_only=True)
class Nothing:
    """No parameters."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Received:
    """That something was received."""

    COLUMNS: ClassVar = ("roll_rad",)
    time_us: int
    subject: int
    roll_rad: float

    def row(self):
        return (self.roll_rad,)


class Ears(Estimator[Nothing]):
    """A team's estimator: says what it hears, in the order in which it hears it."""

    NAME, PARAMETERS, TEAM = "ears", Nothing, True
    needs = (Need(messages=("ATTITUDE",), rate_hz=5.0, purpose="attitude"),)
    estimates = ()

    def handle(self, time_us, message):
        self.estimates = (Received(time_us=time_us, subject=message.src_system, roll_rad=message.roll),)
        return Outcome.UPDATED

    def reset(self):
        self.estimates = ()


def test_a_log_without_what_is_needed_gives_words_and_no_numbers(make_log, make):
    log = make_log()
    for k in range(20):
        log.attitude(1.0 + 0.5 * k)
    result = replay(open_log(log.close()), make)
    assert result.lacking == {1: ["ATTITUDE at 2 Hz; needs 10 Hz or more for attitude"]}
    assert result.partial
    assert not result.fleet.runners


def test_a_vehicle_that_lacks_it_does_not_keep_another_from_its_estimates(make_log, make):
    log = make_log()
    for k in range(40):
        log.attitude(1.0 + 0.05 * k, system=1)
        if k % 10 == 0:
            log.attitude(1.0 + 0.05 * k, system=2)
    result = replay(open_log(log.close()), make)
    assert set(result.lacking) == {2}
    assert set(result.fleet.runners) == {1}


def test_a_log_without_a_vehicle_is_partial(make_log, make):
    log = make_log()
    log.heartbeat(system=255)
    result = replay(open_log(log.close()), make)
    assert result.partial
    assert not result.supplies


def test_a_part_of_a_log(make_log, make):
    log = make_log()
    for k in range(200):
        log.attitude(1.0 + 0.05 * k)
    result = replay(open_log(log.close()), make, from_s=3.0, to_s=4.05)
    times = result.fleet.runners[1].tables["Level"].time_us
    assert (times[0], times[-1]) == (3_000_000, 4_000_000)


def test_team_time_takes_every_vehicle_to_one_time(make_log):
    """Two vehicles that booted 100 s apart, on one link and in two logs: the same common times."""
    one = make_log("one.tlog")
    apart = {system: make_log(f"{system}.tlog") for system in (3, 4)}
    boot_unix = {3: UNIX_S, 4: UNIX_S + 100.0}
    for k in range(400):
        t = 150.0 + 0.05 * k  # since the first booted
        for system in (3, 4):
            own = t - (boot_unix[system] - UNIX_S) + 0.01 * (system == 4)
            for log in (one, apart[system]):
                if k % 20 == 0:
                    log.system_time(own, boot_unix[system] + own + 0.0004 * (k % 3), system)
                log.attitude(own, roll=0.001 * k, system=system)
    together = replay(open_log(one.close()), Ears)
    merged = replay([open_log(log.close()) for log in apart.values()], Ears)
    tables = [result.fleet.runners[0].tables["Received"] for result in (together, merged)]
    assert tables[0].time_us.tolist() == tables[1].time_us.tolist()
    assert tables[0].subject.tolist() == tables[1].subject.tolist()
    for compared in comparisons(merged.logs, merged.fleet.runners[0]):  # with each one's log, in its own time
        errors = compared.errors("autopilot", "roll_rad")
        assert len(errors) == 400 and abs(errors).max() < 1e-12
    steps = set((tables[0].time_us[1:] - tables[0].time_us[:-1]).tolist())
    assert max(steps) <= 51_000 and min(steps) >= 0
    live = Fleet(Ears)
    for _, frame in TlogReader(one.path):
        live.feed(frame)
    assert live.runners[0].tables["Received"].time_us.tolist() == tables[0].time_us.tolist()


def test_without_a_calendar_vehicle_times_stay_as_they_are():
    time = TeamTime()

    class Message:
        src_system, time_unix_usec = 1, 0

    time.learn(5_000_000, Message)
    assert time.common_us(5_000_000, 1) == 5_000_000


def test_the_same_vehicle_in_two_logs_of_a_team_is_refused(make_log):
    logs = [make_log(name) for name in ("a.tlog", "b.tlog")]
    for log in logs:
        for k in range(20):
            log.attitude(1.0 + 0.05 * k)
    with pytest.raises(EstimatorError, match=r"vehicle 1 is in .*a\.tlog and in .*b\.tlog"):
        replay([open_log(log.close()) for log in logs], Ears)


def test_several_logs_are_for_teams(make_log, make):
    logs = [make_log(name) for name in ("a.tlog", "b.tlog")]
    for log in logs:
        log.attitude(1.0)
    with pytest.raises(EstimatorError, match="level is for one vehicle; replay 2 logs one by one"):
        replay([open_log(log.close()) for log in logs], make)


def test_a_boot_that_is_left_out_is_counted_all_the_same(make_log, make):
    """Of three boots the first is over before the part that is requested begins."""
    log = make_log()
    for seconds, roll in ((4, 0.1), (20, 0.2), (20, 0.3)):
        for k in range(seconds * 20):
            log.attitude(1.0 + 0.05 * k, roll=roll)
            log.truth(1.0 + 0.05 * k, roll=roll)
            if k % 20 == 0:
                log.heartbeat()
    opened = open_log(log.close())
    whole, part = replay(opened, make), replay(opened, make, from_s=10.0)
    assert [runner.boot for runner in (whole.fleet.runners[1], part.fleet.runners[1])] == [2, 2]
    (compared,) = comparisons(part.logs, part.fleet.runners[1], "truth")
    rolls = compared.references["truth"]["roll_rad"]
    assert set(compared.boot.tolist()) == {1, 2}
    assert rolls[compared.boot == 1] == pytest.approx(0.2, abs=1e-6)
    assert rolls[compared.boot == 2] == pytest.approx(0.3, abs=1e-6)


def test_a_team_lacks_what_one_of_its_vehicles_lacks(make_log):
    log = make_log()
    for k in range(40):
        log.attitude(1.0 + 0.05 * k, system=1)
        log.heartbeat(system=2)
    result = replay(open_log(log.close()), Ears)
    assert result.lacking == {2: ["no ATTITUDE; needs 5 Hz or more for attitude"]}
    assert result.partial


@each_recorded_log
def test_frames_and_columns_of_real_logs_give_the_same_bits(path):
    """What a link would have brought, and what the log's columns give, through the attitude filter."""
    found = estimator_class("attitude")
    live = Fleet(lambda: found())
    for count, (_, frame) in enumerate(TlogReader(path)):
        live.feed(frame)
        if count > 15_000:
            break
    again = replay(open_log(path), lambda: found())
    assert set(live.runners) == set(again.fleet.runners)
    for system, runner in live.runners.items():
        for name, table in runner.tables.items():
            count = len(table)
            assert count > 500
            full = again.fleet.runners[system].tables[name]
            assert table.time_us.tolist() == full.time_us[:count].tolist()
            assert table.values.tobytes() == full.values[:count].tobytes()
