"""Files that are complete or absent: written under another name, and renamed when complete."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from estimators.errors import LogError


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Context with a temporary path to write to. When the block ends without an error, that file becomes
    `path`.

    Raises:
        LogError: `path` exists, or can't be written.
    """
    if path.exists():
        raise LogError(f"{path} exists and is not overwritten; choose another path or remove it")
    part = path.with_name(f".{path.name}.part{os.getpid()}")
    try:
        yield part
        _put(part, path)
    except FileExistsError as error:
        raise LogError(f"{path} exists and is not overwritten; choose another path or remove it") from error
    except OSError as error:
        if isinstance(error, LogError):
            raise
        raise LogError(f"can't write {path}: {error.strerror or error}; check the folder") from error
    finally:
        with suppress(OSError):
            part.unlink()


def _put(part: Path, path: Path) -> None:
    """Give a file its final name; raises FileExistsError when another process has created it, which a rename
    would not detect.
    """
    try:
        os.link(part, path)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links, as on a memory card: the name is reserved first
        path.open("xb").close()
        part.replace(path)
