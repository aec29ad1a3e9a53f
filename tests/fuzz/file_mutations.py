"""Damaged and crafted variants of a file: each a function of the file's bytes and a random generator."""

import random
import re
from collections.abc import Callable, Iterator
from typing import Final

_NUMBER: Final = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_WORD: Final = re.compile(rb'"[^"\n]*"|[A-Za-z_]\w*')
_NUMBERS: Final = (
    *(b"9" * 400, b"-1", b"0", b"1e999", b"nan", b"-inf", b"1e-999", b"4294967296", b"18446744073709551616"),
    *(b"1.5", b"null", b"[]", b"{}", b'"x"', b"true", b"", b"1,2", b"0x10"),
)
_WORDS: Final = (b"null", b"[1]", b"{}", b'""', b"\xff", b"\0", b"x" * 300, b"", b"a.b", b"..", b"<a>", b"&")
_NESTS: Final = (b"[", b"{", b"(", b'{"a":', b"<a>", b"a.", b"- ", b'"')


def _flip(data: bytearray, choose: random.Random) -> None:
    for _ in range(choose.choice((1, 1, 2, 8, 64))):
        data[choose.randrange(len(data))] ^= 1 << choose.randrange(8)


def _overwrite(data: bytearray, choose: random.Random) -> None:
    at, size = choose.randrange(len(data)), choose.choice((1, 2, 4, 8, 64))
    filling = choose.choice((b"\0", b"\xff", b"\x7f", b"\x80", None))
    data[at : at + size] = choose.randbytes(size) if filling is None else filling * size


def _truncate(data: bytearray, choose: random.Random) -> None:
    del data[choose.randrange(len(data)) :]


def _cut_out(data: bytearray, choose: random.Random) -> None:
    at = choose.randrange(len(data))
    del data[at : at + choose.choice((1, 3, 16, 200))]


def _insert(data: bytearray, choose: random.Random) -> None:
    at, size = choose.randrange(len(data) + 1), choose.choice((1, 5, 64, 1000))
    data[at:at] = choose.choice((choose.randbytes(size), bytes(size), bytes(data[at : at + size])))


def _swap(data: bytearray, choose: random.Random) -> None:
    size = choose.choice((1, 8, 100))
    one, other = choose.randrange(len(data)), choose.randrange(len(data))
    data[one : one + size], data[other : other + size] = data[other : other + size], data[one : one + size]


def _number(data: bytearray, choose: random.Random) -> None:
    _replace(data, choose, _NUMBER, _NUMBERS)


def _word(data: bytearray, choose: random.Random) -> None:
    _replace(data, choose, _WORD, _WORDS)


def _nest(data: bytearray, choose: random.Random) -> None:
    at = choose.randrange(len(data) + 1)
    data[at:at] = choose.choice(_NESTS) * choose.choice((1, 20, 200, 20_000))


def _replace(
    data: bytearray, choose: random.Random, pattern: re.Pattern[bytes], values: tuple[bytes, ...]
) -> None:
    found = list(pattern.finditer(bytes(data)))
    if found:
        place = choose.choice(found)
        data[place.start() : place.end()] = choose.choice(values)


_BINARY: Final = (_flip, _flip, _overwrite, _truncate, _cut_out, _insert, _swap)
_TEXT: Final = (*_BINARY, _number, _number, _number, _word, _word, _nest)


def mutants(seeds: tuple[bytes, ...], count: int, *, text: bool, seed: int) -> Iterator[bytes]:
    """Variants of files, always the same for a seed; most have one fault, some have several."""
    choose = random.Random(seed)
    kinds: tuple[Callable[[bytearray, random.Random], None], ...] = _TEXT if text else _BINARY
    for _ in range(count):
        data = bytearray(choose.choice(seeds))
        for _ in range(choose.choice((1, 1, 1, 2, 4))):
            if data:
                choose.choice(kinds)(data, choose)
        yield bytes(data)
