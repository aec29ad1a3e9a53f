"""Installs without some packages: extras that were not chosen, and systems that have no wheel of one."""

import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement

from flightsim.foundation.packages import OPTIONAL, MissingPackage, missing, required
from missions.cli import versions
from missions.cli.exit_codes import FAILED
from missions.cli.main import command_line, run_command_line

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CORE = [Requirement(text) for text in PROJECT["dependencies"]]
DISTRIBUTIONS = {"foxglove": "foxglove-sdk", "rerun": "rerun-sdk", "sklearn": "scikit-learn"}
WITHOUT = "import sys; sys.modules.update(dict.fromkeys({absent})); sys.argv[0] = 'flightstack'; "
RUN = WITHOUT + "from missions.cli.main import main; main()"
LEAST = ("av", "jsbsim", "mavsdk", "mcap", "pyarrow")
LINKS_ONLY = """
import missions.cli.bodies.estimate, missions.cli.bodies.log, missions.cli.bodies.replay
import missions.cli.bodies.fly, missions.cli.bodies.vision, missions.embedded.sitl, estimators.attitude
"""


def test_each_package_is_in_the_extra_that_is_named() -> None:
    extras = {
        name: {Requirement(text).name for text in texts}
        for name, texts in PROJECT["optional-dependencies"].items()
    }
    for module, package in OPTIONAL.items():
        if package.extra:
            assert DISTRIBUTIONS.get(module, module) in extras[package.extra]


@pytest.mark.parametrize(
    ("system", "absent"),
    [
        ({"sys_platform": "linux", "platform_machine": "x86_64"}, set()),
        ({"sys_platform": "linux", "platform_machine": "aarch64"}, {"jsbsim"}),
        ({"sys_platform": "win32", "platform_machine": "AMD64", "platform_release": "10"}, set()),
        ({"sys_platform": "darwin", "platform_machine": "arm64", "platform_release": "24.1.0"}, set()),
        ({"sys_platform": "darwin", "platform_machine": "x86_64", "platform_release": "22.6.0"}, {"mavsdk"}),
    ],
)
def test_markers_leave_out_what_has_no_wheel(system: dict[str, str], absent: set[str]) -> None:
    left_out = {one.name for one in CORE if one.marker is not None and not one.marker.evaluate(system)}
    assert left_out == absent


def test_what_is_missing_is_named_with_its_extra() -> None:
    with pytest.raises(MissingPackage, match="no_such_module"):
        required("no_such_module")
    assert missing("no_such_module") == ""
    assert missing("rasterio.crs", "x.tif") == (
        "x.tif needs rasterio, which is not installed: pip install 'flightstack[maps]'"
    )
    assert "no wheel for this system" in missing("mavsdk")


def without(absent: tuple[str, ...], program: str, *arguments: str, cwd: Path = ROOT) -> str:
    """Run a program that can't import some packages; exit code and stderr."""
    done = subprocess.run(
        [sys.executable, "-c", program.format(absent=list(absent)), *arguments],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=250,
    )
    return f"{done.returncode}: {done.stderr}"


def test_a_command_names_what_it_lacks_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def lacking(*_arguments: Any, **_more: Any) -> None:
        raise ModuleNotFoundError("No module named 'pyarrow'", name="pyarrow")

    monkeypatch.setattr(command_line, "main", lacking)
    assert run_command_line(["study"]) == FAILED
    needs = "this needs PyArrow, which is not installed: pip install 'flightstack[tables]'"
    assert capsys.readouterr().err == f"flightstack: {needs}\n"


def test_the_version_lists_what_is_there_and_what_is_not(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    present = {module: [module] for module in OPTIONAL if module != "av"}
    monkeypatch.setattr(versions, "packages_distributions", lambda: present)
    monkeypatch.setattr(versions, "version", lambda name: "1.2.3")
    assert run_command_line(["--version"]) == 0
    assert capsys.readouterr().out == "flightstack, version 1.2.3\n"
    assert run_command_line(["-v", "--version"]) == run_command_line(["--version", "-v"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "numba 1.2.3" in lines and "pyarrow 1.2.3" in lines
    assert lines[-1] == "PyAV: not installed; pip install 'flightstack[video]'"


@pytest.mark.slow
def test_links_and_logs_need_no_simulator_and_no_extra() -> None:
    assert without(LEAST, WITHOUT + LINKS_ONLY) == "0: "


@pytest.mark.slow
def test_a_flight_needs_no_extra(tmp_path: Path) -> None:
    size = ("--size", "30", "--out", "run")
    said = without(("av", "mcap", "pyarrow"), RUN, "fly", "lissajous", *size, cwd=tmp_path)
    assert said.startswith("0: "), said
    log = str(tmp_path / "run" / "flight.tlog")
    for command in (("log", "info", log), ("replay", log, "--estimator", "attitude", "--no-picture")):
        said = without(LEAST, RUN, *command, cwd=tmp_path)
        assert said.startswith("0: "), said
    said = without(("pyarrow",), RUN, "log", "export", log, "--format", "parquet", "--out", "x", cwd=tmp_path)
    assert "flightstack[tables]" in said and said.count("\n") == 1


@pytest.mark.slow
def test_wheel_and_sdist_fly_from_an_empty_folder(tmp_path: Path) -> None:
    """The wheel that is made of the sdist has every module and data file, and flies without the checkout."""
    if find_spec("uv") is None:
        pytest.skip("uv is not installed; it comes with the README's test command")
    build = [sys.executable, "-m", "uv", "build", "-q", "--out-dir", str(tmp_path / "dist"), str(ROOT)]
    subprocess.run(build, check=True, timeout=250)
    (sdist,), (wheel,) = tmp_path.glob("dist/*.tar.gz"), tmp_path.glob("dist/*.whl")
    with tarfile.open(sdist) as packed:
        assert any(name.endswith("/flightsim/models/iris/vehicle.toml") for name in packed.getnames())
    with zipfile.ZipFile(wheel) as packed_wheel:
        packed_wheel.extractall(tmp_path / "installed")
    metadata = next(tmp_path.glob("installed/*.dist-info/METADATA")).read_text(encoding="utf-8")
    assert "Provides-Extra: video" in metadata and "Requires-Python: >=3.11" in metadata
    folder = tmp_path / "empty"
    folder.mkdir()
    program = f"import sys; sys.path.insert(0, {str(tmp_path / 'installed')!r}); " + RUN
    said = without(("av",), program, "fly", "lissajous", "--size", "30", "--out", "run", cwd=folder)
    assert said.startswith("0: "), said
    assert (folder / "run" / "track.png").exists()
