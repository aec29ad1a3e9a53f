"""The metadata of actuators: as MAVLink's schema has it, and true of the vehicle."""

import re
from collections.abc import Collection, Mapping
from typing import Any

import pytest

from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.firmware.px4.actuators import FUNCTIONS, actuator_metadata
from autopilot_bridge.firmware.px4.component_metadata import parameter_metadata
from autopilot_bridge.parameters import ParameterDefinition
from flightsim.airframe import AirframeKind

KINDS = (AirframeKind.MULTICOPTER, AirframeKind.FIXED_WING)
CONDITION = re.compile(r"(true|false|[.\-a-zA-Z0-9_]{1,16}(>|>=|==|!=|<|<=)-?\d+)")
GEOMETRY = {f"{part}{axis}" for part in ("pos", "axis") for axis in "xyz"} | {"spin-dir", "type"}
OUTPUT = {"disarmed", "min", "max", "failsafe", "function"}
ITEM = {"label", "name", "function", "index-offset", "show-as", "advanced", "identifier"}


def table(kind: AirframeKind) -> tuple[ParameterDefinition, ...]:
    return get_flavour("px4", kind).parameter_definitions()


def keys(entry: Mapping[str, Any], required: set[str], optional: Collection[str] = ()) -> None:
    assert required <= set(entry) <= required | set(optional), entry


def values(entry: Mapping[str, Any]) -> None:
    keys(entry, {"min", "max"}, {"default", "default-is-nan", "reversible"})
    assert -1 <= entry["min"] < entry["max"] <= 1
    assert ("default" in entry) is not entry.get("default-is-nan", False)


@pytest.mark.parametrize("kind", KINDS)
def test_the_schema_is_kept(kind: AirframeKind) -> None:
    """actuators.schema.json, version 1: which keys there must be, and which there may be."""
    metadata = actuator_metadata(table(kind))
    keys(metadata, {"version", "outputs_v1", "functions_v1", "mixer_v1"})
    assert metadata["version"] == 1
    for output in metadata["outputs_v1"]:
        keys(output, {"label", "subgroups"})
        for group in output["subgroups"]:
            keys(group, {"per-channel-parameters", "channels"})
            for channel in group["channels"]:
                keys(channel, {"label", "param-index"})
            for item in group["per-channel-parameters"]:
                keys(item, {"label", "name"}, ITEM)
                assert item.get("function", "function") in OUTPUT
    for number, function in metadata["functions_v1"].items():
        assert number.isdigit()
        keys(function, {"label"})
    mixer = metadata["mixer_v1"]
    keys(mixer, {"actuator-types", "config"})
    keys(mixer["actuator-types"]["DEFAULT"], {"values"})
    for name, entry in mixer["actuator-types"].items():
        values(entry["values"])
        if name != "DEFAULT":
            keys(
                entry,
                {"values", "function-min", "function-max"},
                {"label-index-offset", "per-item-parameters"},
            )
    for geometry in mixer["config"]:
        keys(geometry, {"actuators"}, {"option", "type"})
        assert CONDITION.fullmatch(geometry["option"])
        assert geometry.get("type", "multirotor") == "multirotor"
        for group in geometry["actuators"]:
            keys(group, {"group-label", "count", "actuator-type", "per-item-parameters"}, {"required"})
            assert group["actuator-type"] in mixer["actuator-types"]
            for item in group["per-item-parameters"]:
                keys(item, {"label", "name"}, ITEM)
                assert item.get("function", "type") in GEOMETRY


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_true_of_the_vehicle(kind: AirframeKind) -> None:
    """All parameters are there, and every actuator has an output."""
    definitions = {definition.name: definition for definition in table(kind)}
    metadata = actuator_metadata(table(kind))
    (subgroup,) = metadata["outputs_v1"][0]["subgroups"]
    (geometry,) = metadata["mixer_v1"]["config"]
    airframe = geometry["option"].removeprefix("CA_AIRFRAME==")
    assert int(airframe) == definitions["CA_AIRFRAME"].default
    named = [
        (item["name"], channel["param-index"])
        for item in subgroup["per-channel-parameters"]
        for channel in subgroup["channels"]
    ]
    wanted = set()
    for group in geometry["actuators"]:
        named += [
            (item["name"], index) for item in group["per-item-parameters"] for index in range(group["count"])
        ]
        first = metadata["mixer_v1"]["actuator-types"][group["actuator-type"]]["function-min"]
        wanted |= {first + index for index in range(group["count"])}
    assert not {name.replace("${i}", str(index)) for name, index in named} - set(definitions)
    assert definitions["CA_ROTOR_COUNT"].default == geometry["actuators"][0]["count"]
    outputs = [int(definitions[f"PWM_MAIN_FUNC{number}"].default) for number in range(1, 9)]
    assert {function for function in outputs if function} == wanted
    assert set(outputs) <= set(FUNCTIONS)


def test_choices_are_reported_with_the_parameters() -> None:
    entries: Any = parameter_metadata(table(AirframeKind.MULTICOPTER))["parameters"]
    by_name = {entry["name"]: entry for entry in entries}
    reported = {choice["value"]: choice["description"] for choice in by_name["PWM_MAIN_FUNC1"]["values"]}
    assert reported == FUNCTIONS
    assert reported[101] == "Motor 1" and reported[208] == "Servo 8"
    assert "values" not in by_name["MPC_XY_CRUISE"]


@pytest.mark.parametrize("kind", KINDS)
def test_parameters_are_described_in_their_own_words(kind: AirframeKind) -> None:
    """parameter.schema.json: shortDesc is the description where there is one, else the name."""
    entries = {entry["name"]: entry for entry in parameter_metadata(table(kind))["parameters"]}  # type: ignore[attr-defined]
    assert len(entries) == len(table(kind))
    for definition in table(kind):
        assert entries[definition.name]["shortDesc"] == (definition.description or definition.name)
    assert any(definition.description for definition in table(kind))
