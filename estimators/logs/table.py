"""One message of one component, as columns."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimators.errors import LogError
from estimators.logs.columns import Columns
from estimators.logs.dialect import Description
from estimators.logs.source import LogSource, Positions
from estimators.logs.units import to_si


class Table:
    """Messages of one kind from one component, in the order of the file.

    Attributes:
        name: name of the message.
        system_id, component_id: ids of the sender.
        instance: requested value of the instance field; None: all.
        boot: requested number of the system's boot, from 0; None: all.
        description: definition, units and instance field.
    """

    def __init__(
        self,
        source: LogSource,
        description: Description,
        *,
        system_id: int,
        component_id: int,
        positions: Positions,
        columns: Columns,
        instance: int | str | None = None,
        boot: int | None = None,
    ) -> None:
        self.name = description.name
        self.description = description
        self.system_id = system_id
        self.component_id = component_id
        self.instance = instance
        self.boot = boot
        self._positions = positions
        self.columns = columns
        self._source = source

    def __len__(self) -> int:
        return len(self._positions)

    def __repr__(self) -> str:
        return f"Table({self.name}, from {self.system_id}/{self.component_id}, {len(self)} messages)"

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields, in the order of the definition file."""
        return self.description.definition.field_names

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the wire values, for fields that have one ("degE7")."""
        return self.description.units

    @cached_property
    def order(self) -> NDArray[np.int64]:
        """(n,) position of each message in the log."""
        return self._positions.astype(np.int64)

    @cached_property
    def time_us(self) -> NDArray[np.int64]:
        """(n,) vehicle time."""
        return self._source.time_us[self._positions]

    @cached_property
    def log_time_us(self) -> NDArray[np.int64]:
        """(n,) Unix time of the records; 0 where the log has none."""
        return self._source.log_time_us(self._positions)

    def __contains__(self, field: object) -> bool:
        return field in self.columns

    def __getitem__(self, field: str) -> NDArray[Any]:
        """Wire values of a field: (n,), (n, length) for arrays; strings as bytes ("S").

        Raises:
            LogError: the message has no such field.
        """
        try:
            return self.columns[field]
        except KeyError:
            raise LogError(f"{self.name} has no field {field!r}; it has {', '.join(self.fields)}") from None

    def si(self, field: str) -> NDArray[np.float64]:
        """A field in SI units and radians, float64; see `estimators.logs.units`.

        Raises:
            LogError: the message has no such field, or it is a text.
        """
        values = self[field]
        if values.dtype.kind == "S":
            raise LogError(f"{self.name}.{field} is a text and has no SI value; take it as it is")
        factor, _ = to_si(self.units.get(field, ""))
        with np.errstate(invalid="ignore"):  # of a signalling NaN, which damage makes
            converted = values.astype(np.float64)
        if factor != 1.0:
            converted *= factor
        return converted

    def si_unit(self, field: str) -> str:
        """Unit of the values of `si`: "rad"; "" for plain numbers."""
        return to_si(self.units.get(field, ""))[1]

    def select(self, rows: Any) -> "Table":
        """A table of some of the messages.

        Args:
            rows: mask, slice or ascending indices.
        """
        return Table(
            self._source,
            self.description,
            system_id=self.system_id,
            component_id=self.component_id,
            positions=self._positions[rows],
            columns={name: column[rows] for name, column in self.columns.items()},
            instance=self.instance,
            boot=self.boot,
        )
