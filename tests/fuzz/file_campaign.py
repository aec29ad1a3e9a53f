"""Feeds damaged files to one reader, in a child process with bounds of memory and processor time.

A reader returns a value, or raises its own error with one line; nothing else may happen.
"""

import json
import os
import resource
import sys
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tests.fuzz.file_mutations import mutants

MEMORY_BYTES: Final = 1 << 30
"""Address space that a reader may reserve beside what the process has."""

_LONGEST_LINE: Final = 1500


@dataclass(frozen=True, slots=True, kw_only=True)
class Reader:
    """A reader of files, and how it may refuse one.

    Attributes:
        suffix: of the file's name.
        seeds: whole files, of which the damaged ones are made.
        read: reads a file.
        errors: its own errors.
        text: whether numbers and words of the file are replaced too.
    """

    suffix: str
    seeds: tuple[bytes, ...]
    read: Callable[[Path], Any]
    errors: tuple[type[Exception], ...]
    text: bool = False


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a campaign found: numbers of files read and refused, and what should not have happened."""

    read: int
    refused: int
    faults: tuple[str, ...]


def campaign(reader: Reader, folder: Path, *, count: int, seed: int, cpu_s: int) -> Outcome:
    """Read whole files, and so many damaged ones.

    Args:
        reader: under test.
        folder: for the files; the last one is kept there.
        count: number of damaged files.
        seed: of the damage.
        cpu_s: processor time after which the reader counts as endless.
    """
    path = folder / f"file{reader.suffix}"
    for whole in reader.seeds:  # also compiles what is compiled at the first use
        path.write_bytes(whole)
        reader.read(path)
    receiving, sending = os.pipe()
    child = os.fork()
    if not child:
        os.close(receiving)
        found: dict[str, Any] = {"faults": ["the campaign itself failed"]}
        try:
            found = _in_child(reader, path, count, seed, cpu_s)
        finally:
            with os.fdopen(sending, "w") as pipe:
                json.dump(found, pipe)
            os._exit(0)
    os.close(sending)
    with os.fdopen(receiving) as pipe:
        text = pipe.read()
    _, status = os.waitpid(child, 0)
    if not text:
        kept = folder / f"fatal{reader.suffix}"
        path.rename(kept)
        return Outcome(0, 0, (f"ended by signal {os.waitstatus_to_exitcode(status)} at {kept}",))
    result = json.loads(text)
    return Outcome(result.get("read", 0), result.get("refused", 0), tuple(result["faults"]))


def _in_child(reader: Reader, path: Path, count: int, seed: int, cpu_s: int) -> dict[str, Any]:
    sys.stderr = open(os.devnull, "w")  # noqa: SIM115  # until the process ends
    size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY_BYTES, size + MEMORY_BYTES))
    used = resource.getrusage(resource.RUSAGE_SELF)
    cpu_s += int(used.ru_utime + used.ru_stime)
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s))
    counts: Counter[str] = Counter()
    faults: list[str] = []
    for number, data in enumerate(mutants(reader.seeds, count, text=reader.text, seed=seed)):
        path.write_bytes(data)
        fault = ""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # they would be lines on the terminal
                reader.read(path)
            counts["read"] += 1
        except reader.errors as error:
            counts["refused"] += 1
            line = str(error)
            if "\n" in line or not line.strip() or len(line) > _LONGEST_LINE:
                fault = f"{type(error).__name__} not of one line: {line[:300]!r}"
        except BaseException as error:  # noqa: BLE001  # whatever it is, it is a fault
            where = traceback.extract_tb(error.__traceback__)[-6:]
            places = " < ".join(f"{Path(f.filename).name}:{f.lineno}" for f in reversed(where))
            fault = f"{type(error).__name__}: {str(error)[:200]} ({places})"
        if fault:
            kept = path.with_name(f"fault{number}{path.suffix}")
            kept.write_bytes(data)
            faults.append(f"{fault} [{kept}]")
    return {"read": counts["read"], "refused": counts["refused"], "faults": faults}
