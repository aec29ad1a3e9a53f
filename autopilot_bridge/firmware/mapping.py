"""Typed parameters from a firmware's named ones: tables of (field, name, factor) in a `mapping.toml`.

    [fields.flight]                              # of one parameter class
    cruise_speed_m_s = "MPC_XY_CRUISE"           # the field and the firmware's parameter that sets it
    yaw_rate_max_rad_s = "MPC_YAWRAUTO_MAX deg"  # with its unit, where it is not that of the field
    [ratios.navigation]
    EKF2_REQ_GPS_H = ["gps_check_time_s"]        # fields that are scaled with the parameter
    [actions]
    GF_ACTION = { 0 = "NONE", 1 = "WARN" }       # the failsafe action of each value

Defaults and limits are those of the parameter table (`parameters.toml`).
"""

import math
from collections.abc import Iterable, Mapping
from typing import Any, Final, NamedTuple, TypeVar

from autopilot_bridge.commander.events import FailsafeAction
from autopilot_bridge.firmware.data import load_data
from autopilot_bridge.parameters import ParameterDefinition, ParameterStore

T = TypeVar("T")

_LEAST_RATIO: Final = 0.05  # a filter with too small sensor noise diverges
_GREATEST_RATIO: Final = 100.0

_FACTORS: Final[Mapping[str, float]] = {
    "": 1.0,
    "percent": 0.01,
    "deg": math.radians(1.0),
    "-deg": -math.radians(1.0),
    "cdeg": math.radians(0.01),
    "cm": 0.01,
    "ds": 0.1,
    "ms": 1e-3,
    "us": 1e-6,
    "surface_angle": 4.0 / math.pi,  # ArduPlane's rate loops give the surface as an angle, 45 deg being full
    "load_factor": 2.2,  # energy rate per load factor: n^2 - 1 = 2.2 (n - 1), about n = 1.2
}
"""Field / parameter, by the unit of the parameter (centimetres also of cm/s and cm/s^2)."""


class FieldMap(NamedTuple):
    """One field of a parameter class and the firmware parameter that sets it.

    Attributes:
        field: name in the parameter class.
        name: the firmware's name.
        factor: field = parameter x factor (centimetres, degrees, milliseconds).
    """

    field: str
    name: str
    factor: float = 1.0


class RatioMap(NamedTuple):
    """Fields that follow a firmware parameter relative to its default: when it doubles, they double.

    Attributes:
        fields: names in the parameter class.
        name: the firmware's name.
    """

    fields: tuple[str, ...]
    name: str


class Tables(NamedTuple):
    """The tables of one class of vehicle of a firmware.

    Attributes:
        fields: fields of a parameter class, by a name of the class.
        ratios: fields that follow parameters relative to their defaults, by a name of the class.
        actions: failsafe actions by the value of a parameter, by its name.
    """

    fields: Mapping[str, tuple[FieldMap, ...]]
    ratios: Mapping[str, tuple[RatioMap, ...]]
    actions: Mapping[str, Mapping[int, FailsafeAction]]


def load_tables(package: str) -> Tables:
    """The tables in the `mapping.toml` of a package of this one: `load_tables("px4.copter")`."""
    data = load_data(package, "mapping.toml")
    return Tables(
        fields={
            group: tuple(_field_map(field, source) for field, source in table.items())
            for group, table in data["fields"].items()
        },
        ratios={
            group: tuple(RatioMap(tuple(names), name) for name, names in table.items())
            for group, table in data["ratios"].items()
        },
        actions={
            name: {int(value): FailsafeAction[action] for value, action in table.items()}
            for name, table in data["actions"].items()
        },
    )


def _field_map(field: str, source: str) -> FieldMap:
    name, _, unit = source.partition(" ")
    return FieldMap(field, name, _FACTORS[unit])


def scaled_values(tuned: object, store: ParameterStore, table: Iterable[RatioMap]) -> dict[str, float]:
    """Fields of `tuned` scaled by what the parameters of the store are of their firmware's defaults."""
    values: dict[str, float] = {}
    for entry in table:
        definition = store.find(entry.name)
        if definition is None:
            continue
        default = definition.convert(definition.default)  # single precision, as the value is
        ratio = clamp(store.get(entry.name) / default, _LEAST_RATIO, _GREATEST_RATIO)
        if ratio == 1.0:
            continue
        for field in entry.fields:
            values[field] = getattr(tuned, field) * ratio
    return values


def field_values(store: ParameterStore, table: Iterable[FieldMap]) -> dict[str, float]:
    """Field values of every mapped parameter that the store has, within what the vehicle acts on."""
    return {entry.field: store.limited(entry.name) * entry.factor for entry in table if entry.name in store}


def build(cls: type[T], store: ParameterStore, table: Iterable[FieldMap], **fixed: Any) -> T:
    """An instance of a parameter class: mapped fields from the store, `fixed` ones, defaults for the rest."""
    return cls(**{**field_values(store, table), **fixed})


def airframe_overrides(
    tuned: object, table: Iterable[FieldMap], definitions: Iterable[ParameterDefinition]
) -> dict[str, float]:
    """Parameters whose defaults differ from the `tuned` values of a parameter class, with those values.

    As an airframe file of the firmware: with these settings the mapping gives the tuned values, within the
    firmware's ranges.
    """
    known = {definition.name: definition for definition in definitions}
    overrides = {}
    for entry in table:
        definition = known.get(entry.name)
        if definition is None:
            continue
        low = -math.inf if definition.minimum is None else definition.minimum
        high = math.inf if definition.maximum is None else definition.maximum
        value = clamp(getattr(tuned, entry.field) / entry.factor, low, high)
        if definition.is_integer:
            value = round(value)
        if not math.isclose(value, definition.default, rel_tol=1e-5, abs_tol=1e-9):
            overrides[entry.name] = value
    return overrides


def number(store: ParameterStore, name: str, default: float) -> float:
    """Value of a parameter as it is stored, or `default` where the firmware has none of that name."""
    return store.get(name) if name in store else default


def integer(store: ParameterStore, name: str, default: int | None = None) -> int:
    """Value of a parameter as it is stored, as a whole number.

    Args:
        default: value where the firmware has no parameter of that name; None: every table has it.

    Raises:
        ParameterError: unknown name without a `default`.
    """
    return int(store.get(name) if default is None else number(store, name, default))


def clamp(value: float, low: float, high: float) -> float:
    """`value` within low..high."""
    return min(high, max(low, value))
