"""What a file is, before a reader takes it.

Every reader of the project opens its files here, or looks here first and hands the path to its library. So a
pipe, an archive, a web page or a pointer in place of a file is named in the same words everywhere, and no
reader waits for a pipe or reads without a limit.
"""

import os
import re
import stat
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

from flightsim.foundation.operating_system import READ_AT_ONCE

__all__ = [
    "HEAD_BYTES",
    "TEXT_BYTES",
    "XZ",
    "ZIP",
    "FileError",
    "decoded",
    "file_head",
    "open_file",
    "read_file",
    "read_text",
]

TEXT_BYTES: Final = 8 << 20
"""Limit of the size of a text that a person or a ground station writes: plans, parameters, settings."""

HEAD_BYTES: Final = 8192
"""Bytes of a file from which its kind is recognised."""


@dataclass(frozen=True, slots=True)
class _Packed:
    """A file that contains others: the bytes that it has at an offset, and how to get at its content."""

    name: str
    magic: bytes
    advice: str
    offset: int = 0


ZIP: Final = "a ZIP archive"
XZ: Final = "compressed with xz"
_PACKED: Final = (
    _Packed("compressed with gzip", b"\x1f\x8b", "unpack it with gunzip"),
    _Packed(ZIP, b"PK\x03\x04", "unpack it with unzip"),
    _Packed(ZIP, b"PK\x05\x06", "it has no file in it"),
    _Packed(XZ, b"\xfd7zXZ\x00", "unpack it with unxz"),
    _Packed("compressed with bzip2", b"BZh", "unpack it with bunzip2"),
    _Packed("compressed with zstd", b"\x28\xb5\x2f\xfd", "unpack it with unzstd"),
    _Packed("a 7z archive", b"7z\xbc\xaf\x27\x1c", "unpack it with 7z"),
    _Packed("a RAR archive", b"Rar!\x1a\x07", "unpack it with unrar"),
    _Packed("a tar archive", b"ustar", "unpack it with tar", 257),
)
_LFS: Final = b"version https://git-lfs.github.com/spec/"
_LFS_SIZE: Final = re.compile(rb"^size (\d{1,18})$", re.MULTILINE)
_ANNEX: Final = b"/annex/objects/"
_HTML: Final = (b"<!doctype html", b"<html")
_UTF_16: Final = (b"\xff\xfe", b"\xfe\xff")
_UTF_8_MARK: Final = b"\xef\xbb\xbf"
_KINDS: Final = (
    (stat.S_ISDIR, "a directory"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


class FileError(ValueError):
    """A file that can't be read as what it was given for.

    Attributes:
        reason: why, without the path.
    """

    def __init__(self, path: Path | str, reason: str) -> None:
        super().__init__(f"{path} can't be read: {reason}")
        self.reason = reason


def open_file(
    path: Path | str,
    *,
    max_bytes: int | None = None,
    accepted: Collection[str] = (),
    may_be_empty: bool = False,
) -> BinaryIO:
    """Open a regular file that has content.

    Args:
        path: the file.
        max_bytes: limit of its size; None: none, because it is mapped or read in parts.
        accepted: what it may be of the files that are named here: `ZIP`, `XZ`.
        may_be_empty: whether a file without content is one of its kind.

    Raises:
        FileError: it can't be opened, is no regular file, is empty or too large, or is another kind of file
            than any reader here reads.
    """
    try:
        descriptor = os.open(path, READ_AT_ONCE)  # fstat rules out pipes afterwards
    except OSError as error:
        raise FileError(path, _kind_of(path) or error.strerror or str(error)) from None
    except ValueError as error:  # a null character in the path
        raise FileError(path, str(error)) from None
    if kind := _kind(os.fstat(descriptor)):
        os.close(descriptor)
        raise FileError(path, kind)
    file = os.fdopen(descriptor, "rb")
    try:
        _check(path, file, max_bytes, accepted, may_be_empty)
    except FileError:
        file.close()
        raise
    return file


def file_head(path: Path | str, *, max_bytes: int | None = None, accepted: Collection[str] = ()) -> bytes:
    """The first `HEAD_BYTES` of a file that a library is going to read; arguments as of `open_file`.

    Raises:
        FileError: as `open_file`.
    """
    with open_file(path, max_bytes=max_bytes, accepted=accepted) as file:
        return _read(path, file, HEAD_BYTES)


def read_file(path: Path | str, *, max_bytes: int, may_be_empty: bool = False) -> bytes:
    """The content of a file; arguments as of `open_file`.

    Raises:
        FileError: as `open_file`.
    """
    with open_file(path, max_bytes=max_bytes, may_be_empty=may_be_empty) as file:
        return _read(path, file, max_bytes)


def read_text(path: Path | str, *, max_bytes: int = TEXT_BYTES, may_be_empty: bool = False) -> str:
    """The content of a file of text in UTF-8; a byte order mark is left out.

    Raises:
        FileError: as `open_file`, or it is not text in UTF-8.
    """
    return decoded(path, read_file(path, max_bytes=max_bytes, may_be_empty=may_be_empty))


def decoded(path: Path | str, data: bytes) -> str:
    """Bytes of a file of text as text; a byte order mark is left out.

    Raises:
        FileError: they are not text in UTF-8.
    """
    if data.startswith(_UTF_16):
        raise FileError(path, "it is text in UTF-16; save it as UTF-8")
    try:
        return data.removeprefix(_UTF_8_MARK).decode("utf-8")
    except UnicodeDecodeError as error:
        raise FileError(path, f"it is not text (byte {error.start} is not UTF-8)") from None


def _check(
    path: Path | str, file: BinaryIO, max_bytes: int | None, accepted: Collection[str], may_be_empty: bool
) -> None:
    size_bytes = os.fstat(file.fileno()).st_size
    if not (size_bytes or may_be_empty):
        raise FileError(path, "it is empty")
    if max_bytes is not None and size_bytes > max_bytes:
        raise FileError(path, f"it has {size_bytes} bytes; accepted are up to {max_bytes}")
    if other := _other_content(_read(path, file, HEAD_BYTES), accepted):
        raise FileError(path, other)
    file.seek(0)


def _read(path: Path | str, file: BinaryIO, size: int) -> bytes:
    try:
        return file.read(size)
    except OSError as error:
        raise FileError(path, error.strerror or str(error)) from None


def _kind_of(path: Path | str) -> str:
    """What a path is that is no regular file; "": it is one, or there is none."""
    try:
        return _kind(os.stat(path))
    except OSError:
        return ""


def _kind(status: os.stat_result) -> str:
    return next(
        (f"it is {name}; give a regular file" for is_one, name in _KINDS if is_one(status.st_mode)), ""
    )


def _other_content(head: bytes, accepted: Collection[str]) -> str:
    """What the beginning of a file shows it to be, if no reader reads that; else ""."""
    for packed in _PACKED:
        if packed.name not in accepted and head[packed.offset :].startswith(packed.magic):
            return f"it is {packed.name}; {packed.advice}"
    if head.startswith(_LFS):
        size = _LFS_SIZE.search(head)
        of = f" of {int(size[1])} bytes" if size else ""
        return f"it is a Git LFS pointer to a file{of}; get the file with `git lfs pull`"
    if head.startswith(_ANNEX):
        return "it is a git-annex pointer; get the file with `git annex get`"
    text = head.removeprefix(_UTF_8_MARK).lstrip().lower()
    if text.startswith(_HTML) or (text.startswith(b"<?xml") and any(mark in text[:512] for mark in _HTML)):
        return "it is a web page (HTML), not the file that the page offers; download that one"
    return ""
