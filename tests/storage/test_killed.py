"""A process that is killed while it stores: whatever was done until then, the card holds the old or the new,
never half of it, and the next process starts from it.
"""

from collections.abc import Callable
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.mission_plan import MissionItem, MissionStore, MissionType
from autopilot_bridge.parameters import ParameterDefinition, ParameterStore, ParameterType
from autopilot_bridge.services.parameters.parameter_file import StoredParameters
from autopilot_bridge.services.plans.stored_plans import StoredPlans
from autopilot_bridge.storage import Mode, OpenFile, VehiclePath
from autopilot_bridge.storage.folder import FolderStore
from flightsim.airframe import AirframeKind

LAYOUT = get_flavour("px4").services.card
STEPS = 12
"""More than there are in any of the tests."""


class Killed(BaseException):
    """kill -9: nothing catches it, nothing is tidied up."""


class MortalStore(FolderStore):
    """Changes a folder so many times, the last time by half, and then is killed."""

    def __init__(self, folder: Path, steps: int) -> None:
        super().__init__(folder)
        self.steps = steps

    def step(self) -> None:
        if self.steps <= 0:
            raise Killed
        self.steps -= 1

    def open(self, path: VehiclePath, mode: Mode) -> OpenFile:  # type: ignore[override]
        if mode is Mode.READ:
            return super().open(path, mode)
        self.step()
        return MortalFile(self, super().open(path, mode))

    def make_directory(self, path: VehiclePath) -> None:
        self.step()
        super().make_directory(path)

    def rename(self, old: VehiclePath, new: VehiclePath) -> None:
        self.step()
        super().rename(old, new)

    def remove(self, path: VehiclePath) -> None:
        self.step()
        super().remove(path)


class MortalFile:
    """A file of a store that is killed: of its last write only the first bytes come to the card."""

    def __init__(self, store: MortalStore, file: OpenFile) -> None:
        self._store, self._file = store, file

    @property
    def size(self) -> int:
        return self._file.size

    def read(self, offset: int, size: int) -> bytes:
        return self._file.read(offset, size)

    def write(self, offset: int, data: bytes) -> None:
        half = len(data) // 2
        self._store.step()
        self._file.write(offset, data[:half])
        self._store.step()
        self._file.write(offset + half, data[half:])

    def close(self) -> None:
        self._file.close()


def until_killed(folder: Path, steps: int, work: Callable[[FolderStore], None]) -> bool:
    """Do something on a card until the process is killed; whether it was."""
    store = MortalStore(folder, steps)
    try:
        work(store)
        return False
    except Killed:
        return True
    finally:
        store.close()  # as the system closes what a killed process had open


def parameters(card: FolderStore) -> tuple[ParameterStore, StoredParameters]:
    """The parameters of a boot."""
    definitions = [
        ParameterDefinition(name=f"CRUISE_{k}", type=ParameterType.REAL32, default=0.0) for k in range(50)
    ]
    store = ParameterStore(definitions)
    stored = StoredParameters(store, card, LAYOUT, system_id=1)
    stored.load()
    assert stored.damaged is None
    return store, stored


@pytest.mark.parametrize("steps", range(STEPS))
def test_stored_parameters_are_the_old_or_the_new(tmp_path: Path, steps: int) -> None:
    def save(card: FolderStore, value: float) -> None:
        store, stored = parameters(card)
        for k in range(50):
            store.set(f"CRUISE_{k}", value)
        stored.save()

    assert not until_killed(tmp_path, 100, lambda card: save(card, 1.0))
    killed = until_killed(tmp_path, steps, lambda card: save(card, 2.0))
    card = FolderStore(tmp_path)
    found = set(parameters(card)[0].as_dict().values())
    assert found == ({1.0} if killed else {2.0})
    save(card, 3.0)  # what the killed one left behind is no obstacle
    assert [entry.name for entry in card.entries(())] == [LAYOUT.parameters[-1]]
    assert set(parameters(card)[0].as_dict().values()) == {3.0}
    assert steps < STEPS - 1 or not killed
    card.close()


def plans(card: FolderStore, texts: list[str]) -> tuple[dict[MissionType, MissionStore], StoredPlans]:
    """The plans of a boot."""
    stores = {kind: MissionStore() for kind in MissionType}
    policy = get_flavour("px4", AirframeKind.MULTICOPTER).services.missions
    service = StoredPlans(stores, card, LAYOUT.plans, policy, lambda severity, text: texts.append(text))
    service.tick(0)
    return stores, service


@pytest.mark.parametrize("steps", range(STEPS))
def test_stored_plans_are_the_old_or_the_new(tmp_path: Path, steps: int) -> None:
    texts: list[str] = []

    def items(count: int) -> tuple[MissionItem, ...]:
        return tuple(
            MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=47.398, y=8.546, z=10.0 + k)
            for k in range(count)
        )

    def upload(card: FolderStore, count: int) -> None:
        stores, service = plans(card, texts)
        stores[MissionType.MISSION].replace(items(count), count)
        stores[MissionType.RALLY].replace(
            (MissionItem(command=mavlink.MAV_CMD_NAV_RALLY_POINT, x=47.4, y=8.5, z=20.0),), count
        )
        service.tick(1)

    assert not until_killed(tmp_path, 100, lambda card: upload(card, 40))
    killed = until_killed(tmp_path, steps, lambda card: upload(card, 90))
    card = FolderStore(tmp_path)
    stores, _ = plans(card, texts)
    mission, rally = stores[MissionType.MISSION], stores[MissionType.RALLY]
    assert (mission.items, mission.plan_id) in ((items(40), 40), (items(90), 90))
    assert rally.plan_id in (40, 90)
    assert killed or (mission.plan_id, rally.plan_id) == (90, 90)
    assert steps < STEPS - 1 or not killed
    assert texts == []
    card.close()
