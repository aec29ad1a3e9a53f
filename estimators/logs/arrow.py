"""Tables of a log as columns for other tools, and as Arrow tables whose fields know their units."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from estimators.logs.table import Table
from flightsim.foundation.packages import required

if TYPE_CHECKING:
    import pyarrow as pa

_UNITS_IN_NAMES: Final[Mapping[str, Mapping[str, str]]] = {
    "ms": {"ms": "s"},
    "us": {"us": "s", "usec": "s"},
    "mm": {"mm": "m"},
    "%": {"pct": "fraction"},
    "rpm": {"rpm": "rad_s"},
}
"""How the names of MAVLink's fields end with their unit, and with which they end in SI, by the unit."""


@dataclass(frozen=True, slots=True)
class ExportedColumn:
    """A column of a table for other tools.

    Attributes:
        field: field of the message; "" for a time of the log.
        unit: unit of the values; "" for plain numbers and texts.
        values: (n,), or (n, length) for arrays.
    """

    field: str
    unit: str
    values: NDArray[Any]


def exported_columns(table: Table, *, si: bool) -> dict[str, ExportedColumn]:
    """A table's columns by name, times first.

    Args:
        table: messages of one component.
        si: SI units and radians in place of wire values. A name that has the unit of the wire value gets that
            of the new one: `time_boot_ms` becomes `time_boot_s`.
    """
    columns = {
        "time_us": ExportedColumn("", "us", table.time_us),
        "log_time_us": ExportedColumn("", "us", table.log_time_us),
    }
    for field in table.fields:
        values, unit = table[field], table.units.get(field, "")
        name = field
        if si and unit and values.dtype.kind != "S":
            name, values, unit = name_in_si(field, unit), table.si(field), table.si_unit(field)
        while name in columns:  # a field with the name of a time column
            name += "_"
        columns[name] = ExportedColumn(field, unit, values)
    return columns


def name_in_si(field: str, unit: str) -> str:
    """The name of a field whose value is converted to SI: where it ends with the wire unit, with the new one.

    Args:
        field: name in the definition, "time_boot_ms".
        unit: unit of the wire value.
    """
    for written, in_si in _UNITS_IN_NAMES.get(unit, {}).items():
        if field == written:
            return in_si
        if field.endswith(f"_{written}"):
            return f"{field.removesuffix(written)}{in_si}"
    return field


def arrow_table(table: Table, *, si: bool) -> "pa.Table":
    """A table with its columns, times first, as an Arrow table.

    The metadata of a field has its `unit`, that of the table `message`, `system_id` and `component_id`.

    Args:
        table: messages of one component.
        si: SI units and radians in place of wire values.
    """
    pa = required("pyarrow", "an Arrow table")

    arrays: list[Any] = []
    fields = []
    for name, exported in exported_columns(table, si=si).items():
        column, unit = exported.values, exported.unit
        if column.dtype.kind == "S":
            array = pa.array([item.decode("ascii", "replace") for item in column.tolist()], type=pa.string())
        elif column.ndim == 2:
            values = pa.array(np.ascontiguousarray(column).reshape(-1))
            array = pa.FixedSizeListArray.from_arrays(values, column.shape[1])
        else:
            array = pa.array(np.ascontiguousarray(column))
        arrays.append(array)
        fields.append(pa.field(name, array.type, metadata={"unit": unit} if unit else None))
    about = {
        "message": table.name,
        "system_id": str(table.system_id),
        "component_id": str(table.component_id),
    }
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=about))


def arrow_of_columns(parts: Sequence[Mapping[str, NDArray[Any]]]) -> "pa.Table":
    """Parts with the same columns, one below the other, as an Arrow table."""
    pa = required("pyarrow", "an Arrow table")

    return pa.concat_tables([pa.table(dict(part)) for part in parts])
