"""Compiled kernels with a persistent cache that cannot go stale.

Numba's own `njit(cache=True)` notices changes of the function's own file only. Constants, array layouts and
kernels taken from other modules are frozen into the machine code, so an edit there would go unseen. Here the
cache file of a kernel is named after everything that went into it.
"""

import hashlib
import os
import pickle
import sys
import types
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from enum import Enum
from functools import cache, partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar, overload

import numba
import numpy as np
from numba.extending import intrinsic, is_jitted

try:  # Numba promises nothing of these; tests/flightsim/foundation/test_kernels.py notices when they move
    from numba.core import cgutils
    from numba.core.imputils import impl_ret_borrowed
    from numba.core.serialize import dumps
    from numba.np.arrayobj import populate_array
except ImportError:  # then Numba's own cache serves, and kernels are called with all their arguments
    dumps = None

if TYPE_CHECKING:
    from filelock import BaseFileLock

Function = TypeVar("Function", bound=Callable[..., Any])
_ErrorModel = Literal["python", "numpy"]

_PLAIN: Final = (bool, int, float, complex, str, bytes, type(None), slice, range, np.generic, np.dtype)
_STAMP_DIGITS: Final = 16
_BLAS: Final = "scipy.linalg.cython_blas"
_TURN_CHECK_S: Final = 0.02
_TURN_S: Final = 60.0  # a process that was stopped while it compiles must not stop all others


@overload
def kernel(function: Function) -> Function: ...


@overload
def kernel(*, error_model: _ErrorModel) -> Callable[[Function], Function]: ...


def kernel(function: Any = None, *, error_model: _ErrorModel = "python") -> Any:
    """Compile a function with `numba.njit` on first use and keep the machine code from run to run.

    The code is stored beside the module, or in the user's cache folder if that place is not writable; if
    neither is writable, every process compiles again. Of several processes that need the same code at once,
    one compiles it and the others wait for it.

    Args:
        function: of Python.
        error_model: of Numba. With "python" a division by zero raises ZeroDivisionError; with "numpy" it
            gives inf or nan, and a loop with divisions can be vectorized.
    """
    if function is None:
        return partial(kernel, error_model=error_model)
    try:
        dispatcher = numba.njit(cache=True, no_cfunc_wrapper=True, error_model=error_model)(function)
    except RuntimeError:  # Numba found no folder to write to
        return numba.njit(error_model=error_model)(function)
    cache = getattr(dispatcher, "_cache", None)
    folder = getattr(cache, "cache_path", None)
    base = getattr(getattr(cache, "_impl", None), "filename_base", None)
    if cache is not None and dumps and folder and base and hasattr(cache, "_cache_file"):
        _keep(dispatcher, _CacheFile(Path(folder), base, function, error_model))
    return dispatcher


def _keep(dispatcher: Any, file: "_CacheFile") -> None:
    """Keep the machine code of a function in this file."""
    cache = dispatcher._cache
    cache._cache_file = file
    cache.load_overload = partial(_load, cache.load_overload, file)
    dispatcher.compile = partial(_compile, dispatcher.compile, file)


@contextmanager
def when_compiling(listener: Callable[[], None]) -> Iterator[None]:
    """Context in which a function is called once, when machine code is not in the cache and this process
    begins to compile it. A later listener replaces one that was not called.
    """
    _listeners[:] = [listener]
    try:
        yield
    finally:
        if listener in _listeners:
            _listeners.remove(listener)


_listeners: Final[list[Callable[[], None]]] = []


def _load(load_overload: Callable[..., Any], file: "_CacheFile", *arguments: Any) -> Any:
    """Machine code from the cache, or None; the first thing that Numba does with a kernel that is used."""
    _import_array_functions()
    found = load_overload(*arguments)
    if found is None and file.begin_turn():  # another process may have compiled it in the meantime
        found = load_overload(*arguments)
    if found is None and _listeners:
        _listeners.pop()()
    return found


def _compile(compile_now: Callable[..., Any], file: "_CacheFile", *arguments: Any) -> Any:
    try:
        return compile_now(*arguments)
    finally:
        file.end_turn()


@cache
def _import_array_functions() -> None:
    """Import Numba's array functions without SciPy's linear algebra, which takes 0.2 s.

    Numba imports it together with them, only to find out whether it is there. It is: this project depends on
    it. Code that calls it imports it again when it is compiled.
    """
    if _BLAS in sys.modules:
        return
    sys.modules[_BLAS] = None  # type: ignore[assignment]  # an import raises an ImportError
    try:
        arraymath = import_module("numba.np.arraymath")
    finally:
        del sys.modules[_BLAS]
    arraymath._HAVE_BLAS = True  # type: ignore[attr-defined]


def compiled_for(function: Function, *arguments: object) -> Function:
    """The machine code of a kernel for arguments of the same types as these.

    A kernel checks the type of every argument at every call, which takes as long as a small kernel's own
    work. This function is for calls at the physics rate whose arguments are always the same arrays: the
    returned function does not check that an array has the element type, dimensions and layout of the example.
    A function that is no kernel is returned unchanged.
    """
    if not is_jitted(function):
        return function
    code: Function = function.compile(tuple(map(numba.typeof, arguments)))  # type: ignore[attr-defined]
    return code


def bound(function: Callable[..., Any], *arguments: object, then: tuple[object, ...] = ()) -> Any:
    """The machine code of a kernel with its first arguments given, once and for all.

    Handing an array to machine code costs as much as a call of a Python function, at every call. Here they
    are handed over once: what is called reads where they lie from a table.

    Args:
        function: a kernel.
        arguments: its first arguments: arrays, whose elements may change later, and numbers, which do not
            change.
        then: examples of the other arguments, at most four, which the caller passes; as in `compiled_for`,
            their types are not checked.
    """
    typed = tuple(map(numba.typeof, arguments))
    entry = _entry(function, typed, len(then)) if is_jitted(function) else None
    if entry is None:
        return partial(compiled_for(function, *arguments, *then), *arguments)
    table = np.array([slot for argument in arguments for slot in _slots(argument)], dtype=np.int64)
    call = partial(entry.compile((numba.intp, *map(numba.typeof, then))), table.ctypes.data)
    call.kept = table, arguments  # type: ignore[attr-defined]  # as long as it may be called
    return call


def _slots(argument: object) -> list[int]:
    """What the machine code needs to know of an argument, in 64-bit words."""
    if isinstance(argument, np.ndarray):
        return [argument.ctypes.data, *argument.shape, *argument.strides]
    return [int(np.array(argument, dtype=np.int64 if isinstance(argument, int) else float).view(np.int64))]


@cache
def _entry(function: Any, typed: tuple[Any, ...], more: int) -> Any:
    """A compiled function that takes the first arguments of a kernel from a table, and so many more as they
    are; None: it can't be kept from run to run."""
    own = getattr(getattr(function, "_cache", None), "_cache_file", None)
    if not isinstance(own, _CacheFile) or not all(map(_fits_table, typed)):
        return None
    take = _taker(typed)

    entry: Callable[..., Any] = (
        lambda address: function(*take(address, ())),
        lambda address, a: function(*take(address, (a,))),
        lambda address, a, b: function(*take(address, (a, b))),
        lambda address, a, b, c: function(*take(address, (a, b, c))),
        lambda address, a, b, c, d: function(*take(address, (a, b, c, d))),
    )[more]
    dispatcher = numba.njit(cache=True, no_cfunc_wrapper=True)(entry)
    variant = "".join(_code_parts(_taker.__code__, set())) + repr(typed)
    _keep(dispatcher, own.beside(f"bound{more}", entry, variant))
    return dispatcher


def _fits_table(kind: Any) -> bool:
    """Arrays, float64 and int64 do."""
    return isinstance(kind, numba.types.Array) or kind in (numba.float64, numba.int64)


def _taker(typed: tuple[Any, ...]) -> Any:
    """A function for compiled code: the address of a table of arguments of these types, and a tuple of more,
    to a tuple of all."""

    @intrinsic
    def take(_context: Any, _address: Any, more: Any) -> Any:
        def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            word = context.get_value_type(numba.int64)
            slots = iter(range(sum(map(_slots_of, typed))))
            table = builder.inttoptr(arguments[0], word.as_pointer())

            def following() -> Any:
                return builder.load(cgutils.gep_inbounds(builder, table, next(slots)))

            values = []
            for kind in typed:
                if not isinstance(kind, numba.types.Array):
                    values.append(builder.bitcast(following(), context.get_value_type(kind)))
                    continue
                array = context.make_array(kind)(context, builder)
                populate_array(
                    array,
                    data=builder.inttoptr(following(), array.data.type),
                    shape=[following() for _ in range(kind.ndim)],
                    strides=[following() for _ in range(kind.ndim)],
                    itemsize=context.get_abi_sizeof(context.get_data_type(kind.dtype)),
                    meminfo=None,
                )
                values.append(array._getvalue())
            values.extend(cgutils.unpack_tuple(builder, arguments[1]))
            taken = context.make_tuple(builder, signature.return_type, values)
            return impl_ret_borrowed(context, builder, signature.return_type, taken)

        return numba.types.Tuple((*typed, *more.types))(numba.intp, more), build

    return take


def _slots_of(kind: Any) -> int:
    return 1 + 2 * kind.ndim if isinstance(kind, numba.types.Array) else 1


def source_stamp(function: Callable[..., Any]) -> str:
    """Digest of all that the machine code of a function is made of, the same in every process.

    These are its module, its byte code, the values of the globals and module attributes it names, and, in
    the same way, the kernels it calls; also the version of Numba.

    Raises:
        TypeError: a global that the function names is of a kind that cannot be distinguished by its value.
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
    yield function.__module__  # machine code names the module of each kernel in it
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
        yield value.targetoptions["error_model"]  # type: ignore[attr-defined]  # is_jitted tells
        yield from _parts(value.py_func, seen)  # type: ignore[attr-defined]
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
    """The file interface of Numba's cache, with one file for each kernel, stamp, signature and processor.

    A file is written whole, under another name, and then renamed: a reader finds the complete file or none.
    Its name identifies its content, so processes that run different versions of the sources do not read each
    other's.
    """

    def __init__(self, folder: Path, base: str, function: Callable[..., Any], variant: str = "") -> None:
        self._folder = folder
        self._base = base
        self._function = function
        self._variant = variant
        self._turn: BaseFileLock | None = None

    def beside(self, name: str, function: Callable[..., Any], variant: str) -> "_CacheFile":
        """The file of a function that calls the kernel, in one of several variants with separate files."""
        return _CacheFile(self._folder, f"{self._base}-{name}", function, variant)

    def load(self, key: object) -> Any:
        """The data saved under the key, or None."""
        try:
            return pickle.loads(self._path(key).read_bytes())
        except (OSError, EOFError, pickle.UnpicklingError):
            return None

    def save(self, key: object, data: object) -> None:
        """Store the data and delete the files of older sources; an error such as a full disk is ignored."""
        path = self._path(key)
        part = path.with_name(f"{path.name}.tmp.{uuid.uuid4().hex[:16]}")
        with suppress(OSError):
            try:
                part.write_bytes(dumps(data))
                os.replace(part, path)
            finally:
                part.unlink(missing_ok=True)
            self._remove(keep=path.name.split(".")[-3])

    def begin_turn(self) -> bool:
        """Wait until no other process compiles the kernel, for a limited time. False: there was no wait."""
        if self._turn is not None:  # a kernel that calls itself with other types
            return False
        from filelock import FileLock  # takes 0.1 s, and most processes compile nothing

        turn = FileLock(self._turn_path)
        # a folder that is not writable, a file system without locks, no turn in this time, or a turn of this
        # thread for another kernel of the same name
        with suppress(OSError, RuntimeError):
            turn.acquire(timeout=_TURN_S, poll_interval=_TURN_CHECK_S)
            self._turn = turn
        return self._turn is not None

    def end_turn(self) -> None:
        """Let another process compile; nothing if this one did not."""
        turn, self._turn = self._turn, None
        if turn is not None:
            with suppress(OSError):
                self._turn_path.unlink()
            turn.release()

    @property
    def _turn_path(self) -> Path:
        return self._folder / f"{self._base}.lock"

    def flush(self) -> None:
        """Forget everything."""
        with suppress(OSError):
            self._remove(keep=None)

    def _path(self, key: Any) -> Path:
        # The stamp is taken on use, not at definition: by then every name that the kernel uses is there. It
        # stands for Numba's own digest of the function, which for a closure differs from process to process.
        signature, target, _ = key  # as numba.core.caching.Cache makes it
        name = f"{signature!r} {target!r} {self._variant}"
        digest = hashlib.sha256(name.encode()).hexdigest()[:_STAMP_DIGITS]
        return self._folder / f"{self._base}.{source_stamp(self._function)}.{digest}.nbc"

    def _remove(self, *, keep: str | None) -> None:
        for old in self._folder.glob(f"{self._base}.*.nbc"):
            if keep is None or old.name.split(".")[-3] != keep:
                old.unlink(missing_ok=True)
