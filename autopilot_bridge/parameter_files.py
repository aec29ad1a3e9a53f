"""Parameter files: QGroundControl's `.params` and the `.parm` of MAVProxy, ArduPilot and Mission Planner.

`.params`: vehicle id, component id, name, value, MAV_PARAM_TYPE, separated by tabs. `.parm` (also `.param`):
name and value, separated by spaces, a comma or `=`. In both, `#` starts a comment. The form of a line
identifies the format.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from autopilot_bridge.parameters import MAX_NAME_LENGTH, ParameterDefinition, ParameterError
from flightsim.foundation.file_content import FileError, read_text

QGC_SUFFIX: Final = ".params"
MAVPROXY_SUFFIXES: Final = (".parm", ".param")
_QGC_COLUMNS: Final = 5
_FORMS: Final = "'NAME VALUE' or QGroundControl's five columns 'vehicle component NAME VALUE type'"


def parse_untyped_parameters(text: str, *, source: str = "parameters") -> dict[str, float]:
    """The values in the text of a parameter file, in either format; the vehicle checks them itself.

    Args:
        text: the file's content.
        source: name of the file, for error messages.

    Raises:
        ParameterError: a line is not understood, a name is too long or given twice, a value is not a finite
            number.
    """
    values: dict[str, float] = {}
    for where, name, value_text in _entries(text, source):
        if len(name) > MAX_NAME_LENGTH or not name.isascii():
            raise ParameterError(
                f"{where}: name {name[:60]!r}; accepted: up to {MAX_NAME_LENGTH} ASCII characters"
            )
        try:
            values[name] = float(value_text)
        except ValueError:
            values[name] = math.nan
        if not math.isfinite(values[name]):
            raise ParameterError(f"{where}: '{name} {value_text[:60]}': accepted is a finite number")
    return values


def read_untyped_parameter_file(path: Path) -> dict[str, float]:
    """The values in a parameter file; see `parse_untyped_parameters`.

    Raises:
        ParameterError: the file can't be read, or its content is not acceptable.
    """
    return parse_untyped_parameters(_read(path), source=f"parameter file {path}")


def known_parameters(
    values: Mapping[str, float], definitions: Iterable[ParameterDefinition]
) -> tuple[dict[str, float], tuple[str, ...]]:
    """The values of parameters that a vehicle has, and the names that it does not have, in the file's order.

    Raises:
        ParameterError: values that the vehicle does not accept, all in one message.
    """
    by_name = {definition.name: definition for definition in definitions}
    known = {name: value for name, value in values.items() if name in by_name}
    refused = []
    for name, value in known.items():
        try:
            by_name[name].check_range(by_name[name].convert(value))
        except ParameterError as error:
            refused.append(str(error))
    if refused:
        raise ParameterError("; ".join(refused))
    return known, tuple(name for name in values if name not in known)


def left_out(names: Sequence[str], shown: int | None = None) -> str:
    """The names of a file that were not set, in one sentence.

    Args:
        names: the names.
        shown: number of names that are listed; None: all.
    """
    listed = ", ".join(names if shown is None else names[:shown])
    more = "" if shown is None or len(names) <= shown else f" and {len(names) - shown} more"
    what = "1 parameter is" if len(names) == 1 else f"{len(names)} parameters are"
    return f"{what} not set, because the vehicle has none of that name: {listed}{more}"


def format_mavproxy(values: Mapping[str, float]) -> str:
    """Values as a `.parm` text."""
    return "".join(f"{name:<16} {_text(value)}\n" for name, value in values.items())


def format_qgc(
    values: Mapping[str, float],
    definitions: Iterable[ParameterDefinition],
    *,
    system_id: int = 1,
    component_id: int = 1,
) -> str:
    """Values as a `.params` text; ParameterError for a name without definition."""
    types = {definition.name: int(definition.type) for definition in definitions}
    lines = ["# Onboard parameters\n", "#\n", "# Vehicle-Id Component-Id Name Value Type\n"]
    for name, value in values.items():
        if name not in types:
            raise ParameterError(f"no parameter {name!r}: its type for the file is not known")
        lines.append(f"{system_id}\t{component_id}\t{name}\t{_text(value)}\t{types[name]}\n")
    return "".join(lines)


def _read(path: Path) -> str:
    try:
        return read_text(path, may_be_empty=True)
    except FileError as error:
        raise ParameterError(f"parameter file {error}") from None


def _entries(text: str, source: str) -> Iterator[tuple[str, str, str]]:
    """Location, name and value of each line that has one."""
    lines: dict[str, int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        where = f"{source}, line {number}"
        found = _split(line, where)
        if found is None:
            continue
        name, value = found
        if name in lines:
            raise ParameterError(f"{where}: {name} was set in line {lines[name]} already")
        lines[name] = number
        yield where, name, value


def _split(line: str, where: str) -> tuple[str, str] | None:
    """Name and value in a line; None for an empty one."""
    words = line.partition("#")[0].replace(",", " ").replace("=", " ").split()
    if words and words[-1] == "@READONLY":  # a mark of MAVProxy
        words.pop()
    if not words:
        return None
    if len(words) == _QGC_COLUMNS:
        return words[2], words[3]
    if len(words) == 2:
        return words[0], words[1]
    raise ParameterError(f"{where}: {line.strip()[:60]!r} is not understood; accepted: {_FORMS}")


def _text(value: float) -> str:
    """The shortest decimal that reads back as the same single-precision value."""
    if isinstance(value, int):
        return str(value)
    return str(np.float32(value))
