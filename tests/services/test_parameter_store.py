"""The parameter store and both flavours' tables."""

import json
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.firmware.ardupilot.copter.parameters import ARDUPILOT_PARAMETERS
from autopilot_bridge.firmware.px4.copter.parameters import PX4_PARAMETERS
from autopilot_bridge.parameters import ParameterDefinition, ParameterError, ParameterStore, ParameterType

TABLES = {"px4": PX4_PARAMETERS, "ardupilot": ARDUPILOT_PARAMETERS}
OBSERVED = {"px4": "px4_params_quad.json", "ardupilot": "ardupilot_params_copter.json"}
NOT_DEFAULTS = {"STAT_BOOTCNT", "STAT_RUNTIME", "STAT_FLTTIME", "FORMAT_VERSION"}  # counters of the recording
SWITCHES = {"FOLL": "FOLL_ENABLE", "PLND": "PLND_ENABLED", "VISO": "VISO_TYPE"}
DATA = Path(__file__).parents[2].parent / "shared" / "data"

SPEED = ParameterDefinition(
    name="SPEED", type=ParameterType.REAL32, default=0.1, minimum=0.0, maximum=5.0, unit="m/s"
)
MODE = ParameterDefinition(name="MODE", type=ParameterType.INT8, default=-1, minimum=-1, maximum=9)


def store(**overrides: float) -> ParameterStore:
    return ParameterStore((SPEED, MODE), overrides)


def test_values_are_stored_in_their_type() -> None:
    assert store().get("SPEED") == pytest.approx(0.1, rel=1e-7)
    assert store().get("SPEED") != 0.1  # single precision
    assert isinstance(store(MODE=3.0).get("MODE"), int)


@pytest.mark.parametrize(
    ("name", "value", "reported"),
    [
        ("SPEED", 7.0, "SPEED = 7: accepted is a number in 0..5 m/s"),
        ("SPEED", math.nan, "SPEED = nan: not finite"),
        ("SPEED", 1e39, "single precision"),
        ("MODE", 2.5, "MODE = 2.5: accepted is a whole number in -1..9"),
        ("MODE", 200, "a whole number in -1..9"),
        ("SPED", 1.0, "no parameter 'SPED'; did you mean SPEED?"),
    ],
)
def test_errors_name_parameter_value_and_what_is_accepted(name: str, value: float, reported: str) -> None:
    parameters = store()
    before = parameters.as_dict()
    with pytest.raises(ParameterError) as caught:
        parameters.set(name, value)
    assert reported in str(caught.value)
    assert parameters.as_dict() == before
    with pytest.raises(ParameterError):
        store(**{name: value})


def test_range_is_optional_but_the_type_is_not() -> None:
    parameters = store()
    parameters.set("SPEED", 500.0, check_range=False)
    assert parameters.get("SPEED") == 500.0
    with pytest.raises(ParameterError):
        parameters.set("MODE", 128, check_range=False)


def test_a_value_out_of_range_acts_as_the_nearest_used_one() -> None:
    used = ParameterDefinition(
        name="ANGLE", type=ParameterType.REAL32, default=10.0, minimum=0.0, maximum=90.0, used=(5.0, 85.0)
    )
    parameters = ParameterStore((SPEED, MODE, used))
    for value, angle, speed in ((-500.0, 5.0, 0.0), (2.0, 5.0, 2.0), (86.0, 85.0, 5.0), (4.5, 5.0, 4.5)):
        parameters.set("ANGLE", value, check_range=False)
        parameters.set("SPEED", value, check_range=False)
        assert (parameters.limited("ANGLE"), parameters.limited("SPEED")) == (angle, speed)
        assert parameters.get("ANGLE") == value
    with pytest.raises(ParameterError, match="no parameter 'ANGEL'"):
        parameters.limited("ANGEL")
    with pytest.raises(ValueError, match="X: used 2 is above 1"):
        ParameterDefinition(name="X", type=ParameterType.INT8, default=0, used=(2, 1))


@pytest.mark.parametrize("flavour", TABLES)
def test_a_used_range_overlaps_the_documented_one(flavour: str) -> None:
    limited = [definition for definition in TABLES[flavour] if definition.used is not None]
    assert len(limited) > 40
    for definition in limited:
        assert definition.used is not None
        low, high = definition.used
        assert definition.minimum is None or high > definition.minimum, definition.name
        assert definition.maximum is None or low < definition.maximum, definition.name


def test_subscribers_hear_changes_only() -> None:
    parameters = store()
    received: list[tuple[str, float]] = []
    unsubscribe = parameters.subscribe(lambda name, value: received.append((name, value)))
    assert parameters.set("MODE", 4)
    assert not parameters.set("MODE", 4)
    unsubscribe()
    parameters.set("MODE", 5)
    assert received == [("MODE", 4)]
    assert parameters.get("MODE") == 5


def test_order_and_lookup() -> None:
    parameters = store()
    assert [parameters.by_index(i).name for i in range(parameters.count)] == ["SPEED", "MODE"]
    assert parameters.find("mode") is None
    assert parameters.find("mode", ignore_case=True) is MODE
    for index in (-1, 2):
        with pytest.raises(IndexError):
            parameters.by_index(index)


def test_a_table_with_a_name_twice_is_refused() -> None:
    with pytest.raises(ValueError, match="defined twice: SPEED"):
        ParameterStore((SPEED, SPEED))


@given(st.floats(allow_nan=True, allow_infinity=True))
def test_whatever_is_set_the_store_stays_in_its_types(value: float) -> None:
    parameters = store()
    for name in ("SPEED", "MODE"):
        try:
            parameters.set(name, value, check_range=False)
        except ParameterError:
            continue
    assert math.isfinite(parameters.get("SPEED"))
    assert -128 <= parameters.get("MODE") <= 127


@pytest.mark.parametrize("flavour", TABLES)
def test_every_default_lies_in_its_range(flavour: str) -> None:
    for definition in TABLES[flavour]:
        definition.check_range(definition.convert(definition.default))
        assert definition.description
    ParameterStore(TABLES[flavour])


def test_px4_lists_by_name() -> None:
    names = [definition.name for definition in PX4_PARAMETERS]
    assert names == sorted(names)
    assert {definition.type for definition in PX4_PARAMETERS} == {ParameterType.INT32, ParameterType.REAL32}


NOT_LISTED = {"MIS_TKO_LAND_REQ"}
"""PX4 1.16 lists parameters that were used. This one (navigator/mission_params.c) had not been when those
of the multicopter were recorded.
"""


@pytest.mark.parametrize("flavour", TABLES)
def test_tables_agree_with_the_observed_firmware(flavour: str) -> None:
    file = DATA / OBSERVED[flavour]
    if not file.exists():
        pytest.skip(f"observed parameters {file.name} are not here")
    observed = json.loads(file.read_text())
    for definition in TABLES[flavour]:
        if definition.name in NOT_LISTED:
            continue
        if definition.name not in observed:  # ArduPilot hides what is switched off
            switch = SWITCHES.get(definition.name.partition("_")[0])
            assert switch is not None and observed[switch] == 0, definition.name
            continue
        if definition.name in NOT_DEFAULTS:
            continue
        value = observed[definition.name]
        assert definition.default == pytest.approx(value, rel=1e-5, abs=1e-9), definition.name
        if flavour == "px4":
            assert definition.is_integer == isinstance(value, int), definition.name
