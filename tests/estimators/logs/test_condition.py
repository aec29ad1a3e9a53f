"""Conditions are parsed, look at the newest values, and refuse what they do not know."""

import contextlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimators.logs.condition import Condition, ConditionError, Field


class Table:
    def __init__(self, order, **columns):
        self.order = np.array(order, dtype=np.int64)
        self.columns = {name: np.array(values) for name, values in columns.items()}

    @property
    def fields(self):
        return tuple(self.columns)

    def __getitem__(self, field):
        return self.columns[field]


ATTITUDE = Table([1, 4, 7], roll=np.array([0.1, 0.5, -0.9], dtype=np.float32))
HEARTBEAT = Table(
    [0, 5], custom_mode=np.array([4, 5], dtype=np.uint32), type=np.array([1, 2], dtype=np.uint8)
)
SERVO = Table([2], actuator=np.array([[1.0, 2.0, 3.0]]))
TEXT = Table([3, 6], text=np.array([b"armed", b"landed"]))
TABLES = {"ATTITUDE": ATTITUDE, "HEARTBEAT": HEARTBEAT, "SERVO": SERVO, "STATUSTEXT": TEXT}


def holds(text, order=range(9)):
    mask = Condition(text).mask(np.array(order, dtype=np.int64), lambda n: [TABLES[n]] if n in TABLES else [])
    return np.flatnonzero(mask).tolist()


@pytest.mark.parametrize(
    ("text", "where"),
    [
        ("ATTITUDE.roll > 0.3", [4, 5, 6]),
        ("abs(ATTITUDE.roll) > 0.3", [4, 5, 6, 7, 8]),
        ("0 < ATTITUDE.roll < 0.3", [1, 2, 3]),
        ("not ATTITUDE.roll > 0.3", [1, 2, 3, 7, 8]),
        ("HEARTBEAT.custom_mode == 5 and ATTITUDE.roll > 0", [5, 6]),
        ("HEARTBEAT.custom_mode == 5 or ATTITUDE.roll < 0", [5, 6, 7, 8]),
        ("HEARTBEAT.type - 3 < 0", list(range(9))),
        ("HEARTBEAT.custom_mode & 1", [5, 6, 7, 8]),
        ("SERVO.actuator[1] == 2", [2, 3, 4, 5, 6, 7, 8]),
        ("STATUSTEXT.text == 'armed'", [3, 4, 5]),
        ("-ATTITUDE.roll * 10 >= 9 - 1e-6", [7, 8]),
        ("GPS_RAW_INT.fix_type > 2", []),
    ],
)
def test_newest_values_decide(text, where):
    assert holds(text) == where


def test_several_tables_of_a_message_are_merged():
    other = Table([2, 8], roll=np.array([1.0, 1.0]))
    mask = Condition("ATTITUDE.roll > 0.7").mask(np.arange(10), lambda name: [ATTITUDE, other])
    assert np.flatnonzero(mask).tolist() == [2, 3, 8, 9]


def test_it_names_its_fields():
    condition = Condition("SERVO.actuator[1] > ATTITUDE.roll")
    assert condition.fields == (Field("SERVO", "actuator", 1), Field("ATTITUDE", "roll"))
    assert condition.messages == {"SERVO", "ATTITUDE"}


@pytest.mark.parametrize(
    "text",
    [
        "",
        "1 < 2",
        "roll > 3",
        "ATTITUDE.roll >",
        "__import__('os').system('true')",
        "ATTITUDE.roll.__class__",
        "ATTITUDE.roll if 1 else 2",
        "[ATTITUDE.roll]",
        "(lambda: 1)()",
        "open('x')",
        "ATTITUDE.roll ** 99999",
        "ATTITUDE.roll << 3",
        "f'{ATTITUDE.roll}'",
        "abs(ATTITUDE.roll, 2)",
        "(" * 400,
        "-" * 500 + "ATTITUDE.roll",
        "x" * 2000,
        "\0",
    ],
)
def test_what_is_no_condition_is_refused(text):
    with pytest.raises(ConditionError):
        Condition(text)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("ATTITUDE.bank > 0", "it has roll"),
        ("SERVO.actuator > 0", "array of 3"),
        ("SERVO.actuator[3] > 0", "array of 3"),
        ("ATTITUDE.roll[0] > 0", "not an array"),
        ("STATUSTEXT.text > 3", "text with a number"),
        ("STATUSTEXT.text + 1 > 3", "text with a number"),
        ("STATUSTEXT.text", "neither true nor false"),
    ],
)
def test_what_does_not_fit_the_log_is_refused(text, says):
    with pytest.raises(ConditionError, match=says):
        holds(text)


@given(st.text(alphabet="ATIUDE.rol()<>=andot 0123456789'[]-+*/%,", max_size=60))
def test_any_text_is_parsed_or_refused(text):
    with contextlib.suppress(ConditionError):
        holds(text)
