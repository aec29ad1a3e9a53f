"""The data that a vehicle has reported, for checks that do not depend on how they were received."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import median_high
from types import MappingProxyType
from typing import Any, Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from missions.kind import VehicleKind

Fields = Mapping[str, Any]
"""A message's fields by name, in wire units. Values that are not numbers are None or NaN."""

FILTER_STATUS: Final[Mapping[str, type[MAVLinkMessage]]] = MappingProxyType(
    {"px4": dialect.MAVLink_estimator_status_message, "ardupilot": dialect.MAVLink_ekf_status_report_message}
)
"""By flavour: the message in which the navigation filter reports its state; see `usual`."""


def usual(messages: Sequence[Fields]) -> Fields:
    """The newest of several messages of a filter, with the median of the test ratios of its measurements.

    The ratio of a single measurement is mostly noise (ArduPilot's `ekf_check` and PX4 smooth them as well).

    Args:
        messages: messages of one name, oldest first; at least one.
    """
    newest = messages[-1]
    smoothed = {
        name: median_high([float(fields[name]) for fields in messages])
        for name, value in newest.items()
        if name.endswith(("_variance", "_ratio")) and isinstance(value, int | float)
    }
    return {**newest, **smoothed}


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """The newest data of a vehicle.

    Attributes:
        flavour: "px4" or "ardupilot"; "" for another autopilot.
        kind: class of vehicle; None: one that this program does not fly.
        messages: the autopilot's newest message of each name.
        texts: its status texts, oldest first.
        parameters: the known parameters.
        fence_items: items of the vehicle's geofence; None: not known.
    """

    flavour: str
    kind: VehicleKind | None
    messages: Mapping[str, Fields]
    texts: tuple[str, ...] = ()
    parameters: Mapping[str, float] = field(default_factory=dict)
    fence_items: int | None = None

    def number(self, message: str, name: str) -> float | None:
        """A field of a message; None when the message or the value is missing."""
        value = self.messages.get(message, {}).get(name)
        return value if isinstance(value, int | float) and value == value else None

    def whole(self, message: str, name: str) -> int | None:
        """An integer field of a message; None when the message or the value is missing."""
        value = self.number(message, name)
        return None if value is None else int(value)
