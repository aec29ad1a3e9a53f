"""Actuators of a fixed-wing description: the table [actuators], and what is taken where it is silent."""

import math
from pathlib import Path
from typing import Any, Final

from flightsim.airframe_types import ActuatorChannel, AirframeError, Role
from flightsim.toml_tables import names_of, number, only, text

# JSBSim's standard pilot's commands: its elevator is positive nose down, its rudder positive nose left.
_STANDARD: Final = (
    ActuatorChannel(role=Role.AILERON, properties=("fcs/aileron-cmd-norm",)),
    ActuatorChannel(role=Role.ELEVATOR, properties=("fcs/elevator-cmd-norm",), scale=-1.0),
    ActuatorChannel(role=Role.THROTTLE, properties=tuple(f"fcs/throttle-cmd-norm[{i}]" for i in range(8))),
    ActuatorChannel(role=Role.RUDDER, properties=("fcs/rudder-cmd-norm",), scale=-1.0),
    ActuatorChannel(role=Role.FLAPS, properties=("fcs/flap-cmd-norm",)),
    ActuatorChannel(role=Role.STEERING, properties=("fcs/steer-cmd-norm",)),
    ActuatorChannel(
        role=Role.BRAKE,
        properties=tuple(f"fcs/{side}-brake-cmd-norm" for side in ("left", "right", "center")),
    ),
)
_RANGE: Final = {role: (0.0, 1.0) for role in (Role.THROTTLE, Role.FLAPS, Role.BRAKE)}
_CHANNEL_KEYS: Final = ("property", "properties", "scale", "offset", "minimum", "maximum", "effectiveness")


def read_channels(table: Any, path: Path) -> tuple[ActuatorChannel, ...]:
    """Actuators of the table [actuators]; a role left out takes the standard properties."""
    if not isinstance(table, dict):
        raise AirframeError(f"{path}: [actuators] is {table!r}; expected is a table")
    only(table, tuple(Role), "roles of [actuators]", path)
    channels: list[ActuatorChannel] = []
    for role in Role:
        value = table.get(role, {})
        if value is False:
            continue
        several = isinstance(value, list) and any(isinstance(item, dict) for item in value)
        channels.extend(_channel(role, item, path) for item in (value if several else [value]))
    return tuple(channels)


def standard_channel(role: Role) -> ActuatorChannel:
    """The properties a role takes where a description names none, as far as the model has them."""
    channel = next(channel for channel in _STANDARD if channel.role is role)
    low, high = _RANGE.get(role, (-1.0, 1.0))
    return ActuatorChannel(
        role=role,
        properties=channel.properties,
        scale=channel.scale,
        minimum=low,
        maximum=high,
        optional=True,
    )


def _channel(role: Role, value: Any, path: Path) -> ActuatorChannel:
    where = f"[actuators] {role}"
    if isinstance(value, str):
        value = {"property": value}
    elif isinstance(value, list):
        value = {"properties": value}
    if not isinstance(value, dict):
        raise AirframeError(
            f"{path}: {where} is {value!r}; expected is a JSBSim property name, a list of them, a "
            f"table (or several) with {', '.join(_CHANNEL_KEYS)}, or false for an aircraft without"
        )
    only(value, _CHANNEL_KEYS, f"keys of {where}", path)
    standard = standard_channel(role)
    names = standard.properties
    if "property" in value:
        names = (text(value, "property", path),)
    elif "properties" in value:
        names = names_of(value, "properties", path)
    given = "property" in value or "properties" in value
    channel = ActuatorChannel(
        role=role,
        properties=names,
        scale=number(value, "scale", path, standard.scale if names == standard.properties else 1.0),
        offset=number(value, "offset", path, 0.0),
        minimum=number(value, "minimum", path, -math.inf if given else standard.minimum),
        maximum=number(value, "maximum", path, math.inf if given else standard.maximum),
        effectiveness=text(value, "effectiveness", path) if "effectiveness" in value else None,
        optional=not given,
    )
    if channel.scale == 0.0 or not channel.minimum < channel.maximum:
        raise AirframeError(
            f"{path}: {where} has scale {channel.scale}, minimum {channel.minimum} and maximum "
            f"{channel.maximum}; accepted are a scale other than 0 and a minimum below the maximum"
        )
    return channel
