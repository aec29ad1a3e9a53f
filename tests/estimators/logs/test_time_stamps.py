"""Damaged time stamps, and real jumps of time."""

import numpy as np
import pytest

from estimators.logs import open_log
from estimators.logs.time_stamps import NEAR_US, first_offset_us, plausible, span_us
from tests.estimators.logs import flight_log
from tests.estimators.logs.reference import EPOCH_US

DAY_US = 86_400_000_000
STEADY = EPOCH_US + np.arange(100) * 1_000_000


@pytest.mark.parametrize(
    ("stamps", "damaged"),
    [
        (STEADY, []),
        (np.r_[STEADY, STEADY + DAY_US], []),  # a pause
        (np.r_[STEADY + DAY_US, STEADY], []),  # the clock was set back
        (EPOCH_US + np.arange(20) * 300_000_000, []),  # rare records
        (np.r_[STEADY[:3] - DAY_US // 2, STEADY], []),
        (np.r_[STEADY, STEADY[-1] + DAY_US // 2], []),  # a last record after a pause
        (np.r_[7, STEADY], [0]),
        (np.r_[EPOCH_US + 2**50, STEADY], [0]),
        (np.r_[STEADY[:50], STEADY[50] + 2**36, STEADY[51:]], [50]),
        (np.r_[STEADY[:50], STEADY[50] - 2**36, STEADY[51:]], [50]),
        (np.r_[STEADY[:50], 1, 2, 3, STEADY[50:]], [50, 51, 52]),
        (np.r_[STEADY, 2**60], [100]),
        (np.r_[-1, STEADY, -1], [0, 101]),  # not a stamp
    ],
)
def test_stamps_are_damaged_that_those_around_them_contradict(stamps, damaged):
    good = plausible(np.asarray(stamps, dtype=np.int64), DAY_US)
    assert np.flatnonzero(~good).tolist() == damaged


def test_the_span_of_stamps_leaves_a_few_out():
    outside = (0, 5, 2**60)
    assert span_us(np.r_[STEADY, outside]) == (STEADY[0], STEADY[-1])
    assert span_us(np.r_[STEADY, STEADY + DAY_US]) == (STEADY[0], STEADY[-1] + DAY_US)
    assert span_us(np.array([0, 10 * NEAR_US])) == (0, 10 * NEAR_US)


def test_a_damaged_date_is_not_that_of_the_log():
    times = np.arange(10) * 1_000_000
    dates = EPOCH_US + times
    dates[0] += 7 * DAY_US
    assert first_offset_us(dates, times, dates > 0) == EPOCH_US
    assert first_offset_us(dates, times, np.zeros(10, dtype=bool)) is None


@pytest.mark.parametrize("place", ["first", "middle", "last"])
@pytest.mark.parametrize("fault", ["cut", "zero", "flipped"])
def test_a_damaged_stamp_of_a_record_does_not_change_the_duration(tmp_path, place, fault):
    path = flight_log.write(tmp_path / "flight.tlog")
    whole = open_log(path)
    starts, _ = whole.source.frame_spans(np.arange(len(whole)))  # type: ignore[attr-defined]
    duration_s, count = whole.duration_s, len(whole)
    number = {"first": 0, "middle": count // 2, "last": count - 1}[place]
    data = bytearray(path.read_bytes())
    at = int(starts[number]) - 8
    if fault == "cut":
        del data[at : at + 5]
    elif fault == "zero":
        data[at : at + 8] = bytes(8)
    else:
        data[at] ^= 0x10
    path.write_bytes(data)
    log = open_log(path)
    times = log.source.log_time_us(np.arange(len(log)))
    assert len(log) == count and log.duration_s == pytest.approx(duration_s, abs=0.06)
    assert log.start_unix_us == EPOCH_US and np.diff(times).min() >= 0 and np.diff(times).max() < 200_000
    assert log.source.remarks["timestamps_damaged"] == (fault != "cut")
