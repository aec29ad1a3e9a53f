"""Compiled kernels with a persistent cache that cannot go stale.

Numba's own `njit(cache=True)` notices changes of the function's own file only. Constants, array layouts and
kernels taken from other modules are frozen into the machine code, so an edit there would go unseen. Here the
cache file of a kernel is named after everything that went into it.
"""

import hashlib
import os
import pickle
import types
import uuid
from collections.abc import Callable, Iterator
from contextlib import suppress
from enum import Enum
from pathlib import Path
from typing import Any, Final, TypeVar

import numba
import numpy as np
from numba.extending import is_jitted

try:
    from numba.core.serialize import dumps
except ImportError:  # Numba's internals have moved: its own cache serves then
    dumps = None

__all__ = ["compiled_for", "kernel", "source_stamp"]

Function = TypeVar("Function", bound=Callable[..., Any])

_PLAIN: Final = (bool, int, float, complex, str, bytes, type(None), slice, range, np.generic, np.dtype)
_STAMP_DIGITS: Final = 16


def kernel(function: Function) -> Function:
    """Compile a function with `numba.njit` on first use and keep the machine code from run to run.

    The code lies beside the module, or in the user's cache folder where that is not writable; where neither
    is, every process compiles anew. Any number of processes may compile at the same time.
    """
    try:
        dispatcher = numba.njit(cache=True)(function)
    except RuntimeError:  # Numba found no folder to write to
        return numba.njit(function)
    cache = getattr(dispatcher, "_cache", None)
    folder = getattr(cache, "cache_path", None)
    base = getattr(getattr(cache, "_impl", None), "filename_base", None)
    if cache is not None and dumps and folder and base and hasattr(cache, "_cache_file"):
        cache._cache_file = _CacheFile(Path(folder), base, function)
    return dispatcher


def compiled_for(function: Function, *arguments: object) -> Function:
    """The machine code of a kernel for arguments of the same types as these.

    A kernel looks at the type of every argument of every call, which costs as much as a small kernel's own
    work. This is for calls at the physics rate whose arguments are always the same arrays: what it returns
    takes the caller's word for it that an array has the element type, dimensions and layout of the example.
    A function that is no kernel is returned as it is.
    """
    if not is_jitted(function):
        return function
    code: Function = function.compile(tuple(map(numba.typeof, arguments)))  # type: ignore[attr-defined]
    return code


def source_stamp(function: Callable[..., Any]) -> str:
    """Digest of all that the machine code of a function is made of, the same in every process.

    These are its byte code, the values of the globals and module attributes it names, and, in the same way,
    the kernels it calls; also the version of Numba.

    Raises:
        TypeError: a global that the function names is of a kind that cannot be told apart by its value.
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for part in _parts(function, set()):
        digest.update(part.encode())
        digest.update(b"\0")
    return digest.hexdigest()[:_STAMP_DIGITS]


def _parts(function: Callable[..., Any], seen: set[int]) -> Iterator[str]:
    code: types.CodeType = function.__code__
    if id(code) in seen:
        return
    seen.add(id(code))
    names: set[str] = set()
    yield from _code_parts(code, names)
    yield repr(function.__defaults__)
    scope = function.__globals__
    for name in sorted(names & scope.keys()):
        yield name
        value = scope[name]
        if isinstance(value, types.ModuleType):
            attributes = vars(value)
            for attribute in sorted(names & attributes.keys()):
                yield attribute
                yield from _value_parts(attributes[attribute], f"{name}.{attribute}", function, seen)
        else:
            yield from _value_parts(value, name, function, seen)
    for name, cell in zip(code.co_freevars, function.__closure__ or (), strict=True):
        yield from _value_parts(cell.cell_contents, name, function, seen)


def _code_parts(code: types.CodeType, names: set[str]) -> Iterator[str]:
    names.update(code.co_names)
    yield code.co_code.hex()
    yield repr((code.co_names, code.co_varnames, code.co_freevars, code.co_argcount))
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):  # a comprehension or an inner function
            yield from _code_parts(constant, names)
        elif isinstance(constant, frozenset):  # its order changes from process to process
            yield repr(sorted(map(repr, constant)))
        else:
            yield repr(constant)


def _value_parts(value: object, name: str, function: Callable[..., Any], seen: set[int]) -> Iterator[str]:
    yield type(value).__name__
    if is_jitted(value):
        yield from _parts(value.py_func, seen)  # type: ignore[attr-defined]  # is_jitted tells
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape} {value.tobytes().hex()}"
    elif isinstance(value, tuple):
        for item in value:
            yield from _value_parts(item, name, function, seen)
    elif isinstance(value, types.ModuleType):
        yield value.__name__
    elif isinstance(value, (*_PLAIN, Enum)):
        yield repr(value)
    elif callable(value):  # a built-in or library function or a type: changes with its library only
        yield str(getattr(value, "__qualname__", getattr(value, "__name__", "")))
    else:
        raise TypeError(
            f"kernel {function.__module__}.{function.__qualname__} names {name}, a {type(value).__name__}; "
            "accepted: numbers, strings, slices, tuples, arrays, enumerations, modules, functions"
        )


class _CacheFile:
    """What Numba's cache asks of its files, with one file for each kernel, stamp, signature and processor.

    A file is written whole, under another name, and then renamed: whoever reads finds all of it or none. Its
    name says what it holds, so processes that run different versions of the sources do not read each other's.
    """

    def __init__(self, folder: Path, base: str, function: Callable[..., Any]) -> None:
        self._folder = folder
        self._base = base
        self._function = function

    def load(self, key: object) -> Any:
        """What was saved under the key, or None."""
        try:
            return pickle.loads(self._path(key).read_bytes())
        except (OSError, EOFError, pickle.UnpicklingError):
            return None

    def save(self, key: object, data: object) -> None:
        """Keep the data and drop what older sources left behind; a full disk is no obstacle to flying."""
        path = self._path(key)
        part = path.with_name(f"{path.name}.tmp.{uuid.uuid4().hex[:16]}")
        with suppress(OSError):
            try:
                part.write_bytes(dumps(data))
                os.replace(part, path)
            finally:
                part.unlink(missing_ok=True)
            self._remove(keep=path.name.split(".")[-3])

    def flush(self) -> None:
        """Forget everything."""
        with suppress(OSError):
            self._remove(keep=None)

    def _path(self, key: object) -> Path:
        # The stamp is taken on use, not at definition: by then every name that the kernel uses is there.
        signature = hashlib.sha256(repr(key).encode()).hexdigest()[:_STAMP_DIGITS]
        return self._folder / f"{self._base}.{source_stamp(self._function)}.{signature}.nbc"

    def _remove(self, *, keep: str | None) -> None:
        for old in self._folder.glob(f"{self._base}.*.nbc"):
            if keep is None or old.name.split(".")[-3] != keep:
                old.unlink(missing_ok=True)
