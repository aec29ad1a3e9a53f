"""The whole tree passes the linter, the formatter and the type checker, as configured in `pyproject.toml`."""

import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]


PACKAGES = ("-p", "flightsim", "-p", "autopilot_bridge", "-p", "estimators", "-p", "missions")


def mypy_for(platform: str) -> Any:
    """The packages as another system finds them, with a cache of its own: 60 s without one."""
    command = ("mypy", "--platform", platform, "--cache-dir", f".mypy_cache/{platform}", *PACKAGES)
    return pytest.param(command, marks=pytest.mark.slow)


@pytest.mark.parametrize(
    "command",
    [
        ("ruff", "check", "."),
        ("ruff", "format", "--check", "."),
        ("mypy",),
        mypy_for("win32"),
        mypy_for("darwin"),
    ],
    ids=" ".join,
)
def test_static_checks(command: tuple[str, ...]) -> None:
    if find_spec(command[0]) is None:
        pytest.skip(f"{command[0]} is not installed; it comes with the [test] extra")
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_no_source_is_ignored() -> None:
    """A source in a folder that `.gitignore` names would be left out of commits and of the linter."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("this is not a git checkout")
    command = ("git", "ls-files", "--cached", "--ignored", "--exclude-standard")
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == []
