"""A vehicle with a memory card: logs of flights, parameters that outlive a boot, reboot and shutdown."""

import struct
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.firmware.ardupilot import mission_files, packed_parameters
from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.sitl import Sitl
from autopilot_bridge.storage import MemoryStore, Quota
from autopilot_bridge.storage.files import exists, read_whole
from autopilot_bridge.storage.folder import FolderStore
from autopilot_bridge.storage.memory import MemoryCard
from autopilot_bridge.tlog import TlogReader
from flightsim.world_spec import VehicleSpec, WorldSpec

BIG = Quota(size_bytes=50_000_000, files=1000)
ARM, STORAGE, REBOOT = 400, 245, 246
LAYOUT = {"px4": ("parameters.params",), "ardupilot": ("parameters.parm",)}
CHANGED = {"px4": ("MPC_XY_CRUISE", 7.5), "ardupilot": ("WPNAV_SPEED", 750.0)}


class Client:
    """A ground station on a memory link."""

    def __init__(self, flavour: str, card: MemoryCard, parameters: dict[str, float] | None = None) -> None:
        specification = VehicleSpec(autopilot=flavour, parameters=parameters or {})
        self.sitl = Sitl(WorldSpec(vehicles=(specification,)), cards=[card])
        self.vehicle = self.sitl.vehicles[0]
        self.link = self.sitl.connect(0)
        self.parser, self.encoder = FrameParser(), FrameEncoder(255, 190)
        self.received: list[Any] = []

    def run(self, seconds: float) -> None:
        until_us = self.sitl.time_us + round(seconds * 1e6)
        while self.sitl.time_us < until_us:
            self.sitl.advance()
            for _, data in self.link.receive():
                self.received += [decode(frame) for frame in self.parser.feed(data)]

    def send(self, message: Any) -> None:
        self.link.send(self.encoder.encode(message))

    def all(self, name: str) -> list[Any]:
        return [message for message in self.received if message.get_type() == name]

    def command(self, number: int, *values: float) -> int | None:
        self.received.clear()
        self.send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *values, *[0.0] * (7 - len(values))))
        self.run(0.1)
        acks = [message.result for message in self.all("COMMAND_ACK") if message.command == number]
        return acks[-1] if acks else None

    def upload(self, kind: MissionType, items: list[MissionItem]) -> None:
        self.received.clear()
        self.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), kind))
        for _ in range(100):
            self.run(0.02)
            requested = self.all("MISSION_REQUEST_INT") + self.all("MISSION_REQUEST")
            if self.all("MISSION_ACK"):
                assert self.all("MISSION_ACK")[0].type == 0
                return
            self.received.clear()
            for request in requested:
                item = items[request.seq]
                place = (round(item.x * 1e7), round(item.y * 1e7), item.z)
                params = (item.param1, item.param2, item.param3, item.param4)
                self.send(
                    mavlink.MAVLink_mission_item_int_message(
                        1, 1, request.seq, item.frame, item.command, 0, 1, *params, *place, kind
                    )
                )
        raise AssertionError("the upload doesn't end")

    def set(self, name: str, value: float) -> None:
        self.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, 9))
        self.run(1.0)

    def get(self, name: str) -> float:
        self.received.clear()
        self.send(mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), -1))
        self.run(0.2)
        return float(self.all("PARAM_VALUE")[0].param_value)

    def fly(self) -> None:
        """Arm, stand, disarm."""
        self.run(45.0 if self.vehicle.specification.autopilot == "ardupilot" else 6.0)
        assert self.command(ARM, 1) == 0
        self.run(2.0)
        assert self.command(ARM, 0) == 0
        self.run(3.0)

    def download(self, number: int, size: int) -> bytes:
        """A log, as MAVProxy asks for it."""
        self.received.clear()
        self.send(mavlink.MAVLink_log_request_data_message(1, 1, number, 0, 0xFFFFFFFF))
        data = bytearray(size)
        for _ in range(1000):
            self.run(0.1)
            for m in self.all("LOG_DATA"):
                data[m.ofs : m.ofs + m.count] = bytes(m.data[: m.count])
            if any(m.ofs + m.count >= size for m in self.all("LOG_DATA")):
                return bytes(data)
        raise AssertionError("the log doesn't end")


def card() -> MemoryCard:
    return MemoryCard(files=MemoryStore(BIG), logs=True)


@pytest.mark.parametrize(
    ("flavour", "first", "path"),
    [("px4", 0, ("log", "2025-01-01", "00_00_00.tlog")), ("ardupilot", 1, ("LOGS", "00000001.tlog"))],
)
@pytest.mark.sampled(1)
def test_a_flight_is_logged_listed_and_downloaded(
    flavour: str, first: int, path: tuple[str, ...], tmp_path: Path
) -> None:
    memory = card()
    client = Client(flavour, memory)
    client.fly()
    client.received.clear()
    client.send(mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    client.run(0.1)
    (entry,) = client.all("LOG_ENTRY")
    data = read_whole(memory.files, path, at_most=1 << 30)
    assert (entry.id, entry.num_logs, entry.last_log_num, entry.size) == (first, 1, first, len(data))
    assert entry.time_utc >= 1_735_689_600
    assert client.download(first, entry.size) == data
    (tmp_path / "log.tlog").write_bytes(data)
    reader = TlogReader(tmp_path / "log.tlog")
    messages = [decode(frame) for _, frame in reader]
    assert reader.counters.bytes_skipped == 0
    names = {message.get_type() for message in messages}
    assert {"HEARTBEAT", "ATTITUDE", "PARAM_VALUE", "STATUSTEXT"} <= names
    values = {message.param_id for message in messages if message.get_type() == "PARAM_VALUE"}  # type: ignore[attr-defined]
    assert len(values) >= client.vehicle.autopilot.parameters.count
    armed = [message.base_mode & 128 for message in messages if message.get_type() == "HEARTBEAT"]  # type: ignore[attr-defined]
    assert 128 in armed and armed[-1] == 0
    client.fly()
    assert len(memory.files.entries(path[:-1])) == 2  # another log; the first is as it was
    assert read_whole(memory.files, path, at_most=1 << 30) == data
    client.send(mavlink.MAVLink_log_erase_message(1, 1))
    client.run(0.1)
    assert not exists(memory.files, path)


@pytest.mark.parametrize(("flavour", "sent"), [("px4", True), ("ardupilot", False)])
@pytest.mark.sampled(1)
def test_logs_of_an_armed_vehicle(flavour: str, sent: bool) -> None:
    """ArduPilot sends none, says so once, and goes on with what was under way when it is disarmed again."""
    first = 0 if flavour == "px4" else 1
    client = Client(flavour, card(), {"SDLOG_MODE": 2} if flavour == "px4" else {})
    client.fly()
    listing = mavlink.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF)
    client.received.clear()
    client.send(listing)
    client.run(0.1)
    size = client.all("LOG_ENTRY")[0].size
    client.send(mavlink.MAVLink_log_request_data_message(1, 1, first, 0, size))
    assert client.command(ARM, 1) == 0
    client.run(1.0)
    assert bool(client.all("LOG_DATA")) is sent
    client.received.clear()
    for _ in range(3):
        client.send(listing)
        client.run(0.1)
    if not sent:
        client.send(mavlink.MAVLink_log_erase_message(1, 1))
    assert bool(client.all("LOG_ENTRY")) is sent
    refusals = [m.severity for m in client.all("STATUSTEXT") if m.text == "Disarm for log download"]
    assert refusals == [] if sent else [mavlink.MAV_SEVERITY_ERROR]
    if not sent:
        assert client.command(ARM, 0) == 0
        client.run(2.0)
        assert sum(m.count for m in client.all("LOG_DATA")) > size // 2


@pytest.mark.parametrize(("name", "value"), [("SDLOG_MODE", -1), ("SDLOG_MODE", 0)])
def test_no_log_when_none_is_wanted(name: str, value: float) -> None:
    memory = card()
    client = Client("px4", memory, {name: value})
    client.run(5.0)
    assert memory.files.entries(()) == []
    assert len(client.vehicle.autopilot.channels) == 1  # the client's: a log costs nothing then


def test_a_full_card_ends_the_log_and_says_so() -> None:
    memory = MemoryCard(files=MemoryStore(Quota(size_bytes=100_000, files=10)), logs=True)
    client = Client("px4", memory, {"SDLOG_MODE": 2})
    client.run(10.0)
    texts = [message.text for message in client.all("STATUSTEXT")]
    assert texts.count("Logging stopped: No space left on device") == 1
    assert 90_000 < memory.files.usage.size_bytes <= 100_000  # type: ignore[attr-defined]


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_parameters_outlive_runs_and_reboots(flavour: str, tmp_path: Path) -> None:
    name, value = CHANGED[flavour]
    store = FolderStore(tmp_path)
    client = Client(flavour, MemoryCard(files=store))
    before = client.get(name)
    client.set(name, value)
    store.close()  # as kill -9 leaves it: nothing was closed in the vehicle
    store = FolderStore(tmp_path)
    client = Client(flavour, MemoryCard(files=store))
    assert client.get(name) == value
    client = Client(flavour, MemoryCard(files=store), {name: before + 1.0})  # the command line goes before
    assert client.get(name) == before + 1.0
    store.close()


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_plans_outlive_runs(flavour: str, tmp_path: Path) -> None:
    """An uploaded plan is there in the next run, the same to the last bit."""
    store = FolderStore(tmp_path)
    client = Client(flavour, MemoryCard(files=store))
    client.run(3.0)
    places = ((47.3, 8.4), (47.3, 8.7), (47.5, 8.55))
    fence = [
        MissionItem(command=mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, frame=3, param1=3.0, x=x, y=y)
        for x, y in places
    ]
    rally = [MissionItem(command=mavlink.MAV_CMD_NAV_RALLY_POINT, frame=3, x=47.398, y=8.546, z=20.0)]
    client.upload(MissionType.FENCE, fence)
    client.upload(MissionType.RALLY, rally)
    kept = client.vehicle.autopilot.missions._stores
    client.run(0.1)
    store.close()  # as kill -9 leaves it: nothing was closed in the vehicle
    store = FolderStore(tmp_path)
    client = Client(flavour, MemoryCard(files=store))
    again = client.vehicle.autopilot.missions._stores
    for kind, count in ((MissionType.MISSION, 0), (MissionType.FENCE, 3), (MissionType.RALLY, 1)):
        assert len(again[kind].items) == count
        assert (repr(again[kind].items), again[kind].plan_id) == (repr(kept[kind].items), kept[kind].plan_id)
    store.close()


def test_px4_storage_commands() -> None:
    memory = MemoryCard()
    client = Client("px4", memory)
    client.run(3.0)
    client.set("MPC_XY_CRUISE", 7.5)
    assert client.command(STORAGE, 7) is None
    assert client.command(STORAGE, 1) == 0
    assert b"MPC_XY_CRUISE\t7.5" in read_whole(memory.files, LAYOUT["px4"], at_most=1 << 30)
    assert client.command(STORAGE, 2) == 0
    assert client.get("MPC_XY_CRUISE") == 5.0
    assert b"MPC_XY_CRUISE" not in read_whole(memory.files, LAYOUT["px4"], at_most=1 << 30)
    assert client.command(STORAGE, 0) == 0
    client.run(3.0)
    assert client.command(ARM, 1) == 0
    assert client.command(STORAGE, 2) == 1


def test_ardupilot_reset_takes_effect_at_boot() -> None:
    memory = MemoryCard()
    client = Client("ardupilot", memory)
    client.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    client.set("WPNAV_SPEED", 750.0)
    assert client.command(STORAGE, 99) == 2
    assert client.command(STORAGE, 2) == 0
    assert "All parameters reset, reboot board" in [m.text for m in client.all("STATUSTEXT")]
    assert client.get("WPNAV_SPEED") == 750.0
    assert client.command(REBOOT, 1) == 0
    client.run(3.0)
    assert client.get("WPNAV_SPEED") == 1000.0


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_a_damaged_parameter_file_is_kept_and_reported(flavour: str, tmp_path: Path) -> None:
    file = tmp_path / LAYOUT[flavour][0]
    file.write_bytes(b"\xff\x00 nonsense")
    store = FolderStore(tmp_path)
    client = Client(flavour, MemoryCard(files=store))
    client.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    client.run(1.0)
    assert (tmp_path / f"{file.name}.damaged").read_bytes() == b"\xff\x00 nonsense"
    store.close()


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_reboot_starts_again_from_zero(flavour: str) -> None:
    name, value = CHANGED[flavour]
    client = Client(flavour, card())
    client.fly()
    plans = client.vehicle.autopilot.missions._stores
    plan = (
        MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, z=5.0),
        MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=47.0, y=8.0, z=5.0),
    )
    plans[MissionType.MISSION].replace(plan, 77)
    client.set(name, value)
    before = client.vehicle.autopilot
    assert client.command(REBOOT, 1) == 0
    client.run(0.4)
    client.received.clear()
    client.run(0.5)
    assert client.received == []  # it is down
    client.run(2.0)
    after = client.vehicle.autopilot
    assert after is not before and not after.commander.armed
    assert client.all("HEARTBEAT")
    assert client.get(name) == value
    kept = after.missions._stores[MissionType.MISSION]
    assert (kept.items, kept.plan_id) == (plan, 77)
    client.command(mavlink.MAV_CMD_REQUEST_MESSAGE, 2)
    times = [message.time_boot_ms for message in client.all("SYSTEM_TIME")]
    assert times and max(times) < 5000
    client.fly()  # and it is as good as new


@pytest.mark.parametrize(("flavour", "refused"), [("px4", 2), ("ardupilot", 4)])
@pytest.mark.sampled(1)
def test_no_reboot_while_armed(flavour: str, refused: int) -> None:
    client = Client(flavour, MemoryCard())
    client.run(45.0 if flavour == "ardupilot" else 6.0)
    assert client.command(ARM, 1) == 0
    assert client.command(REBOOT, 1) == refused
    before = client.vehicle.autopilot
    client.run(2.0)
    assert client.vehicle.autopilot is before
    assert client.command(REBOOT, 0) == {"px4": 0, "ardupilot": 3}[flavour]


def test_shutdown_is_for_good() -> None:
    client = Client("px4", MemoryCard())
    client.run(3.0)
    assert client.command(REBOOT, 2) == 0
    client.run(1.0)
    client.received.clear()
    client.command(REBOOT, 1)
    client.run(3.0)
    assert client.received == []


def test_packed_parameters_read_back() -> None:
    store = Client("ardupilot", MemoryCard()).vehicle.autopilot.parameters
    store.set("WPNAV_SPEED", 750.0)
    whole = packed_parameters.pack(store, {})
    assert packed_parameters.unpack(whole) == pytest.approx(store.as_dict())
    part = packed_parameters.pack(store, {"start": "10", "count": "5"})
    assert struct.unpack("<HHH", part[:6]) == (0x671B, 5, store.count)
    assert packed_parameters.unpack(packed_parameters.pack(store, {"withdefaults": "1"})) == pytest.approx(
        store.as_dict()
    )
    for cut in range(len(part)):
        try:
            packed_parameters.unpack(part[:cut])
        except ValueError:
            continue
    before = store.as_dict()
    with pytest.raises(ValueError):  # all or nothing
        packed_parameters.apply(store, packed_parameters.pack(store, {}) + b"\x01\x10NO\x05")
    assert store.as_dict() == before


def test_packed_parameters_as_pymavlink_reads_them() -> None:
    mavftp = pytest.importorskip("pymavlink.mavftp")
    if not hasattr(mavftp.MAVFTP, "ftp_param_decode"):
        pytest.skip("this pymavlink has no packed parameters")
    store = Client("ardupilot", MemoryCard()).vehicle.autopilot.parameters
    store.set("WPNAV_SPEED", 750.0)
    decoded = mavftp.MAVFTP.ftp_param_decode(packed_parameters.pack(store, {"withdefaults": "1"}))
    values = {name.decode(): value for name, value, _ in decoded.params}
    assert values == pytest.approx(store.as_dict())
    defaults = {name.decode(): value for name, value, _ in decoded.defaults}
    assert defaults["WPNAV_SPEED"] == 1000.0


def test_mission_file_is_made_of_items_as_on_the_wire() -> None:
    items = (
        MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=-35.0, y=149.0, z=5.0),
        MissionItem(command=mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, param1=float("nan")),
    )
    data = mission_files.packed(items, MissionType.MISSION)
    size = mavlink.MAVLink_mission_item_int_message.unpacker.size
    assert struct.unpack("<HHHHH", data[:10]) == (0x763D, 0, 0, 0, 2)
    assert len(data) == 10 + 2 * size
    first = mavlink.MAVLink_mission_item_int_message.unpacker.unpack(data[10 : 10 + size])
    assert {-350_000_000, 1_490_000_000, 16} <= set(first)
