"""A study whose flights are flown by a real firmware: what its flights are requested with (1 s)."""

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from autopilot_bridge.firmware_process.build import FirmwareBuild
from missions.base.request import RunRequest
from missions.studies import flights
from missions.studies.design import grid
from missions.studies.flights import flown_by, fly_trial
from missions.studies.study import Study


@dataclass(frozen=True)
class Row:
    vehicles: int


def trial(values: Any, seed: int) -> Row:
    fly_trial("lissajous", RunRequest())
    return Row(vehicles=1)


STUDY = Study(name="flown", trial=trial, row=Row, design=grid())


@pytest.mark.parametrize("firmware", ["ardupilot", None])
def test_the_flights_of_a_study_are_flown_by_its_firmware(
    firmware: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    requests: list[RunRequest] = []

    def fly(_mission: str, request: RunRequest) -> SimpleNamespace:
        requests.append(request)
        return SimpleNamespace(outcome="completed")

    monkeypatch.setattr(flights, "fly", fly)
    monkeypatch.setattr(flights, "trial_folder", lambda: Path("trial"))
    build = None if firmware is None else FirmwareBuild(firmware, Path("program"))
    study = flown_by(STUDY, build)
    assert study.trial({}, 1) == Row(vehicles=1)
    assert requests[0].firmware == build
    assert [v.autopilot for v in requests[0].embedded_world.vehicles] == [firmware or "px4"]
    assert study.options == ({} if build is None else {"firmware": "ardupilot=program"})
    STUDY.trial({}, 1)  # a study without a firmware in the same process
    assert requests[1].firmware is None
