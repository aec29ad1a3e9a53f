"""Plans in files on the memory card: what is read is what was written, and nothing else is loaded."""

import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware import get_flavour
from autopilot_bridge.mission_plan import MissionItem, MissionStore, MissionType
from autopilot_bridge.services.plans.stored_plans import StoredPlans, pack_plan, unpack_plan
from autopilot_bridge.storage import FOLDER_QUOTA, MemoryStore, Quota
from autopilot_bridge.storage.files import Mode, make_directories, read_whole, replace_whole
from autopilot_bridge.storage.folder import FolderStore
from flightsim.airframe import AirframeKind

FOLDER = ("plans",)
FILES = {kind: (*FOLDER, f"{kind.name.lower()}.dat") for kind in MissionType}
PLANS: dict[MissionType, tuple[MissionItem, ...]] = {
    MissionType.MISSION: (
        MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, frame=0, x=47.4, y=8.5, z=489.0),
        MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, z=10.0, param4=math.nan),
        MissionItem(
            command=mavlink.MAV_CMD_NAV_WAYPOINT, x=47.398, y=8.546, z=10.0, param1=2.0, autocontinue=False
        ),
        MissionItem(command=mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, frame=2),
    ),
    MissionType.FENCE: tuple(
        MissionItem(command=mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, param1=3.0, x=x, y=y)
        for x, y in ((47.3, 8.5), (47.5, 8.5), (47.5, 8.6))
    ),
    MissionType.RALLY: (MissionItem(command=mavlink.MAV_CMD_NAV_RALLY_POINT, x=47.398, y=8.546, z=20.0),),
}

numbers = st.floats(width=32)
items = st.builds(
    MissionItem,
    command=st.integers(0, 0xFFFF),
    frame=st.integers(0, 0xFF),
    param1=numbers,
    param2=numbers,
    param3=numbers,
    param4=numbers,
    x=st.floats(),
    y=st.floats(),
    z=numbers,
    autocontinue=st.booleans(),
)


class Vehicle:
    """The plans of one boot."""

    def __init__(self, files: MemoryStore, flavour: str = "px4") -> None:
        self.stores = {kind: MissionStore() for kind in MissionType}
        self.texts: list[str] = []
        policy = get_flavour(flavour, AirframeKind.MULTICOPTER).services.missions
        self.service = StoredPlans(
            self.stores, files, FOLDER, policy, lambda severity, text: self.texts.append(text)
        )
        self.service.tick(0)

    def plan(self, kind: MissionType) -> tuple[Any, int]:
        return self.stores[kind].items, self.stores[kind].plan_id


def same(left: tuple[MissionItem, ...], right: tuple[MissionItem, ...]) -> bool:
    return repr(left) == repr(right)  # NaN is not equal to itself


@given(st.lists(items, max_size=5).map(tuple), st.sampled_from(list(MissionType)), st.integers(0, 2**32 - 1))
def test_what_was_packed_is_unpacked(plan: tuple[MissionItem, ...], kind: MissionType, plan_id: int) -> None:
    found, number = unpack_plan(pack_plan(plan, kind, plan_id), kind)
    assert same(found, plan) and number == plan_id


@given(st.binary(max_size=200), st.sampled_from(list(MissionType)))
def test_other_bytes_are_refused(data: bytes, kind: MissionType) -> None:
    with pytest.raises(ValueError):
        unpack_plan(data, kind)


@given(st.data())
def test_a_damaged_file_is_refused(data: Any) -> None:
    whole = pack_plan(PLANS[MissionType.MISSION], MissionType.MISSION, 7)
    place = data.draw(st.integers(0, len(whole) - 1))
    bit = 1 << data.draw(st.integers(0, 7))
    changed = bytes((*whole[:place], whole[place] ^ bit, *whole[place + 1 :]))
    for broken in (changed, whole[:place], whole + b"\0"):
        with pytest.raises(ValueError):
            unpack_plan(broken, MissionType.MISSION)
    with pytest.raises(ValueError):
        unpack_plan(whole, MissionType.FENCE)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_plans_are_there_at_the_next_boot(flavour: str) -> None:
    files = MemoryStore()
    first = Vehicle(files, flavour)
    assert files.entries(()) == []  # nothing is written before there is a plan
    rules = get_flavour(flavour, AirframeKind.MULTICOPTER).services.missions.rules
    for kind, plan in PLANS.items():
        kept = tuple(rules.stored(item) for item in plan[flavour == "px4" and kind is MissionType.MISSION :])
        first.stores[kind].replace(kept, 100 + kind)
    first.service.tick(20_000)
    second = Vehicle(files, flavour)
    for kind in MissionType:
        items, plan_id = second.plan(kind)
        assert same(items, first.stores[kind].items) and items and plan_id == 100 + kind
    assert second.texts == []
    second.stores[MissionType.MISSION].replace((), 0)  # cleared
    second.service.close()
    assert Vehicle(files, flavour).plan(MissionType.MISSION) == ((), 0)


FAR = MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=95.0, y=8.0, z=5.0)
HUGE = MissionItem(command=mavlink.MAV_CMD_DO_CHANGE_SPEED, frame=2, param2=1e300)
NO_COMMAND = MissionItem(command=9999, x=47.0, y=8.0, z=5.0)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize(
    ("kind", "content"),
    [
        (MissionType.MISSION, b""),
        (MissionType.MISSION, b"\xff" * 100),
        (MissionType.RALLY, pack_plan(PLANS[MissionType.MISSION], MissionType.MISSION, 1)),
        *((MissionType.MISSION, pack_plan((PLANS[MissionType.MISSION][2], item), MissionType.MISSION, 1))
          for item in (FAR, HUGE, NO_COMMAND)),
        (MissionType.FENCE, pack_plan(PLANS[MissionType.FENCE][:2], MissionType.FENCE, 1)),
        (MissionType.RALLY, pack_plan(PLANS[MissionType.RALLY] * 60, MissionType.RALLY, 1)),
    ],
)  # fmt: skip
def test_what_would_not_be_taken_is_kept_aside_and_reported(
    flavour: str, kind: MissionType, content: bytes
) -> None:
    files = MemoryStore()
    make_directories(files, FOLDER)
    for each in MissionType:
        plan = PLANS[each][flavour == "px4" and each is MissionType.MISSION :]
        replace_whole(files, FILES[each], pack_plan(plan, each, 5))
    replace_whole(files, FILES[kind], content)
    vehicle = Vehicle(files, flavour)
    assert vehicle.texts == [f"Stored {kind.name.lower()} damaged, not loaded"]
    for each in MissionType:  # the others are loaded
        assert bool(vehicle.plan(each)[0]) is (each is not kind)
    aside = (*FOLDER, f"{kind.name.lower()}.dat.damaged")
    assert read_whole(files, aside, at_most=1 << 30) == content
    assert Vehicle(files, flavour).texts == []


@pytest.mark.parametrize("kind", MissionType)
def test_a_sparse_file_of_gigabytes_is_not_read(kind: MissionType, tmp_path: Path) -> None:
    """FTP's TRUNCATE makes one in a moment."""
    files = FolderStore(tmp_path / "card", FOLDER_QUOTA)
    make_directories(files, FOLDER)
    files.open(FILES[kind], Mode.NEW).close()
    files.truncate(FILES[kind], 4 << 30)
    vehicle = Vehicle(files)
    assert vehicle.texts == [f"Stored {kind.name.lower()} damaged, not loaded"]
    files.close()


def test_a_full_card_is_reported_and_the_old_plan_stays() -> None:
    files = MemoryStore(Quota(size_bytes=400, files=10))
    vehicle = Vehicle(files)
    vehicle.stores[MissionType.RALLY].replace(PLANS[MissionType.RALLY], 1)
    vehicle.service.tick(0)
    vehicle.stores[MissionType.RALLY].replace(PLANS[MissionType.RALLY] * 9, 2)
    vehicle.service.tick(0)
    vehicle.service.tick(0)
    assert vehicle.texts == ["Storing the rally failed: No space left on device"]
    assert Vehicle(files).plan(MissionType.RALLY) == (PLANS[MissionType.RALLY], 1)
