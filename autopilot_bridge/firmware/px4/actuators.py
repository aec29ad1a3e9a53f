"""PX4's outputs as reported to ground stations: the function of each, and the place of its actuator.

The JSON of COMP_METADATA_TYPE_ACTUATORS, made from the vehicle's parameters. QGroundControl's actuator page
shows and tests these outputs.

Source: MAVLink's schema `actuators.schema.json` (version 1); PX4 1.16, `output_functions.yaml` and the
control allocator's `module.yaml`.
"""

from collections.abc import Collection, Mapping
from typing import Any, Final

from autopilot_bridge.firmware.data import load_data
from autopilot_bridge.parameters import ParameterDefinition

FUNCTIONS: Final[Mapping[int, str]] = {
    0: "Disabled",
    1: "Constant Min",
    2: "Constant Max",
    **{101 + number: f"Motor {number + 1}" for number in range(12)},
    **{201 + number: f"Servo {number + 1}" for number in range(8)},
    **{301 + number: f"Peripheral via Actuator Set {number + 1}" for number in range(6)},
}
"""Values of PWM_MAIN_FUNCn; MAV_CMD_ACTUATOR_TEST names them with 1000 added."""

_AIRFRAMES: Final[Mapping[int, str]] = {0: "Multirotor", 1: "Fixed-wing"}
_SURFACES: Final[Mapping[int, str]] = dict(enumerate(load_data("px4", "texts.toml")["surfaces"]))
_MULTIROTOR: Final = 0


def choices(name: str) -> Mapping[int, str]:
    """What the values of a parameter mean; empty for a parameter that is no choice."""
    if name.startswith("PWM_MAIN_FUNC"):
        return FUNCTIONS
    if name.startswith("CA_SV_CS") and name.endswith("_TYPE"):
        return _SURFACES
    return _AIRFRAMES if name == "CA_AIRFRAME" else {}


def actuator_metadata(parameters: tuple[ParameterDefinition, ...]) -> dict[str, Any]:
    """The JSON.

    Args:
        parameters: the vehicle's table, with CA_AIRFRAME, CA_ROTORn_PX and PWM_MAIN_FUNCn.
    """
    names = {definition.name for definition in parameters}
    airframe = next(round(each.default) for each in parameters if each.name == "CA_AIRFRAME")
    return {
        "version": 1,
        "outputs_v1": [_outputs(names)],
        "functions_v1": {str(number): {"label": label} for number, label in FUNCTIONS.items()},
        "mixer_v1": {"actuator-types": _types(), "config": [_geometry(airframe, names)]},
    }


def _outputs(names: Collection[str]) -> dict[str, Any]:
    count = _count("PWM_MAIN_FUNC{}", 1, names)
    return {
        "label": "PWM MAIN",
        "subgroups": [
            {
                "per-channel-parameters": [
                    {"label": "Function", "name": "PWM_MAIN_FUNC${i}", "function": "function"},
                    {
                        "label": "Rev Range\n(for Servos)",
                        "name": "PWM_MAIN_REV",
                        "index-offset": -1,
                        "show-as": "bitset",
                    },
                ],
                "channels": [
                    {"label": f"MAIN {number}", "param-index": number} for number in range(1, count + 1)
                ],
            }
        ],
    }


def _types() -> dict[str, Any]:
    return {
        "DEFAULT": {"values": {"min": -1, "max": 1, "default": -1}},
        "motor": {
            "label-index-offset": 1,
            "function-min": 101,
            "function-max": 112,
            "values": {"min": 0, "max": 1, "default-is-nan": True, "reversible": True},
            "per-item-parameters": [
                {"label": "Bidirectional", "name": "CA_R_REV", "show-as": "bitset", "advanced": True}
            ],
        },
        "servo": {
            "label-index-offset": 1,
            "function-min": 201,
            "function-max": 208,
            "values": {"min": -1, "max": 1, "default": 0},
        },
    }


def _geometry(airframe: int, names: Collection[str]) -> dict[str, Any]:
    """How many actuators there are is fixed: the vehicle has those it has."""
    motors = {
        "actuator-type": "motor",
        "group-label": "Motors",
        "required": True,
        "count": _count("CA_ROTOR{}_PX", 0, names),
        "per-item-parameters": _shown(
            names,
            {"label": "Position X", "function": "posx", "name": "CA_ROTOR${i}_PX"},
            {"label": "Position Y", "function": "posy", "name": "CA_ROTOR${i}_PY"},
            {"label": "Position Z", "function": "posz", "name": "CA_ROTOR${i}_PZ", "advanced": True},
            {
                "label": "Direction CCW",
                "function": "spin-dir",
                "name": "CA_ROTOR${i}_KM",
                "show-as": "true-if-positive",
            },
        ),
    }
    geometry: dict[str, Any] = {"option": f"CA_AIRFRAME=={airframe}", "actuators": [motors]}
    if airframe == _MULTIROTOR:
        return {**geometry, "type": "multirotor"}
    geometry["actuators"].append(
        {
            "actuator-type": "servo",
            "group-label": "Control Surfaces",
            "required": True,
            "count": _count("CA_SV_CS{}_TYPE", 0, names),
            "per-item-parameters": _shown(
                names,
                {"label": "Type", "function": "type", "name": "CA_SV_CS${i}_TYPE"},
                {"label": "Roll Torque", "name": "CA_SV_CS${i}_TRQ_R"},
                {"label": "Pitch Torque", "name": "CA_SV_CS${i}_TRQ_P"},
                {"label": "Yaw Torque", "name": "CA_SV_CS${i}_TRQ_Y"},
            ),
        }
    )
    return geometry


def _shown(names: Collection[str], *parameters: dict[str, Any]) -> list[dict[str, Any]]:
    """Those that the first actuator has; so have the others."""
    return [each for each in parameters if each["name"].replace("${i}", "0") in names]


def _count(pattern: str, first: int, names: Collection[str]) -> int:
    """How many there are, numbered from `first`."""
    number = first
    while pattern.format(number) in names:
        number += 1
    return number - first
