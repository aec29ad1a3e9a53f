"""What a log lacks, in words."""

import pytest

from estimators.interface import Need
from estimators.needs import lacking, supplies, wanted_rate_hz

IMU = Need(messages=("HIGHRES_IMU", "RAW_IMU"), rate_hz=20.0, purpose="angular rate", wanted_rate_hz=50.0)
AIR = Need(messages=("VFR_HUD",), rate_hz=1.0, purpose="airspeed", optional=True)
HOME = Need(messages=("HOME_POSITION",), rate_hz=0.0, purpose="home")


def rates(**known):
    return lambda name: known.get(name, 0.0)


@pytest.mark.parametrize(
    ("received", "message", "met", "text"),
    [
        ({"HIGHRES_IMU": 50.0, "RAW_IMU": 50.0}, "HIGHRES_IMU", True, "HIGHRES_IMU at 50 Hz"),
        ({"HIGHRES_IMU": 2.0, "RAW_IMU": 25.0}, "RAW_IMU", True, "RAW_IMU at 25 Hz"),
        ({"RAW_IMU": 19.3}, "RAW_IMU", True, "RAW_IMU at 19.3 Hz"),
        ({"RAW_IMU": 1.2}, "RAW_IMU", False, "RAW_IMU at 1.2 Hz; needs 20 Hz or more for angular rate"),
        ({}, "", False, "no HIGHRES_IMU or RAW_IMU; needs 20 Hz or more for angular rate"),
    ],
)
def test_the_first_that_is_fast_enough_serves(received, message, met, text):
    (supply,) = supplies([IMU], rates(**received))
    assert (supply.message, supply.met, supply.text) == (message, met, text)


def test_only_what_cannot_be_done_without_is_lacking():
    assert lacking([IMU, AIR, HOME], rates(RAW_IMU=1.2, HOME_POSITION=0.01)) == [
        "RAW_IMU at 1.2 Hz; needs 20 Hz or more for angular rate"
    ]
    assert lacking([IMU, HOME], rates(RAW_IMU=50.0)) == ["no HOME_POSITION; needs it at any rate for home"]
    assert lacking([AIR], rates()) == []


def test_what_to_ask_for():
    assert [wanted_rate_hz(need) for need in (IMU, AIR, HOME)] == [50.0, 1.0, 1.0]
