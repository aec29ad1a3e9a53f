"""ArduPilot's packed parameters, `@PARAM/param.pck`: all of them in a tenth of the bytes of a list.

A header (magic number, parameters in the file, parameters in all) and for each parameter: type in the low
half of a byte and flags in the high one (1: the default value follows the value), length of the rest of the
name less one in the high half of the next and the letters it shares with the name before in the low one, the
rest of the name, the value, the default. Zeros between parameters are padding.

Source: ArduPilot 4.6, AP_Filesystem/README.md ("@PARAM/param.pck", "Parameter Format").
"""

import struct
from collections.abc import Mapping
from typing import Final

from autopilot_bridge.parameters import ParameterDefinition, ParameterError, ParameterStore, ParameterType

_HEADER: Final = struct.Struct("<HHH")
_MAGIC: Final = 0x671B
_MAGIC_WITH_DEFAULTS: Final = 0x671C
_HAS_DEFAULT: Final = 1 << 4
_CODES: Final = {
    ParameterType.INT8: (1, struct.Struct("<b")),
    ParameterType.INT16: (2, struct.Struct("<h")),
    ParameterType.INT32: (3, struct.Struct("<i")),
    ParameterType.REAL32: (4, struct.Struct("<f")),
}
_VALUES: Final = dict(_CODES.values())
_MAX_SHARED: Final = 15


def pack(store: ParameterStore, query: Mapping[str, str]) -> bytes:
    """The file for a query: `start` and `count` choose a part, `withdefaults=1` adds the defaults."""
    total = store.count
    start = min(_number(query.get("start", "0")), total)
    count = _number(query.get("count", "0")) or total
    chosen = sorted(store.definitions, key=lambda definition: definition.name)[start : start + count]
    with_defaults = query.get("withdefaults", "0") == "1"
    magic = _MAGIC_WITH_DEFAULTS if with_defaults else _MAGIC
    data = bytearray(_HEADER.pack(magic, len(chosen), total))
    before = ""
    for definition in chosen:
        data += _record(definition, store.get(definition.name), before, with_defaults)
        before = definition.name
    return bytes(data)


def unpack(data: bytes) -> dict[str, float]:
    """Names and values in a file that a client has written.

    Raises:
        ValueError: the data are no such file.
    """
    if len(data) < _HEADER.size or _HEADER.unpack_from(data)[0] not in (_MAGIC, _MAGIC_WITH_DEFAULTS):
        raise ValueError("not packed parameters: no magic number")
    at, before, values = _HEADER.size, "", {}
    while at < len(data):
        if data[at] == 0:
            at += 1
            continue
        if at + 2 > len(data) or data[at] & 0x0F not in _VALUES:
            raise ValueError(f"byte {at}: no parameter begins here")
        value = _VALUES[data[at] & 0x0F]
        default_size = value.size if data[at] & _HAS_DEFAULT else 0
        shared, length = data[at + 1] & 0x0F, (data[at + 1] >> 4) + 1
        end = at + 2 + length + value.size + default_size
        if end > len(data) or shared > len(before):
            raise ValueError(f"byte {at}: a parameter that is cut off")
        name = before[:shared] + data[at + 2 : at + 2 + length].decode("ascii", "replace")
        values[name] = float(value.unpack_from(data, at + 2 + length)[0])
        at, before = end, name
    return values


def apply(store: ParameterStore, data: bytes) -> None:
    """Set the parameters in a file that a client has written, all of them or none.

    Raises:
        ValueError: the data are no such file, or contain a name or a value that the vehicle does not accept.
    """
    values = unpack(data)
    converted: dict[str, float] = {}
    for name, value in values.items():
        definition = store.find(name)
        if definition is None:
            raise ParameterError(f"no parameter {name!r}")
        converted[name] = definition.convert(value)
    for name, value in converted.items():
        store.set(name, value, check_range=False)


def _record(definition: ParameterDefinition, value: float, before: str, with_defaults: bool) -> bytes:
    code, packed = _CODES.get(definition.type, _CODES[ParameterType.REAL32])
    default = definition.convert(definition.default)
    flags = _HAS_DEFAULT if with_defaults and value != default else 0
    name = definition.name
    shared = 0
    while shared < min(len(name) - 1, len(before), _MAX_SHARED) and name[shared] == before[shared]:
        shared += 1
    head = bytes((code | flags, shared | (len(name) - shared - 1) << 4))
    tail = packed.pack(default) if flags else b""
    return head + name[shared:].encode("ascii") + packed.pack(value) + tail


def _number(text: str) -> int:
    return int(text) if text.isascii() and text.isdigit() and len(text) <= 9 else 0
