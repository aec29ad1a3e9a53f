"""Plans that persist over boots and runs: missions, fences and rally points, each in a file on the card.

Real vehicles keep them on the card (PX4, `dataman`) or in their parameter memory (ArduPilot). A file is a
header (name of the format, MAV_MISSION_TYPE, number of items, identifier), the items as they are stored, and
the CRC-32 of all these bytes, so that a client reads back the same plan with the same identifier. If a file
is damaged, or its plan would be refused from a client, the file is moved aside and reported, and no plan is
loaded.
"""

import contextlib
import math
import struct
import zlib
from collections.abc import Mapping
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem, MissionStore, MissionType
from autopilot_bridge.services.channel import Announce
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.plans.policy import MissionPolicy
from autopilot_bridge.services.plans.rules import check_fence_polygons
from autopilot_bridge.storage import FileStore, VehiclePath
from autopilot_bridge.storage.files import exists, make_directories, read_whole, replace_whole

_HEADER: Final = struct.Struct("<8sHHI")
_FORMAT: Final = b"FSPLAN1\n"
_ITEM: Final = struct.Struct("<HBB7d")
_CRC: Final = struct.Struct("<I")
_LARGEST: Final = 3.4e38  # of the wire's floats
_NAMES: Final = {MissionType.MISSION: "mission", MissionType.FENCE: "fence", MissionType.RALLY: "rally"}


def pack_plan(items: tuple[MissionItem, ...], kind: MissionType, plan_id: int) -> bytes:
    """The file of a plan."""
    data = bytearray(_HEADER.pack(_FORMAT, kind, len(items), plan_id))
    for item in items:
        data += _ITEM.pack(
            item.command,
            item.frame,
            item.autocontinue,
            *(item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z),
        )
    return bytes(data + _CRC.pack(zlib.crc32(data)))


def unpack_plan(data: bytes, kind: MissionType) -> tuple[tuple[MissionItem, ...], int]:
    """Items and identifier in a plan's file; the items are not checked.

    Raises:
        ValueError: the data are no such file, are damaged, or are of another type of plan.
    """
    if len(data) < _HEADER.size + _CRC.size:
        raise ValueError(f"{len(data)} bytes are too few for a stored plan")
    name, number, count, plan_id = _HEADER.unpack_from(data)
    if name != _FORMAT or number != kind:
        raise ValueError(f"not a stored plan of type {kind.name}")
    end = len(data) - _CRC.size
    if end != _HEADER.size + count * _ITEM.size or _CRC.unpack_from(data, end)[0] != zlib.crc32(data[:end]):
        raise ValueError(f"the stored plan of {count} items is damaged")
    items = []
    for command, frame, autocontinue, p1, p2, p3, p4, x, y, z in _ITEM.iter_unpack(data[_HEADER.size : end]):
        items.append(
            MissionItem(
                command=command,
                frame=frame,
                param1=p1,
                param2=p2,
                param3=p3,
                param4=p4,
                x=x,
                y=y,
                z=z,
                autocontinue=bool(autocontinue),
            )
        )
    return tuple(items), plan_id


class StoredPlans(Microservice):
    """Stores plans when they change, and loads them when the vehicle boots.

    Args:
        stores: the plans; the stored plans are loaded into them at once.
        files: the memory card.
        folder: folder on the card.
        policy: the firmware's rules for plans from a client, which are applied to the card too.
        announce: sends a STATUSTEXT.
    """

    coarse_timers = True

    def __init__(
        self,
        stores: Mapping[MissionType, MissionStore],
        files: FileStore,
        folder: VehiclePath,
        policy: MissionPolicy,
        announce: Announce,
    ) -> None:
        self._stores = stores
        self._files = files
        self._folder = folder
        self._policy = policy
        self._announce = announce
        self._damaged = [kind for kind in stores if not self._load(kind)]
        self._versions = {kind: store.version for kind, store in stores.items()}

    def tick(self, time_us: int) -> None:
        """Store a plan that was changed."""
        if self._damaged:
            for kind in self._damaged:
                self._announce(dialect.MAV_SEVERITY_ERROR, f"Stored {_NAMES[kind]} damaged, not loaded")
            self._damaged = []
        for kind, store in self._stores.items():
            if store.version != self._versions[kind]:
                self._versions[kind] = store.version
                self._store(kind, store)

    def close(self) -> None:
        """Store changes since the last tick at once."""
        self.tick(0)

    def _path(self, kind: MissionType) -> VehiclePath:
        return (*self._folder, f"{_NAMES[kind]}.dat")

    def _store(self, kind: MissionType, store: MissionStore) -> None:
        try:
            make_directories(self._files, self._folder)
            replace_whole(self._files, self._path(kind), pack_plan(store.items, kind, store.plan_id))
        except OSError as failure:
            self._announce(
                dialect.MAV_SEVERITY_ERROR, f"Storing the {_NAMES[kind]} failed: {failure.strerror}"
            )

    def _load(self, kind: MissionType) -> bool:
        """Load a plan; False: its file exists and can't be used."""
        path = self._path(kind)
        if not exists(self._files, path):
            return True
        try:
            largest = _HEADER.size + self._policy.capacity[kind] * _ITEM.size + _CRC.size
            items, plan_id = unpack_plan(read_whole(self._files, path, at_most=largest), kind)
            self._judge(items, kind)
        except (OSError, ValueError):
            with contextlib.suppress(OSError):  # kept, so that a user can examine it
                self._files.rename(path, (*path[:-1], f"{path[-1]}.damaged"))
            return False
        self._stores[kind].replace(items, plan_id)
        return True

    def _judge(self, items: tuple[MissionItem, ...], kind: MissionType) -> None:
        """Check a plan: a card may come from any source, and clients can write to it.

        Raises:
            ValueError: an item or the plan would be refused from a client.
        """
        count = len(items)
        if count > self._policy.capacity[kind]:
            raise ValueError(f"{count} items are more than {self._policy.capacity[kind]}")
        for seq, item in enumerate(items):
            values = (item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z)
            if any(abs(value) > _LARGEST for value in values):
                raise ValueError(f"item {seq} of the stored plan holds what no message can")
            if seq == 0 and self._policy.home_is_item_0 and not math.isfinite(item.x + item.y + item.z):
                raise ValueError("the home of the stored plan is nowhere")
            if self._policy.rules.check(item, kind, seq, count) != dialect.MAV_MISSION_ACCEPTED:
                raise ValueError(f"item {seq} of the stored plan, command {item.command}, is not taken")
        if kind is MissionType.FENCE and check_fence_polygons(items) != dialect.MAV_MISSION_ACCEPTED:
            raise ValueError("a polygon of the stored fence has too few or too many vertices")
