"""Missions and estimators of a user's package, by the names that its entry points have."""

import json
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from estimators import names as estimator_names
from estimators.errors import EstimatorError
from estimators.library import estimator_class
from flightsim.foundation import plug_ins as foundation
from missions import catalogue
from missions.cli.main import run_command_line
from missions.errors import PlanError
from missions.library import find_mission

PACKAGE = '''
from dataclasses import dataclass

from estimators.attitude import AttitudeEstimator
from flightsim.foundation.options import option
from missions import Mission, MissionOptions, Report


@dataclass(frozen=True, slots=True, kw_only=True)
class WaitOptions(MissionOptions):
    wait_s: float = option(1.0, above=0.0, help="Time to wait.")


class Wait(Mission[WaitOptions]):
    """Wait on the ground."""

    name = "wait"
    options_class = WaitOptions

    async def fly(self, vehicle, options):
        await vehicle.clock.sleep(options.wait_s)
        return Report(figures={"waited_s": options.wait_s})


class Level(AttitudeEstimator):
    NAME = "level"


class Broken:
    def __init__(self):
        raise RuntimeError("no licence")
'''


@pytest.fixture
def package(tmp_path, monkeypatch):
    (tmp_path / "users_package.py").write_text(PACKAGE)
    monkeypatch.syspath_prepend(str(tmp_path))
    points = {
        catalogue.GROUP: {"wait": "Wait", "broken": "Broken", "gone": "Gone", "level": "Level"},
        estimator_names.GROUP: {"level": "Level", "broken": "Broken", "gone": "Gone"},
    }

    def found(group: str) -> dict[str, EntryPoint]:
        named = points[group].items()
        return {name: EntryPoint(name, f"users_package:{value}", group) for name, value in named}

    for module in ("missions.library", "missions.cli.fly_command", "estimators.library"):
        monkeypatch.setattr(f"{module}.plug_ins", found)
    yield
    sys.modules.pop("users_package", None)


@pytest.mark.usefixtures("package")
def test_a_mission_of_a_package_flies_with_its_own_options(tmp_path: Path) -> None:
    out = tmp_path / "run"
    assert run_command_line(["fly", "wait", "--wait", "2", "--out", str(out), "--no-picture"]) == 0
    summary = json.loads((out / "summary.json").read_text())
    assert (summary["mission"], summary["waited_s"]) == ("wait", 2.0)


@pytest.mark.usefixtures("package")
def test_its_help_has_its_options(capsys) -> None:
    assert run_command_line(["fly", "wait", "--help"]) == 0
    shown = capsys.readouterr().out
    assert "Wait on the ground." in shown and "Time to wait." in shown


@pytest.mark.usefixtures("package")
def test_an_estimator_of_a_package_has_its_name() -> None:
    assert estimator_class("level").NAME == "level"


@pytest.mark.usefixtures("package")
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("broken", "'broken' of users_package:Broken can't be loaded: RuntimeError: no licence"),
        ("gone", "'gone' of users_package:Gone can't be loaded: AttributeError"),
        ("level", "'level' of users_package:Level makes no `missions.Mission`"),
        ("other", "'other' is not known; there are lissajous, .*vision-search, wait, broken"),
    ],
)
def test_what_is_wrong_with_a_mission_of_a_package_is_said(name, message, capsys) -> None:
    with pytest.raises(PlanError, match=message):
        find_mission(name)
    assert run_command_line(["fly", name]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.usefixtures("package")
@pytest.mark.parametrize(
    ("name", "message"),
    [("broken", "is no class on"), ("gone", "can't be loaded"), ("other", "there are attitude, .*level")],
)
def test_what_is_wrong_with_an_estimator_of_a_package_is_said(name, message) -> None:
    with pytest.raises(EstimatorError, match=message):
        estimator_class(name)


def test_entry_points_are_those_of_the_installed_packages() -> None:
    assert "flightstack" in foundation.plug_ins("console_scripts")
