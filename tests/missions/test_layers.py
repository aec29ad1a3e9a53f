"""Who may take off and land."""

import itertools

import pytest

from missions.teams.layers import Traffic


def test_no_vehicle_rises_before_all_were_checked():
    traffic = Traffic([80.0, 95.0, 110.0])
    traffic.checked(2)
    assert not traffic.may_rise(2)
    traffic.checked(0)
    traffic.checked(1)
    assert [traffic.may_rise(k) for k in range(3)] == [False, False, True]


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_highest_rises_first_and_lands_last(order):
    heights = [(80.0, 95.0, 110.0)[k] for k in order]
    traffic = Traffic(heights)
    for k in range(3):
        traffic.checked(k)
    rising = []
    while len(rising) < 3:
        (index,) = [k for k in range(3) if k not in rising and traffic.may_rise(k)]
        rising.append(index)
        traffic.risen(index)
    assert [heights[k] for k in rising] == [110.0, 95.0, 80.0]
    landing = []
    while len(landing) < 3:
        (index,) = [k for k in range(3) if k not in landing and traffic.may_land(k)]
        landing.append(index)
        traffic.down(index)
    assert [heights[k] for k in landing] == [80.0, 95.0, 110.0]


def test_one_layer_for_all_is_taken_in_turns():
    traffic = Traffic([50.0, 50.0])
    traffic.checked(0)
    traffic.checked(1)
    assert [traffic.may_rise(0), traffic.may_rise(1)] == [False, True]
    assert [traffic.may_land(0), traffic.may_land(1)] == [True, False]
