"""The compile cache of kernels: code made from other sources is never used, and nothing is compiled twice."""

import math
import os
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from flightsim.foundation import kernels
from flightsim.foundation.kernels import bound, compiled_for, kernel, source_stamp
from flightsim.foundation.rotations import quaternion_from_euler

ROOT = Path(__file__).parents[3]

SOURCES = {
    "layout": "FACTOR = 2.0\nPLACE = slice(1, 3)\nTABLE = (1, (2.0, 'a'))\n",
    "inner": """
from flightsim.foundation.kernels import kernel

@kernel
def offset(x):
    return x + 1.0
""",
    "outer": """
from flightsim.foundation.kernels import kernel
from {package} import layout
from {package}.inner import offset
from {package}.layout import FACTOR, TABLE

@kernel
def outer(values):
    return FACTOR * offset(values[layout.PLACE].sum()) + below(0.0) * TABLE[0]

@kernel
def below(x):
    return offset(x)
""",
}
PROGRAM = """
import numpy as np
from tiny.outer import outer
print(outer(np.array([1.0, 2.0, 3.0])), sum(outer.stats.cache_hits.values()))
"""


BINDING_PROGRAM = """
import numba
import numpy as np
from flightsim.foundation.kernels import _entry, bound
from tiny.outer import outer
arrays = np.array([1.0, 2.0, 3.0]), np.zeros((4, 3))[:, 1]
print(sum(bound(outer, array)() for array in arrays))
entries = [_entry(outer, (numba.typeof(array),), 0) for array in arrays]
print(sum(sum(entry.stats.cache_hits.values()) for entry in entries))
"""


def stamp(sources: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> str:
    """Stamp of `outer` in a package that exists in memory only."""
    package = ModuleType("in_memory")
    monkeypatch.setitem(sys.modules, "in_memory", package)
    for name, text in sources.items():
        module = ModuleType(f"in_memory.{name}")
        monkeypatch.setitem(sys.modules, module.__name__, module)
        setattr(package, name, module)
        exec(text.format(package="in_memory"), vars(module))
    return source_stamp(package.outer.outer.py_func)


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("layout", "FACTOR = 2.0", "FACTOR = 3.0"),
        ("layout", "slice(1, 3)", "slice(0, 2)"),
        ("layout", "'a'", "'b'"),
        ("inner", "x + 1.0", "x + 2.0"),
        ("inner", "x + 1.0", "x - 1.0"),
        ("inner", "@kernel\n", "@kernel(error_model='numpy')\n"),
        ("outer", "+ below(0.0)", "- below(0.0)"),
    ],
)
def test_an_edit_anywhere_below_changes_the_stamp(
    monkeypatch: pytest.MonkeyPatch, name: str, old: str, new: str
) -> None:
    edited = {**SOURCES, name: SOURCES[name].replace(old, new)}
    assert edited != SOURCES
    assert stamp(edited, monkeypatch) != stamp(SOURCES, monkeypatch)


def test_a_kernel_that_moves_to_another_module_changes_the_stamp(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numba's code names the modules of its kernels; with the name of a missing module it can't be loaded."""
    moved = {
        "layout": SOURCES["layout"],
        "moved": SOURCES["inner"],
        "outer": SOURCES["outer"].replace("inner", "moved"),
    }
    assert stamp(moved, monkeypatch) != stamp(SOURCES, monkeypatch)


def test_an_edit_elsewhere_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    edited = {**SOURCES, "layout": "# a remark\nOTHER = 1\n" + SOURCES["layout"]}
    assert stamp(edited, monkeypatch) == stamp(SOURCES, monkeypatch)


def test_a_global_without_a_value_of_its_own_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    edited = {**SOURCES, "layout": SOURCES["layout"].replace("2.0\n", "object()\n")}
    with pytest.raises(TypeError, match=r"outer names FACTOR, a object; accepted: numbers"):
        stamp(edited, monkeypatch)


class Package:
    """The same package as files, run in processes of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.parts = folder / "tiny"
        self.parts.mkdir()
        (self.parts / "__init__.py").touch()
        for name, text in SOURCES.items():
            self.write(name, text)

    def write(self, name: str, text: str) -> None:
        path = self.parts / f"{name}.py"
        # The interpreter tells versions of a source by whole seconds and size: each edit is a second later.
        later_ns = path.stat().st_mtime_ns + 10**9 if path.exists() else time.time_ns()
        path.write_text(text.format(package="tiny"), encoding="utf-8")
        os.utime(path, ns=(later_ns, later_ns))

    def start(self, program: str = PROGRAM, **environment: str) -> "subprocess.Popen[str]":
        return subprocess.Popen(
            [sys.executable, "-c", program],
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": f"{self.folder}{os.pathsep}{ROOT}", **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def run(self, **environment: str) -> tuple[float, int]:
        """Result, and how much of it came out of the cache."""
        return finished(self.start(**environment))

    def say(self, program: str) -> str:
        """What a program prints."""
        out, error = self.start(program).communicate()
        assert not error
        return out

    def cached(self) -> list[Path]:
        return list((self.parts / "__pycache__").glob("outer.outer-*.nbc"))


def finished(process: "subprocess.Popen[str]") -> tuple[float, int]:
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    value, hits = out.split()
    return float(value), int(hits)


@pytest.fixture
def package(tmp_path: Path) -> Package:
    return Package(tmp_path)


def test_a_listener_is_called_once_and_only_when_code_is_compiled(package: Package) -> None:
    listening = (
        "from flightsim.foundation.kernels import when_compiling\n"
        "with when_compiling(lambda: print('compiling')):\n"
    )
    program = listening + textwrap.indent(PROGRAM, "    ")
    assert package.say(program).splitlines() == ["compiling", "13.0 0"]
    assert package.say(program).splitlines() == ["13.0 1"]


def test_a_listener_is_not_called_after_its_context(package: Package) -> None:
    """A command that flew says nothing about what is compiled after it in the same process."""
    ended = (
        "from flightsim.foundation.kernels import when_compiling\n"
        "with when_compiling(lambda: print('compiling')):\n    pass\n"
    )
    assert package.say(ended + PROGRAM).splitlines() == ["13.0 0"]


@pytest.mark.slow
def test_code_is_kept_until_a_constant_of_another_module_changes(package: Package) -> None:
    both = [package.start(), package.start()]  # one of them compiles, the other one waits for the code
    assert sorted(finished(process) for process in both) == [(13.0, 0), (13.0, 1)]
    assert not list((package.parts / "__pycache__").glob("*.lock"))
    (old,) = package.cached()
    package.write("layout", SOURCES["layout"].replace("FACTOR = 2.0", "FACTOR = 3.0"))
    assert package.run() == (19.0, 0)
    (new,) = package.cached()  # the old code is gone
    assert new != old
    new.write_bytes(new.read_bytes()[:100])  # a damaged file is compiled anew
    assert package.run() == (19.0, 0)
    assert package.run() == (19.0, 1)


def test_a_process_that_stops_while_it_compiles_does_not_stop_the_others(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(kernels, "_TURN_S", 0.05)
    one, other = (kernels._CacheFile(tmp_path, "name", kernels.kernel) for _ in range(2))
    assert one.begin_turn()
    assert not one.begin_turn()  # a kernel that calls itself
    assert not other.begin_turn()
    one.end_turn()
    assert other.begin_turn()
    other.end_turn()
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_without_a_writable_package_folder_the_users_cache_serves(package: Package, tmp_path: Path) -> None:
    (package.parts / "__pycache__").write_text("in the way", encoding="utf-8")
    home = tmp_path / "home"
    home.mkdir()
    places = {"HOME": str(home), "XDG_CACHE_HOME": str(home), "LOCALAPPDATA": str(home)}
    assert package.run(**places) == (13.0, 0)
    assert package.run(**places) == (13.0, 1)
    home.rename(tmp_path / "away")
    home.write_text("in the way", encoding="utf-8")  # no folder at all: the kernel still runs
    assert package.run(**places) == (13.0, 0)


def test_a_division_by_zero_raises_or_gives_what_numpy_gives() -> None:
    def inverse(x: float) -> float:
        return 1.0 / x

    with pytest.raises(ZeroDivisionError):
        kernel(inverse)(0.0)
    assert kernel(error_model="numpy")(inverse)(0.0) == math.inf


def test_code_for_given_types_does_what_the_kernel_does() -> None:
    angles = (0.1, -0.2, 3.0)
    expected, found = np.zeros(4), np.zeros(4)
    quaternion_from_euler(*angles, expected)
    code = compiled_for(quaternion_from_euler, *angles, found)
    assert compiled_for(quaternion_from_euler, *angles, found) is code
    code(*angles, found)
    assert found.tolist() == expected.tolist()
    with pytest.raises(TypeError):
        code(*angles, [0.0] * 4)  # type: ignore[arg-type]


def test_a_function_that_is_no_kernel_stays_as_it_is() -> None:
    assert compiled_for(len, [1]) is len


@kernel
def _mixed(
    table: np.ndarray, column: np.ndarray, count: int, factor: float, more: np.ndarray, at: int
) -> float:
    more[at] += factor * table[1, 2] + column[1]
    table[0, 0] += count
    return float(more[at])


def test_a_bound_kernel_sees_its_arrays_as_they_are_at_the_call() -> None:
    table, grid, more = np.zeros((2, 3)), np.zeros((3, 2)), np.zeros(4)
    call = bound(_mixed, table, grid[:, 1], 3, 0.5, then=(more, 0))
    table[1, 2], grid[1, 1] = 8.0, 100.0
    assert call(more, 1) == 104.0
    grid[1, 1] = 0.0
    assert call(more, 1) == 108.0
    assert more.tolist() == [0.0, 108.0, 0.0, 0.0]
    assert table[0, 0] == 6.0


def test_a_bound_kernel_keeps_its_arrays_and_lets_go_of_the_callers() -> None:
    more = np.zeros(4)
    call = bound(_mixed, np.ones((2, 3)), np.ones(3), 1, 1.0, then=(more, 0))
    others = sys.getrefcount(more)
    for _ in range(1000):
        call(more, 0)
        np.full(6, math.nan)  # where the arrays would be, had they been forgotten
    assert sys.getrefcount(more) == others
    assert more[0] == 2000.0


MOVED_PROGRAM = """
import numba.core.imputils as internals
import numpy as np
moved = internals.__dict__.pop("impl_ret_borrowed")
from flightsim.foundation import kernels
internals.impl_ret_borrowed = moved  # Numba uses it too
from tiny.outer import outer
print(float(kernels.bound(outer, np.array([1.0, 2.0, 3.0]))()), kernels.dumps is None)
"""


@pytest.mark.slow
def test_kernels_work_without_what_numba_promises_nothing_of(package: Package) -> None:
    """A release of Numba that moves its internals costs some speed, and no function."""
    assert package.say(MOVED_PROGRAM).split() == ["13.0", "True"]


def test_a_function_that_is_no_kernel_is_bound_too() -> None:
    assert bound(max, 3, then=(0,))(5) == 5


@pytest.mark.slow
def test_bound_kernels_of_several_types_are_kept_from_run_to_run(package: Package) -> None:
    """What one process has compiled, the next one finds, and no type displaces another."""
    assert package.say(BINDING_PROGRAM).split() == ["16.0", "0"]
    assert package.say(BINDING_PROGRAM).split() == ["16.0", "2"]
    package.write("layout", SOURCES["layout"].replace("FACTOR = 2.0", "FACTOR = 4.0"))
    assert package.say(BINDING_PROGRAM).split() == ["30.0", "0"]
