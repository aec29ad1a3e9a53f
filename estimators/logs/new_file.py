"""Files that are whole or not there: written under another name, renamed when done, over no other file."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from estimators.logs.errors import LogError


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """The path to write to; what is there when the block ends without an error becomes `path`.

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
    """Give a file its name; a FileExistsError when somebody else was faster, which a rename does not see."""
    try:
        os.link(part, path)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links, such as a memory card's: the name is taken first
        path.open("xb").close()
        part.replace(path)
