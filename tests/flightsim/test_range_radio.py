"""The range radio: distances and their noise against the truth, failures, outages, independent streams."""

import math

import numpy as np
import pytest
from scipy import stats

from flightsim import truth as t
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import (
    Carrier,
    DeviceOutage,
    Payload,
    PayloadParameters,
    RangeRadio,
    RangeRadioParameters,
)

HOME = Home()


def truth_at(north_m, east_m, height_m):
    truth = np.zeros(t.TRUTH_SIZE)
    truth[t.LAT_RAD], truth[t.LON_RAD] = np.radians(HOME.offset(north_m, east_m))
    truth[t.ALT_M] = HOME.alt_m + height_m
    return truth


def make(parameters, others, seed=1):
    streams = RandomStreams(seed)
    return RangeRadio(
        parameters,
        truth=truth_at(0.0, 0.0, 100.0),
        home=HOME,
        others=lambda: others,
        physics_rate_hz=250,
        seeds=lambda name: streams.child("vehicle", 0, "sensor", name),
    )


def ranges(radio, seconds):
    return [one for step in range(round(250 * seconds)) for one in radio.step(4000 * step) or ()]


def test_ranges_are_distances_with_the_stated_noise():
    radio = make(RangeRadioParameters(rate_hz=50, missing=0.1), [(2, truth_at(300.0, -400.0, 220.0))])
    found = ranges(radio, 60.0)
    off = np.array([one.range_m for one in found]) - math.hypot(300.0, 400.0, 120.0)
    assert stats.kstest(off / 3.0, "norm").pvalue > 1e-3
    assert stats.binomtest(len(found), 3000, 0.9).pvalue > 1e-3
    assert {one.to_system for one in found} == {2}
    assert found[0].time_us == 0 and max(one.number for one in found) == 2999


def test_a_range_is_not_negative_and_ends_with_the_reach():
    near, far = truth_at(0.0, 0.5, 100.0), truth_at(0.0, 6000.0, 100.0)
    found = ranges(make(RangeRadioParameters(), [(2, near), (3, far)]), 20.0)
    assert {one.to_system for one in found} == {2}
    assert min(one.range_m for one in found) == 0.0


def test_an_outage_and_another_vehicle_change_no_other_range():
    place = truth_at(200.0, 0.0, 100.0)
    usual = ranges(make(RangeRadioParameters(), [(2, place)]), 10.0)
    streams = RandomStreams(1)
    outage = DeviceOutage(device="range_radio", start_s=2.0, duration_s=3.0)
    broken = Payload(
        PayloadParameters(range_radio=RangeRadioParameters(), outages=(outage,)),
        Carrier(
            truth=truth_at(0.0, 0.0, 100.0),
            home=HOME,
            others=lambda: [(2, place)],
            physics_rate_hz=250,
            seeds=lambda name: streams.child("vehicle", 0, "sensor", name),
        ),
    )
    received = []
    for step in range(2500):
        broken.step(4000 * step)
        received += broken.readings.get("range_radio", ())
    assert received == [one for one in usual if not 2.0 <= one.time_us * 1e-6 < 5.0]
    crowd = ranges(make(RangeRadioParameters(), [(4, truth_at(0.0, 90.0, 80.0)), (2, place)]), 10.0)
    assert [one for one in crowd if one.to_system == 2] == usual


def test_rates_that_do_not_divide_the_physics_are_refused():
    with pytest.raises(ValueError, match="rate_hz = 60"):
        make(RangeRadioParameters(rate_hz=60), [])
    with pytest.raises(ValueError, match="sigma_m"):
        RangeRadioParameters(sigma_m=0.0)
