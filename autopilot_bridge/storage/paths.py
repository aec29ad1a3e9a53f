"""Paths in requests of clients, split into unambiguous names.

A path is untrusted bytes from a link: the result has no `..`, no empty name, no control
character and no byte that is not UTF-8, or `OSError` is raised. No file is accessed here.
"""

import errno
import os
from typing import Final

VehiclePath = tuple[str, ...]
"""Names from the root on; the root is empty."""

MAX_NAME_BYTES: Final = 127
MAX_DEPTH: Final = 16
_FORBIDDEN: Final = frozenset('\\:*?"<>|')  # as on the FAT of a real card; one separates names on Windows


def error(number: int, path: VehiclePath = ()) -> OSError:
    """An `OSError` of the system's own class for this errno (FileNotFoundError and so on)."""
    return OSError(number, os.strerror(number), "/" + "/".join(path))


def parse_path(data: bytes) -> VehiclePath:
    """The names in a path of a request, up to its first NUL.

    Raises:
        OSError: EILSEQ not UTF-8 or with control characters, EACCES for `..`, ENAMETOOLONG a name or a depth
            beyond the limits.
    """
    try:
        text = data.split(b"\0", 1)[0].decode("utf-8")
    except UnicodeDecodeError:
        raise error(errno.EILSEQ) from None
    if not text.isprintable():
        raise error(errno.EILSEQ)
    names = tuple(name for name in text.split("/") if name not in ("", "."))
    if ".." in names:
        raise error(errno.EACCES)
    if len(names) > MAX_DEPTH or any(len(name.encode()) > MAX_NAME_BYTES for name in names):
        raise error(errno.ENAMETOOLONG)
    return names


def check_names(path: VehiclePath) -> VehiclePath:
    """`path`, if a memory card can store it: no characters that FAT forbids.

    Raises:
        OSError: EINVAL for such a character.
    """
    for name in path:
        if not _FORBIDDEN.isdisjoint(name) or name.rstrip(". ") == "":
            raise error(errno.EINVAL, path)
    return path
