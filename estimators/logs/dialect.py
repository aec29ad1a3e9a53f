"""The messages that a log may contain: a pymavlink dialect by name, or a user's own definition file."""

import importlib
import pkgutil
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Final

import pymavlink.dialects.v20

from autopilot_bridge.mavlink import DEFINITIONS, MAVLinkMessage, MessageDefinition
from autopilot_bridge.mavlink.definitions import define, define_class
from autopilot_bridge.mavlink.missing_messages import MESSAGES
from estimators.errors import LogError
from estimators.logs.xml_definitions import FieldText, MessageText, read_definitions
from estimators.messages import Message, message_class

DEFAULT_DIALECT: Final = "all"


@dataclass(frozen=True, slots=True)
class Description:
    """A message of a dialect.

    Attributes:
        definition: layout on the wire.
        units: units of the fields that have one, as in the definition files.
        instance_field: the field that identifies one of several similar devices; None for most messages.
        made: class of its messages, see `estimators.messages`.
    """

    definition: MessageDefinition
    units: Mapping[str, str]
    instance_field: str | None
    made: type[Message]

    @property
    def name(self) -> str:
        """Name of the message."""
        return self.definition.name


@dataclass(frozen=True, slots=True)
class Dialect:
    """Messages by id.

    Attributes:
        name: name of pymavlink's dialect, or the path of the definition file.
        messages: descriptions by message id, in the order of the ids.
    """

    name: str
    messages: Mapping[int, Description]

    def find(self, name: str) -> Description:
        """The description of a message by its name, in any case.

        Raises:
            LogError: the dialect has no such message.
        """
        wanted = name.strip()
        # tables of other formats have lower-case letters in their names
        for same in (wanted, wanted.upper()):
            for item in self.messages.values():
                if item.name == same:
                    return item
        raise LogError(
            f"no message {name!r} in dialect '{self.name}'; give a name such as ATTITUDE, or another dialect"
        )


def dialect_names() -> tuple[str, ...]:
    """Names of pymavlink's dialects."""
    return tuple(sorted(item.name for item in pkgutil.iter_modules(pymavlink.dialects.v20.__path__)))


def load_dialect(name: str | Path | None = None) -> Dialect:
    """Load a dialect.

    Args:
        name: one of `dialect_names`, or the path of an XML definition file, whose includes are read too (one
            of `dialect_names`, such as common.xml, need not exist as a file); None: every message of
            MAVLink's public definitions.

    Raises:
        LogError: the dialect does not exist, or the file can't be read or is not a definition file.
    """
    text = DEFAULT_DIALECT if name is None else str(name)
    if isinstance(name, Path) or re.search(r"[/\\]|\.xml$", text, re.IGNORECASE):
        return Dialect(text, _of_file(Path(text)))
    if text not in dialect_names():
        raise LogError(
            f"no MAVLink dialect {text!r}; accepted: {', '.join(dialect_names())}, "
            "or the path of an .xml definition file"
        )
    return _pymavlink_dialect(text)


def _of_file(path: Path) -> Mapping[int, Description]:
    """Messages of a file; its own messages precede those of the pymavlink dialects that it includes."""
    messages, named = read_definitions(path, dialect_names())
    included = {number: item for name in named for number, item in _pymavlink_dialect(name).messages.items()}
    both = {**included, **_described(str(path), (_from_text(item) for item in messages))}
    return MappingProxyType(dict(sorted(both.items())))


@cache
def _pymavlink_dialect(name: str) -> Dialect:
    module = importlib.import_module(f"pymavlink.dialects.v20.{name}")
    classes = {**(MESSAGES if name == DEFAULT_DIALECT else {}), **module.mavlink_map}
    return Dialect(name, _described(name, (_from_class(item) for item in classes.values())))


def _described(
    name: str, items: Iterable[tuple[MessageDefinition, Mapping[str, str], str | None]]
) -> Mapping[int, Description]:
    found = {}
    for made, units, instance_field in sorted(items, key=lambda item: item[0].message_id):
        known = DEFINITIONS.get(made.message_id)
        # An identical layout is the same message, so that links and logs share one class of messages.
        same = known if known is not None and _layout(known) == _layout(made) else made
        try:
            message = message_class(same)
        except ValueError as error:  # a field name that a named tuple does not accept
            raise LogError(f"dialect {name}: message {made.name}: {error}; rename it") from error
        found[made.message_id] = Description(same, MappingProxyType(dict(units)), instance_field, message)
    return MappingProxyType(found)


def describe(number: int, name: str, fields: Sequence[FieldText], units: Mapping[str, str]) -> Description:
    """Description of a table of another log format, which is not a MAVLink message.

    Args:
        number: a negative number in place of a message id.
        name: name of the table.
        fields: in the order of the file.
        units: units of the fields that have one.
    """
    definition = define(
        message_id=number,
        name=name,
        crc_extra=0,
        field_names=tuple(field.name for field in fields),
        wire_fields=_wire(fields),
    )
    return Description(definition, MappingProxyType(dict(units)), None, message_class(definition))


def _layout(found: MessageDefinition) -> tuple[object, ...]:
    return found.name, found.crc_extra, found.field_names, found.wire_fields


def _from_class(made: type[MAVLinkMessage]) -> tuple[MessageDefinition, Mapping[str, str], str | None]:
    return define_class(made), made.fieldunits_by_name, made.instance_field


def _from_text(item: MessageText) -> tuple[MessageDefinition, Mapping[str, str], str | None]:
    definition = define(
        message_id=item.message_id,
        name=item.name,
        crc_extra=item.crc_extra,
        field_names=tuple(field.name for field in item.fields),
        wire_fields=_wire(item.wire_order),
    )
    units = {field.name: field.units for field in item.fields if field.units}
    return definition, units, next((field.name for field in item.fields if field.instance), None)


def _wire(fields: Iterable[FieldText]) -> list[tuple[str, str, int]]:
    return [(field.name, field.type, field.length) for field in fields]
