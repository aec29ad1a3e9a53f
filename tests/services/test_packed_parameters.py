"""ArduPilot's packed parameters, byte by byte as AP_Filesystem/README.md describes them."""

import struct

import pytest

from autopilot_bridge.firmware.ardupilot import packed_parameters as packed
from autopilot_bridge.firmware.ardupilot.copter.parameters import ARDUPILOT_PARAMETERS
from autopilot_bridge.parameters import ParameterError, ParameterStore, ParameterType

TYPES = {ParameterType.INT8: 1, ParameterType.INT16: 2, ParameterType.INT32: 3, ParameterType.REAL32: 4}
FORMATS = {1: "<b", 2: "<h", 3: "<i", 4: "<f"}


def store() -> ParameterStore:
    """A vehicle with one changed value."""
    made = ParameterStore(ARDUPILOT_PARAMETERS)
    made.set("WPNAV_SPEED", 750.0)
    return made


def read(data: bytes) -> list[tuple[str, int, float, float | None]]:
    """(name, type, value, default) of every parameter, as a client reads them."""
    at, before, found = 6, "", []
    while at < len(data):
        kind, flags = data[at] & 15, data[at] >> 4
        shared, length = data[at + 1] & 15, (data[at + 1] >> 4) + 1
        name = before[:shared] + data[at + 2 : at + 2 + length].decode()
        at += 2 + length
        size = struct.calcsize(FORMATS[kind])
        (value,) = struct.unpack_from(FORMATS[kind], data, at)
        at += size
        default = None
        if flags & 1:
            (default,) = struct.unpack_from(FORMATS[kind], data, at)
            at += size
        assert flags in (0, 1)
        found.append((name, kind, value, default))
        before = name
    return found


def test_every_parameter_has_its_type_and_the_least_bytes_of_its_name() -> None:
    made = store()
    data = packed.pack(made, {})
    assert struct.unpack("<HHH", data[:6]) == (0x671B, made.count, made.count)
    found = read(data)
    assert [name for name, *_ in found] == sorted(definition.name for definition in made.definitions)
    types = {definition.name: TYPES[definition.type] for definition in made.definitions}
    assert {name: (kind, value) for name, kind, value, _ in found} == {
        name: (types[name], pytest.approx(made.get(name))) for name in types
    }
    assert all(default is None for *_, default in found)


def test_names_share_up_to_15_letters_and_never_all() -> None:
    at, before = 6, ""
    data = packed.pack(store(), {})
    for name, kind, *_ in read(data):
        shared, length = data[at + 1] & 15, (data[at + 1] >> 4) + 1
        common = 0
        while common < min(len(name) - 1, len(before)) and name[common] == before[common]:
            common += 1
        assert (shared, length) == (min(common, 15), len(name) - min(common, 15))
        at += 2 + length + struct.calcsize(FORMATS[kind])
        before = name
    assert at == len(data)


def test_defaults_are_written_where_the_value_differs() -> None:
    data = packed.pack(store(), {"withdefaults": "1"})
    assert struct.unpack("<H", data[:2]) == (0x671C,)
    assert {name: default for name, _, _, default in read(data) if default is not None} == {
        "WPNAV_SPEED": 1000.0
    }
    assert packed.pack(store(), {"withdefaults": "0"}) == packed.pack(store(), {})


@pytest.mark.parametrize(
    ("query", "first", "count"),
    [
        ({"start": "3", "count": "2"}, 3, 2),
        ({"count": "1"}, 0, 1),
        ({"start": "0", "count": "0"}, 0, None),
        ({"start": "999999"}, 0, 0),
        ({"start": "x", "count": "-1"}, 0, None),
        ({"start": "1000000000", "count": "999999999"}, 0, None),  # more than nine digits count as zero
        ({"start": "³"}, 0, None),
    ],
)
def test_a_query_selects_a_part(query: dict[str, str], first: int, count: int | None) -> None:
    made = store()
    names = sorted(definition.name for definition in made.definitions)
    count = made.count if count is None else count
    data = packed.pack(made, query)
    assert struct.unpack("<HH", data[2:6]) == (count, made.count)
    assert [name for name, *_ in read(data)] == names[first : first + count]


HEAD = struct.pack("<HHH", 0x671B, 2, 2)


def record(name: bytes, value: float, kind: int = 4, *, shared: int = 0, flags: int = 0) -> bytes:
    head = bytes((kind | flags << 4, shared | (len(name) - 1) << 4))
    return head + name + struct.pack(FORMATS[kind], value)


@pytest.mark.parametrize(
    ("records", "values"),
    [
        (b"", {}),
        (record(b"AB", 1.5), {"AB": 1.5}),
        (b"\0\0" + record(b"AB", 1.5) + b"\0", {"AB": 1.5}),  # padding
        (record(b"ABC", -3, 1) + record(b"D", 4000, 2, shared=2), {"ABC": -3.0, "ABD": 4000.0}),
        (
            record(b"AB", 70_000, 3, flags=1) + struct.pack("<i", 5) + record(b"C", 1.0),
            {"AB": 70_000, "C": 1},
        ),
        (record(b"AB", 1.5) + record(b"C", 2.5, shared=2), {"AB": 1.5, "ABC": 2.5}),
    ],
)
@pytest.mark.parametrize("magic", [0x671B, 0x671C])
def test_a_clients_file_is_read(records: bytes, values: dict[str, float], magic: int) -> None:
    assert packed.unpack(struct.pack("<HHH", magic, 2, 2) + records) == values


@pytest.mark.parametrize(
    "data",
    [
        b"",
        HEAD[:5],
        struct.pack("<HHH", 0x671D, 0, 0),
        HEAD + b"\x04",
        HEAD + record(b"AB", 1.5)[:-1],
        HEAD + record(b"AB", 1.5, flags=1),  # its default is missing
        HEAD + b"\x05" + record(b"AB", 1.5)[1:],
        HEAD + record(b"AB", 1.5) + record(b"C", 1.0, shared=3),
    ],
)
def test_a_damaged_file_is_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match=r"packed parameters|byte \d+"):
        packed.unpack(data)


def test_a_file_is_applied_as_a_whole_beyond_the_documented_ranges() -> None:
    made = store()
    packed.apply(made, HEAD + record(b"WPNAV_SPEED", 900.0) + record(b"LOIT_SPEED", 9e4))
    assert (made.get("WPNAV_SPEED"), made.get("LOIT_SPEED")) == (900.0, 9e4)
    with pytest.raises(ParameterError, match="NO_SUCH"):
        packed.apply(made, HEAD + record(b"WPNAV_SPEED", 800.0) + record(b"NO_SUCH", 1.0))
    assert made.get("WPNAV_SPEED") == 900.0
