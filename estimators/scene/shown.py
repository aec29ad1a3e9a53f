"""What estimators and missions show, as they show it.

They show a mapping of names to items at a time (`Estimator.shown`, `MissionFlight.shown`). `Showing` compares
it with what they showed before. What has changed is a `Shown`; `placed` makes the entry of it, with what the
messages say about where vehicles and origins are.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from estimators.scene_items import Cleared, Item
from flightsim.foundation.geodesy import GeodeticPosition

__all__ = ["Estimates", "Showing", "Shown", "Subject"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """Who shows something.

    Attributes:
        base: first part of the paths: "mission", "estimators/attitude/1".
        system_id: vehicle whose time and home are those of its items; 0: the timeline of the run, and the
            first vehicle's home.
    """

    base: str
    system_id: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Estimates:
    """Rows of an estimate as an estimator made it; `estimates.items_of` says what they show.

    Attributes:
        columns: names of the values.
        values: (n, columns).
        of_set: the rows are of targets, of which there may be none; else there is one row.
        system_id: of the estimated vehicle; 0: of targets.
    """

    columns: tuple[str, ...]
    values: NDArray[np.float64]
    of_set: bool
    system_id: int

    @property
    def names(self) -> tuple[str, ...]:
        """What tells this estimate from others of its class at the same time: the number of its target."""
        if self.of_set or "target" not in self.columns:
            return ()
        return (f"target_{self.values[0, self.columns.index('target')]:.0f}",)


class Shown(NamedTuple):
    """An item as an estimator or a mission shows it.

    Attributes:
        subject: who shows it.
        name: of the item, from the subject's base.
        time_us: on the clock of the subject.
        origin: of the positions; None: home.
        item: or estimates, whose items have names of their own.
    """

    subject: Subject
    name: str
    time_us: int
    origin: GeodeticPosition | None
    item: Item | Estimates


class Showing:
    """Keeps what one subject shows."""

    def __init__(self, subject: Subject) -> None:
        self._subject = subject
        self._newest: dict[str, Item] = {}

    def changes(
        self, time_us: int, items: Mapping[str, Item], origin: GeodeticPosition | None = None
    ) -> list[Shown]:
        """What is new, has changed, or is shown no more.

        Args:
            time_us: of the items.
            items: by name; the whole of what is shown now.
            origin: of their positions; None: home.
        """
        gone = {name: Cleared() for name in self._newest.keys() - items.keys()}
        changed = {
            name: item
            for name, item in items.items()
            if name not in self._newest or not _same(self._newest[name], item)
        }
        self._newest = dict(items)
        found: dict[str, Item] = {**gone, **changed}
        return [Shown(self._subject, name, time_us, origin, found[name]) for name in sorted(found)]


def _same(a: Any, b: Any) -> bool:
    """Whether two items, or two values of a field, are equal."""
    if a is b:
        return True
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    if is_dataclass(a):
        return all(_same(getattr(a, field.name), getattr(b, field.name)) for field in fields(a))
    return bool(a == b)
