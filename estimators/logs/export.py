"""Exports logs to the formats of other tools: Parquet, CSV, NumPy's npz, MCAP."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from estimators.errors import LogError
from estimators.logs.arrow import ExportedColumn, arrow_table, exported_columns, name_in_si
from estimators.logs.iterate import Selection, messages_in_order
from estimators.logs.log import Log
from estimators.logs.new_file import new_file
from estimators.logs.table import Table
from estimators.logs.units import to_si
from estimators.messages import SOURCE_FIELDS
from estimators.user_choices import ExportFormat
from flightsim.foundation.packages import required

FORMATS: Final = tuple(
    map(str, (ExportFormat.CSV, ExportFormat.PARQUET, ExportFormat.NPZ, ExportFormat.MCAP))
)
"""csv, parquet: a folder with a file for each message and component; npz, mcap: one file."""


def export(
    log: Log, selections: Sequence[Selection], path: Path, form: str, *, si: bool = False
) -> list[Path]:
    """Write a selection of a log.

    Every row has `time_us` (vehicle time) and `log_time_us` (Unix microseconds; 0: not known).

    Args:
        log: an open log.
        selections: from `Log.select`.
        path: the folder (csv, parquet) or file (npz, mcap); existing files are not overwritten.
        form: one of `FORMATS`.
        si: SI units and radians in place of wire values.

    Returns:
        The paths of the written files.

    Raises:
        LogError: nothing is selected, the format is not known, or a file exists or can't be written.
    """
    writer = _WRITERS.get(form)
    if writer is None:
        raise LogError(f"no export to {form!r}; accepted: {', '.join(FORMATS)}")
    if not selections:
        raise LogError(f"nothing of {log.path} is selected; choose other messages, sources or conditions")
    return writer(log, selections, path, si)


def _name(table: Table) -> str:
    return f"{table.name}_{table.system_id}_{table.component_id}"


def _tables(log: Log, selections: Sequence[Selection]) -> list[Table]:
    return [log.stream_table(stream).select(rows) for stream, rows in selections]


def _csv_columns(columns: Mapping[str, ExportedColumn]) -> dict[str, Any]:
    """Columns under headings with their units ("vx [cm/s]", where the name does not have it), arrays as one
    column per element: controls_0, controls_1, ...
    """
    flat: dict[str, Any] = {}
    for name, column in columns.items():
        said = not column.unit or name.endswith(f"_{column.unit}")
        unit = "" if said else f" [{column.unit}]"
        values = column.values
        if values.dtype.kind == "S":
            flat[f"{name}{unit}"] = [item.decode("ascii", "replace") for item in values.tolist()]
        elif values.ndim == 2:
            flat |= {f"{name}_{index}{unit}": values[:, index] for index in range(values.shape[1])}
        else:
            flat[f"{name}{unit}"] = np.ascontiguousarray(values)
    return flat


def _new_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True)
    except FileExistsError as error:
        if not path.is_dir() or any(path.iterdir()):
            raise LogError(f"{path} exists and nothing is overwritten; choose another path") from error
    except OSError as error:
        raise LogError(f"can't make {path}: {error.strerror}; check the folder") from error


def _parquet(log: Log, selections: Sequence[Selection], path: Path, si: bool) -> list[Path]:
    parquet = required("pyarrow.parquet", "a Parquet file")
    _new_folder(path)
    written = []
    for table in _tables(log, selections):
        file = path / f"{_name(table)}.parquet"
        with new_file(file) as part:
            parquet.write_table(arrow_table(table, si=si), part)
        written.append(file)
    return written


def _csv(log: Log, selections: Sequence[Selection], path: Path, si: bool) -> list[Path]:
    pa, csv = required("pyarrow", "a CSV file"), required("pyarrow.csv")
    _new_folder(path)
    written = []
    for table in _tables(log, selections):
        file = path / f"{_name(table)}.csv"
        with new_file(file) as part:
            csv.write_csv(pa.table(_csv_columns(exported_columns(table, si=si))), part)
        written.append(file)
    return written


def _npz(log: Log, selections: Sequence[Selection], path: Path, si: bool) -> list[Path]:
    arrays: dict[str, Any] = {
        f"{_name(table)}/{name}": column.values
        for table in _tables(log, selections)
        for name, column in exported_columns(table, si=si).items()
    }
    with new_file(path) as part, open(part, "wb") as file:
        np.savez_compressed(file, **arrays)
    return [path]


def _mcap(log: Log, selections: Sequence[Selection], path: Path, si: bool) -> list[Path]:
    writer_module = required("mcap.writer", "an MCAP file")
    with new_file(path) as part, open(part, "wb") as file:
        writer = writer_module.Writer(file)
        writer.start(profile="", library="flightstack")
        write_mcap_messages(writer, log, selections, si=si)
        writer.finish()
    return [path]


def write_mcap_messages(writer: Any, log: Log, selections: Sequence[Selection], *, si: bool) -> None:
    """Write messages of a log as JSON with a schema for each kind.

    Args:
        writer: a started `mcap.writer.Writer`.
        log, selections, si: as for `export`.
    """
    channels = {}
    in_si: dict[tuple[str, int, int], dict[str, tuple[str, float]]] = {}
    for stream, _ in selections:
        units = stream.description.units
        converted = {field: to_si(unit) for field, unit in units.items()} if si else {}
        in_si[stream.name, stream.system_id, stream.component_id] = names = {
            field: (name_in_si(field, units[field]), factor) for field, (factor, _) in converted.items()
        }
        schema = {
            "title": stream.name,
            "type": "object",
            "properties": {
                names.get(field.name, (field.name, 1.0))[0]: _json_type(
                    field.code,
                    field.length,
                    converted[field.name][1] if field.name in converted else units.get(field.name, ""),
                    whole=field.name not in converted,
                )
                for field in stream.description.definition.wire_fields
            },
        }
        prefix = "mavlink_si" if si else "mavlink"
        number = writer.register_schema(
            name=f"{prefix}.{stream.name}", encoding="jsonschema", data=json.dumps(schema).encode()
        )
        channels[stream.name, stream.system_id, stream.component_id] = writer.register_channel(
            topic=f"/{stream.system_id}/{stream.component_id}/{stream.name}",
            message_encoding="json",
            schema_id=number,
        )
    counts = dict.fromkeys(channels, 0)
    log_times = _log_times(log, selections)
    for (time_us, message), log_time_us in zip(
        messages_in_order(log.source, selections), log_times, strict=True
    ):
        key = message.name, message.src_system, message.src_component
        fields = {
            name.rstrip("_"): _plain(value)
            for name, value in zip(message._fields, message, strict=True)
            if name not in SOURCE_FIELDS
        }
        for name, (name_of_si, factor) in in_si[key].items():
            fields[name_of_si] = _scaled(fields.pop(name), factor)
        writer.add_message(
            channel_id=channels[key],
            log_time=_nanoseconds(log_time_us or time_us),
            publish_time=_nanoseconds(time_us),
            sequence=counts[key],
            data=json.dumps(fields).encode(),
        )
        counts[key] += 1


def _log_times(log: Log, selections: Sequence[Selection]) -> list[int]:
    order = np.sort(np.concatenate([np.asarray(stream.order[rows], np.int64) for stream, rows in selections]))
    times: list[int] = log.source.log_time_us(order).tolist()
    return times


def _nanoseconds(time_us: int) -> int:
    """Nanoseconds, limited to the format's 64 bits, because damaged time stamps can have any value."""
    return min(max(time_us, 0) * 1000, (1 << 64) - 1)


def _json_type(code: str, length: int, unit: str, *, whole: bool) -> dict[str, Any]:
    """JSON schema of a field; its unit is the description, because JSON schema has no keyword for it."""
    if code == "s":
        return {"type": "string"}
    element: dict[str, Any] = {"type": "number" if code in "fd" or not whole else "integer"}
    made = {"type": "array", "items": element} if length else element
    return made | ({"description": unit} if unit else {})


def _scaled(value: Any, factor: float) -> Any:
    """A value, or the elements of an array, in SI units; null is kept."""
    if isinstance(value, list):
        return [_scaled(item, factor) for item in value]
    return value * factor if isinstance(value, (int, float)) else value


def _plain(value: Any) -> Any:
    """Replace NaN and infinity, which JSON does not have, by null."""
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return [_plain(item) for item in value] if isinstance(value, tuple) else value


_WRITERS: Final[Mapping[str, Callable[[Log, Sequence[Selection], Path, bool], list[Path]]]] = {
    "csv": _csv,
    "parquet": _parquet,
    "npz": _npz,
    "mcap": _mcap,
}
