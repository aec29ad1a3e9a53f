"""What the packages export: a few public names each, imported when they are used."""

import importlib
import subprocess
import sys

import pytest

import flightstack

PACKAGES = ("autopilot_bridge", "estimators", "flightsim", "missions", "missions.studies")


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_exists_and_is_documented(package):
    module = importlib.import_module(package)
    assert dir(module) == module.__all__
    for name in module.__all__:
        found = getattr(module, name)
        assert found.__doc__ or name.isupper()  # constants have their text in the source
        assert getattr(flightstack, name) is found


def test_no_public_name_stands_in_two_packages():
    names = [name for package in PACKAGES for name in importlib.import_module(package).__all__]
    assert sorted(names) == flightstack.__all__


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
