"""TOML, JSON and XML of files that others have written, within bounds of size, depth and numbers.

The parsers of the standard library raise RecursionError for deep nesting and pass on integers that no float
can hold. Here each such document is refused with one reason, as a damaged one is.
"""

import json
import re
import tomllib
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree
from xml.parsers import expat

from flightsim.foundation.file_content import TEXT_BYTES, FileError, read_file, read_text

__all__ = ["excerpt", "read_json", "read_toml", "read_xml"]

_DEEPEST: Final = 100
"""Levels of nesting; files of ground stations have 8, JSBSim's aircraft 20."""

_TOML_BYTES: Final = 1 << 19
_LONG_KEY: Final = re.compile(r"""(?<![\w-])(?>(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){100}""")
"""A dotted key of more than 100 parts: tomllib keeps all beginnings of a key, gigabytes for a long one."""

_LARGEST_WHOLE: Final = 1 << 63
_LONGEST_TEXT: Final = 1000
_EXCERPT: Final = 60
_TOO_DEEP: Final = "it is nested too deep"
_TOO_LARGE: Final = "is larger than any number here"


def read_toml(path: Path | str) -> dict[str, Any]:
    """The content of a TOML file.

    Raises:
        FileError: it can't be read, is not TOML, is nested too deep, or has a text that is too long for what
            these files name: paths, models and choices.
    """
    text = read_text(path, max_bytes=_TOML_BYTES, may_be_empty=True)
    if _LONG_KEY.search(text):
        raise FileError(path, _TOO_DEEP)
    try:
        found = tomllib.loads(text)
    except RecursionError:
        raise FileError(path, _TOO_DEEP) from None
    except ValueError as error:  # TOMLDecodeError, and integers of more digits than Python converts
        raise FileError(path, f"it is not TOML: {error}") from None
    _check(path, found, longest=_LONGEST_TEXT)
    return found


def read_json(path: Path | str) -> Any:
    """The content of a JSON file.

    Raises:
        FileError: it can't be read, is not JSON, or is nested too deep.
    """
    text = read_text(path)
    try:
        found = json.loads(text)
    except RecursionError:
        raise FileError(path, _TOO_DEEP) from None
    except json.JSONDecodeError as error:
        raise FileError(path, f"it is not JSON: line {error.lineno}: {error.msg}") from None
    except ValueError:  # an integer of more digits than Python converts
        raise FileError(path, f"a number in it {_TOO_LARGE}") from None
    _check(path, found)
    return found


def read_xml(path: Path | str) -> "ElementTree.ElementTree[ElementTree.Element]":
    """The content of an XML file. (expat bounds what entities may expand to.)

    Raises:
        FileError: it can't be read, is not XML, or is nested too deep.
    """
    data = read_file(path, max_bytes=TEXT_BYTES)
    builder = _Builder(path)
    parser = ElementTree.XMLParser(target=builder)
    try:
        parser.feed(data)
        root = parser.close()
    except (ElementTree.ParseError, expat.ExpatError, ValueError, LookupError) as error:
        if isinstance(error, FileError):
            raise
        raise FileError(path, f"it is not XML: {error}") from None
    return ElementTree.ElementTree(root)


class _Builder(ElementTree.TreeBuilder):
    """Makes the elements, and stops where they are nested too deep."""

    def __init__(self, path: Path | str) -> None:
        super().__init__()
        self._path, self._depth = path, 0

    def start(self, tag: Any, attrs: Any, /) -> ElementTree.Element:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise FileError(self._path, _TOO_DEEP)
        return super().start(tag, attrs)

    def end(self, tag: Any, /) -> ElementTree.Element:
        self._depth -= 1
        return super().end(tag)


def excerpt(value: object) -> str:
    """The beginning of a value, for messages about it."""
    text = repr(value)
    return text if len(text) <= _EXCERPT else f"{text[:_EXCERPT]}..."


def _check(path: Path | str, found: Any, *, longest: int | None = None) -> None:
    """Refuse deep nesting, whole numbers that are no float, and texts that are too long."""
    level = [found]
    for _ in range(_DEEPEST):
        inner: list[Any] = []
        for value in level:
            if isinstance(value, dict):
                inner += value.values() if longest is None else (*value, *value.values())
            elif isinstance(value, list):
                inner += value
            elif isinstance(value, int) and abs(value) >= _LARGEST_WHOLE:
                raise FileError(path, f"its number {str(value)[:12]}... {_TOO_LARGE}")
            elif isinstance(value, str) and longest is not None and len(value) > longest:
                raise FileError(
                    path, f"its text {excerpt(value)} has {len(value)} characters; accepted are {longest}"
                )
        level = inner
    if level:
        raise FileError(path, _TOO_DEEP)
