"""What the packages export: a few public names each, imported when they are used."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

import flightstack

ROOT = Path(__file__).parents[1]
PACKAGES = ("autopilot_bridge", "estimators", "flightsim", "missions", "missions.studies")


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_exists_and_is_documented(package):
    module = importlib.import_module(package)
    assert dir(module) == module.__all__
    for name in module.__all__:
        found = getattr(module, name)
        assert found.__doc__ or name.isupper()  # constants have their text in the source
        assert getattr(flightstack, name) is found


def test_options_and_worlds_of_all_missions_are_public():
    """Each class of options in a module `options`, and each function of a world in a module `world`."""
    public = re.compile(r"^(?:class (\w+Options)\(MissionOptions|def ([a-z]\w+_world)\()", re.MULTILINE)
    names = [
        options or world
        for module in ("options.py", "world.py")
        for file in (ROOT / "missions").glob(f"*/{module}")
        for options, world in public.findall(file.read_text(encoding="utf-8"))
    ]
    assert len(names) > 10
    assert set(names) <= set(flightstack.__all__)  # type: ignore[attr-defined]


def test_names_on_the_python_page_are_public():
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    calls = set(re.findall(r"\bfs\.(\w+)", page))
    in_tables = set(re.findall(r"`([A-Z]\w+(?:Options|Request|Spec)|[a-z_]+_world)\b", page))
    assert len(calls) > 8
    assert len(in_tables) > 10
    assert calls | in_tables <= set(flightstack.__all__)  # type: ignore[attr-defined]


def test_no_public_name_stands_in_two_packages():
    names = [name for package in PACKAGES for name in importlib.import_module(package).__all__]
    assert sorted(names) == flightstack.__all__  # type: ignore[attr-defined]


@pytest.mark.parametrize("package", [*PACKAGES, "flightstack"])
def test_other_names_are_refused(package):
    module = importlib.import_module(package)
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'no_such_name'"):
        _ = module.no_such_name


def test_packages_import_nothing_heavy():
    code = (
        f"import sys, flightstack, {', '.join(PACKAGES)};"
        "print(sorted({'numba', 'numpy', 'jsbsim', 'pymavlink', 'asyncio'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_worlds_without_cameras_load_no_picture_libraries():
    code = (
        "import sys; from flightsim.world_spec import WorldSpec; from missions.embedded import EmbeddedSitl;"
        "EmbeddedSitl(WorldSpec.of_team(1, seed=1)).close();"
        "print(sorted({'av', 'cv2', 'matplotlib', 'scipy.sparse.csgraph'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
