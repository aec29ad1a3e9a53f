"""Definition files of MAVLink (XML): the messages, with all that is needed to decode them.

No code is executed or generated from the file; enumerations are ignored. The order on the wire and CRC_EXTRA
are computed as in the MAVLink guide, "Serialization" (field reordering, CRC_EXTRA calculation).
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from fastcrc.crc16 import mcrf4xx

from estimators.errors import LogError
from flightsim.foundation.documents import read_xml
from flightsim.foundation.file_content import FileError

TYPE_SIZES: Final = {
    "char": 1,
    "uint8_t": 1,
    "int8_t": 1,
    "uint16_t": 2,
    "int16_t": 2,
    "uint32_t": 4,
    "int32_t": 4,
    "float": 4,
    "uint64_t": 8,
    "int64_t": 8,
    "double": 8,
}
_MAX_PAYLOAD: Final = 255
_MAX_ID: Final = 0xFFFFFF


@dataclass(frozen=True, slots=True)
class FieldText:
    """A field as in the file.

    Attributes:
        name: field name.
        type: C type of one element.
        length: elements of the array; 0 for a scalar.
        units: "degE7", or "".
        instance: whether it identifies one of several similar devices.
    """

    name: str
    type: str
    length: int
    units: str = ""
    instance: bool = False


@dataclass(frozen=True, slots=True)
class MessageText:
    """A message as in the file.

    Attributes:
        message_id, name: its number and name.
        fields: in the order of the file.
        base_count: number of fields before the extensions.
    """

    message_id: int
    name: str
    fields: tuple[FieldText, ...]
    base_count: int

    @property
    def wire_order(self) -> tuple[FieldText, ...]:
        """Fields in the order on the wire: base fields by descending element size, then the extensions."""
        base = self.fields[: self.base_count]
        return (
            *sorted(base, key=lambda field: TYPE_SIZES[field.type], reverse=True),
            *self.fields[self.base_count :],
        )

    @property
    def crc_extra(self) -> int:
        """The byte by which the checksum depends on the definition."""
        text = bytearray(f"{self.name} ".encode())
        for field in self.wire_order[: self.base_count]:
            text += f"{field.type} {field.name} ".encode()
            if field.length:
                text.append(field.length)
        crc = mcrf4xx(bytes(text))
        return (crc & 0xFF) ^ (crc >> 8)


def read_definitions(
    path: Path, known: Collection[str] = ()
) -> tuple[tuple[MessageText, ...], tuple[str, ...]]:
    """Read all messages of a definition file and of the files that it includes.

    Args:
        path: the file.
        known: names of dialects that need not exist as files: "common".

    Returns:
        The messages, and the known dialects that are included but do not exist as files.

    Raises:
        LogError: a file can't be read or is not a definition file, or two messages have the same id or name.
    """
    messages: list[MessageText] = []
    seen: set[Path] = set()
    waiting = [path]
    named: list[str] = []
    while waiting:
        file = waiting.pop()
        if file != path and file.stem in known and not file.exists():
            named.append(file.stem)
            continue
        if (resolved := file.resolve()) in seen:
            continue
        seen.add(resolved)
        root = _root(file)
        messages.extend(_messages(root, file))
        waiting.extend(file.parent / (item.text or "").strip() for item in root.findall("include"))
    by_id: dict[int, MessageText] = {}
    by_name: dict[str, MessageText] = {}
    for item in messages:
        twin = by_id.setdefault(item.message_id, item)
        namesake = by_name.setdefault(item.name, item)
        if twin is not item or namesake is not item:
            other = twin if twin is not item else namesake
            raise LogError(
                f"{path}: messages {item.name} ({item.message_id}) and {other.name} ({other.message_id}) "
                "clash; each id and each name may be used once"
            )
    if not messages and not named:
        raise LogError(f"{path} defines no message; give a MAVLink definition file")
    return tuple(messages), tuple(named)


def _root(path: Path) -> ElementTree.Element:
    try:
        root = read_xml(path).getroot()
    except FileError as error:
        raise LogError(f"the dialect {error}; give a MAVLink XML file") from None
    if root.tag != "mavlink":
        raise LogError(
            f"{path} is no MAVLink definition file: it begins with <{root.tag}>; expected <mavlink>"
        )
    return root


def _messages(root: ElementTree.Element, path: Path) -> Iterator[MessageText]:
    for element in root.findall("messages/message"):
        name = (element.get("name") or "").strip()
        number = (element.get("id") or "").strip()
        where = f"{path}: message {name[:40] or '?'} ({number[:20] or '?'})"
        if not name.isidentifier() or not number.isdecimal() or int(number) > _MAX_ID:
            raise LogError(f"{where} needs a name and an id in 0..{_MAX_ID}")
        fields: list[FieldText] = []
        base_count: int | None = None
        for child in element:
            if child.tag == "extensions":
                base_count = len(fields)
            elif child.tag == "field":
                fields.append(_field(child, where))
        if len({field.name for field in fields}) < len(fields):
            raise LogError(f"{where} has a field twice")
        size = sum(TYPE_SIZES[field.type] * (field.length or 1) for field in fields)
        if not fields or size > _MAX_PAYLOAD:
            raise LogError(f"{where} has a payload of {size} bytes; accepted: 1 to {_MAX_PAYLOAD}")
        yield MessageText(int(number), name, tuple(fields), len(fields) if base_count is None else base_count)


def _field(element: ElementTree.Element, where: str) -> FieldText:
    name = (element.get("name") or "").strip()
    text = (element.get("type") or "").strip()
    base, bracket, rest = text.partition("[")
    length = 0
    if bracket:
        digits = rest.removesuffix("]")
        length = int(digits) if rest.endswith("]") and digits.isdecimal() else -1
    if base == "uint8_t_mavlink_version":
        base = "uint8_t"
    elif base == "array":
        base = "int8_t"
    elif base not in TYPE_SIZES and f"{base}_t" in TYPE_SIZES:
        base = f"{base}_t"
    if not name.isidentifier() or base not in TYPE_SIZES or not 0 <= length <= _MAX_PAYLOAD:
        raise LogError(
            f"{where}: field {name[:40] or '?'} of type {text[:40]!r}; accepted: {', '.join(TYPE_SIZES)}, "
            "or an array of them such as float[4]"
        )
    return FieldText(name, base, length, element.get("units") or "", element.get("instance") == "true")
