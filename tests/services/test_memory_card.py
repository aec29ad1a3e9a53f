"""Reboot, stored parameters and logs: the services that use the computer of the autopilot and its card."""

from typing import Any

import pytest

from autopilot_bridge.commander.events import RebootRequested
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.commands.command import Command
from autopilot_bridge.services.commands.power import PowerService
from autopilot_bridge.services.files.log_book import LogBook
from autopilot_bridge.services.files.log_transfer import LogTransferService
from autopilot_bridge.services.parameters.parameter_file import StoredParameters
from autopilot_bridge.services.parameters.storage import ParameterStorageService
from autopilot_bridge.services.vehicle_memory import PowerAction
from autopilot_bridge.storage import Mode, VehiclePath
from autopilot_bridge.storage.files import make_directories
from autopilot_bridge.storage.memory import MemoryStore
from tests.services.command_rig import Channel, ServiceRig
from tests.services.dispatch import deliver
from tests.services.parts_rig import DATA

ACCEPTED, TEMPORARILY_REJECTED, DENIED, UNSUPPORTED, FAILED = 0, 1, 2, 3, 4
REBOOT, SHUTDOWN = PowerAction.REBOOT, PowerAction.SHUTDOWN
FORCE = 20190226.0
START_US = 5_000_000


def command(number: int, p1: float, p6: float = 0.0) -> Command:
    return Command(number, p1, 0.0, 0.0, 0.0, 0.0, p6, 0.0, None)


# reboot


class Power:
    """The service on a vehicle, and what it does with the computer."""

    def __init__(self, flavour: str, *, possible: bool = True) -> None:
        self.rig = ServiceRig(flavour)
        self.done: list[PowerAction] = []
        act = self.done.append if possible else None
        self.service = PowerService(DATA[flavour].POWER, self.rig.commander, act)
        self.service.tick(START_US)

    def ask(self, p1: float, p6: float = 0.0) -> Any:
        handler = self.service.commands[dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN]
        return handler(command(dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, p1, p6), self.rig.source)


@pytest.mark.parametrize(
    ("flavour", "p1", "result", "done"),
    [
        ("px4", 0, ACCEPTED, []),
        ("px4", 1, ACCEPTED, [REBOOT]),
        ("px4", 2, ACCEPTED, [SHUTDOWN]),
        ("px4", 3, ACCEPTED, [REBOOT]),
        ("px4", 4, DENIED, []),
        ("px4", -1, DENIED, []),
        ("ardupilot", 0, UNSUPPORTED, []),
        ("ardupilot", 1, ACCEPTED, [REBOOT]),
        ("ardupilot", 2, UNSUPPORTED, []),
        ("ardupilot", 3, ACCEPTED, [REBOOT]),
        ("ardupilot", float("nan"), UNSUPPORTED, []),
        ("px4", float("nan"), ACCEPTED, []),
    ],
)
def test_each_firmware_reboots_for_its_values(
    flavour: str, p1: float, result: int, done: list[PowerAction]
) -> None:
    power = Power(flavour)
    assert power.ask(p1) == result
    power.service.tick(START_US + 1_000_000)
    power.service.tick(START_US + 2_000_000)
    assert power.done == done


@pytest.mark.parametrize(("flavour", "delay_us"), [("px4", 400_000), ("ardupilot", 200_000)])
def test_the_acknowledgement_leaves_before_the_computer_stops(flavour: str, delay_us: int) -> None:
    power = Power(flavour)
    assert power.ask(1) == ACCEPTED
    power.service.tick(START_US + 100_000)
    assert power.ask(3) == ACCEPTED  # repeated: one reboot, at the first one's time
    power.service.tick(START_US + delay_us - 1)
    assert power.done == []
    power.service.tick(START_US + delay_us)
    assert power.done == [REBOOT]
    events = power.rig.commander.drain_events()
    assert len([event for event in events if isinstance(event, RebootRequested)]) == 1


@pytest.mark.parametrize(
    ("flavour", "p6", "result"),
    [
        ("px4", 0.0, DENIED),
        ("px4", FORCE, DENIED),
        ("ardupilot", 0.0, FAILED),
        ("ardupilot", FORCE, ACCEPTED),
    ],
)
def test_an_armed_vehicle_reboots_only_by_force(flavour: str, p6: float, result: int) -> None:
    power = Power(flavour)
    assert power.rig.commander.arm().accepted
    assert power.ask(1, p6) == result
    power.service.tick(START_US + 1_000_000)
    assert power.done == ([REBOOT] if result == ACCEPTED else [])


@pytest.mark.parametrize(("p6", "done"), [(0.0, []), (FORCE, [REBOOT])])
def test_arming_during_the_delay_cancels_a_reboot_without_force(p6: float, done: list[PowerAction]) -> None:
    power = Power("ardupilot")
    assert power.ask(1, p6) == ACCEPTED
    assert power.rig.commander.arm().accepted
    power.service.tick(START_US + 1_000_000)
    assert power.done == done


def test_an_autopilot_that_nothing_restarts_refuses() -> None:
    assert Power("px4", possible=False).ask(1) == DENIED
    assert Power("ardupilot", possible=False).ask(1) == FAILED


# stored parameters


NAME = {"px4": "MPC_XY_CRUISE", "ardupilot": "WPNAV_SPEED"}
INITIAL = {"px4": 6.0, "ardupilot": 600.0}


class Storage:
    """The service with a card in memory, and one parameter that is set at the start."""

    def __init__(self, flavour: str) -> None:
        self.rig = ServiceRig(flavour, **{NAME[flavour]: INITIAL[flavour]})
        self.flavour, self.store, self.files = flavour, self.rig.store, MemoryStore()
        self.texts: list[str] = []
        layout = DATA[flavour].CARD
        self.path = layout.parameters
        self.service = ParameterStorageService(
            StoredParameters(self.store, self.files, layout, system_id=1),
            self.store,
            self.rig.commander,
            DATA[flavour].STORAGE,
            layout,
            lambda severity, text: self.texts.append(text),
        )
        self.service.tick(START_US)

    @property
    def value(self) -> float:
        return self.store.get(NAME[self.flavour])

    @value.setter
    def value(self, value: float) -> None:
        self.store.set(NAME[self.flavour], value)

    def saved(self) -> bool:
        """The card has the value in use."""
        try:
            text = self.files.open(self.path, Mode.READ).read(0, 100_000).decode()
        except OSError:
            return False
        return any(NAME[self.flavour] in line and f"{self.value:g}" in line for line in text.split("\n"))

    def ask(self, p1: float) -> Any:
        handler = self.service.commands[dialect.MAV_CMD_PREFLIGHT_STORAGE]
        return handler(command(dialect.MAV_CMD_PREFLIGHT_STORAGE, p1), self.rig.source)


@pytest.mark.parametrize(("flavour", "delay_us"), [("px4", 300_000), ("ardupilot", 0)])
def test_a_change_is_stored_after_the_firmwares_delay(flavour: str, delay_us: int) -> None:
    storage = Storage(flavour)
    storage.value = INITIAL[flavour] + 1
    if delay_us:
        storage.service.tick(START_US + 100_000)
        storage.value = INITIAL[flavour] + 2  # does not postpone it
        storage.service.tick(START_US + delay_us - 1)
        assert not storage.saved()
    storage.service.tick(START_US + delay_us)
    assert storage.saved()


def test_pending_changes_are_stored_when_the_autopilot_goes_down() -> None:
    storage = Storage("px4")
    storage.service.close()
    with pytest.raises(OSError):
        storage.files.entry(storage.path)  # nothing has changed, nothing is written
    storage.value = 7.0
    storage.service.close()
    assert storage.saved()


@pytest.mark.parametrize(
    ("p1", "result", "value"),
    [(0, ACCEPTED, 7.0), (1, ACCEPTED, 9.0), (2, ACCEPTED, 6.0), (3, ACCEPTED, 9.0), (4, ACCEPTED, 6.0)],
)
def test_px4_loads_saves_and_resets(p1: int, result: int, value: float) -> None:
    """7 is on the card, 9 in use, 6 the value at the start."""
    storage = Storage("px4")
    storage.value = 7.0
    assert storage.ask(1) == ACCEPTED and storage.saved()
    storage.value = 9.0
    assert storage.ask(p1) == result
    assert storage.value == value
    assert storage.saved() == (value != 6.0)  # a value as at the start is not stored


def test_an_action_that_is_no_number_loads() -> None:
    storage = Storage("px4")
    storage.value = 7.0
    storage.ask(1)
    storage.value = 9.0
    assert storage.ask(float("nan")) == ACCEPTED and storage.value == 7.0


def test_loading_is_no_change_to_be_stored() -> None:
    storage = Storage("px4")
    storage.value = 7.0
    storage.ask(1)
    storage.files.remove(storage.path)
    assert storage.ask(0) == ACCEPTED and storage.value == 6.0
    storage.service.tick(START_US + 1_000_000)
    assert not storage.saved()
    storage.value = 8.0
    storage.service.tick(START_US + 2_000_000)
    assert storage.saved()


def test_px4_resets_the_sensors_alone() -> None:
    storage = Storage("px4")
    sensor = next(name for name in storage.store.as_dict() if name.startswith(("CAL_", "SENS_")))
    before = storage.store.get(sensor)
    storage.store.set(sensor, before + 1, check_range=False)
    storage.value = 9.0
    assert storage.ask(3) == ACCEPTED
    assert (storage.store.get(sensor), storage.value) == (before, 9.0)


@pytest.mark.parametrize(
    ("flavour", "p1", "result"),
    [("px4", 5, None), ("px4", -1, None), *(("ardupilot", p1, DENIED) for p1 in (0, 1, 3, 4))],
)
def test_other_actions_are_unknown(flavour: str, p1: int, result: int | None) -> None:
    assert Storage(flavour).ask(p1) == result


def test_ardupilot_resets_at_the_next_boot() -> None:
    storage = Storage("ardupilot")
    storage.value = 900.0
    storage.service.tick(START_US)
    assert storage.saved()
    assert storage.ask(2) == ACCEPTED
    assert storage.value == 900.0 and not storage.saved()
    assert storage.texts == ["All parameters reset, reboot board"]
    storage.service.tick(START_US + 1_000_000)
    assert not storage.saved()


@pytest.mark.parametrize(("flavour", "result"), [("px4", TEMPORARILY_REJECTED), ("ardupilot", DENIED)])
def test_nothing_is_reset_while_armed(flavour: str, result: int) -> None:
    storage = Storage(flavour)
    storage.value = INITIAL[flavour] + 1
    assert storage.rig.commander.arm().accepted
    assert storage.ask(2) == result and storage.value == INITIAL[flavour] + 1


def test_a_full_card_is_reported_once_until_it_has_room_again() -> None:
    storage = Storage("px4")
    replace, fails = storage.files.rename, True

    def rename(old: VehiclePath, new: VehiclePath) -> None:
        if fails:
            raise OSError(28, "No space left on device")
        replace(old, new)

    storage.files.rename = rename  # type: ignore[method-assign]
    assert storage.ask(1) == FAILED and storage.ask(1) == FAILED
    assert storage.texts == ["Storing parameters failed: No space left on device"]
    fails = False
    assert storage.ask(1) == ACCEPTED
    fails = True
    assert storage.ask(1) == FAILED and len(storage.texts) == 2


# logs


def put(files: MemoryStore, path: VehiclePath, data: bytes) -> None:
    make_directories(files, path[:-1])
    file = files.open(path, Mode.NEW)
    file.write(0, data)
    file.close()


def began(unix_s: int, more: bytes = b"") -> bytes:
    """A log whose first record has this time stamp."""
    return (unix_s * 1_000_000).to_bytes(8, "big") + more


def test_px4_has_a_folder_for_each_day_and_a_file_for_each_second() -> None:
    files = MemoryStore()
    book = LogBook(files, DATA["px4"].CARD)
    paths = []
    for unix_s in (1_700_000_000, 1_700_000_000, 1_700_000_000, 1_700_086_401):
        path, file = book.create(unix_s * 1_000_000 + 999_999)
        file.write(0, began(unix_s))
        file.close()
        paths.append(path)
    assert paths == [
        ("log", "2023-11-14", "22_13_20.tlog"),
        ("log", "2023-11-14", "22_13_20_2.tlog"),
        ("log", "2023-11-14", "22_13_20_3.tlog"),
        ("log", "2023-11-15", "22_13_21.tlog"),
    ]
    logs = book.logs()
    assert [log.number for log in logs] == [0, 1, 2, 3]
    assert {log.path: log.time_utc_s for log in logs} == dict(
        zip(paths, (1_700_000_000, 1_700_000_000, 1_700_000_000, 1_700_086_401), strict=True)
    )


def test_ardupilot_numbers_its_logs_from_1() -> None:
    files = MemoryStore()
    book = LogBook(files, DATA["ardupilot"].CARD)
    for name in ("00000003.tlog", "00000012.bin", "notes.txt", "99999999999.tlog"):
        put(files, ("LOGS", name), began(1_600_000_000, b"123"))
    path, file = book.create(0)
    file.close()
    assert path == ("LOGS", "00000013.tlog")
    assert [(log.number, log.path[-1], log.size, log.time_utc_s) for log in book.logs()] == [
        (1, "00000003.tlog", 11, 1_600_000_000),
        (2, "00000012.bin", 11, 0),
        (3, "00000013.tlog", 0, 0),
        (4, "99999999999.tlog", 11, 1_600_000_000),
    ]


@pytest.mark.parametrize(
    ("names", "created"),
    [
        ((), "00000001"),
        (("notes.tlog",), "00000001"),  # not a number
        (("999999999.tlog",), "1000000000"),
        (("9999999999.tlog", "00000002.tlog"), "00000003"),  # more than nine digits
    ],
)
def test_ardupilots_next_log_has_the_next_number(names: tuple[str, ...], created: str) -> None:
    files = MemoryStore()
    for name in names:
        put(files, ("LOGS", name), b"1")
    path, file = LogBook(files, DATA["ardupilot"].CARD).create(0)
    file.close()
    assert path[-1] == f"{created}.tlog"


def test_the_time_of_a_log_fits_its_field() -> None:
    files = MemoryStore()
    put(files, ("LOGS", "00000001.tlog"), b"\xff" * 8)
    put(files, ("LOGS", "00000002.tlog"), began(1_600_000_000)[:7])
    assert [log.time_utc_s for log in LogBook(files, DATA["ardupilot"].CARD).logs()] == [0xFFFFFFFF, 0]


def test_erasing_keeps_the_running_log_and_other_files() -> None:
    files = MemoryStore()
    kept = ("log", "2023-11-15", "08_00_00.tlog")
    for path in (kept, ("log", "2023-11-14", "07_00_00.ulg"), ("log", "2023-11-13", "notes.txt")):
        put(files, path, b"1")
    book = LogBook(files, DATA["px4"].CARD)
    book.erase(but=kept)
    assert [log.path for log in book.logs()] == [kept]
    assert sorted(entry.name for entry in files.entries(("log",))) == ["2023-11-13", "2023-11-15"]


class Transfer:
    """A vehicle with two logs, of 250 and 90 bytes."""

    def __init__(self, flavour: str = "px4") -> None:
        self.files = MemoryStore()
        self.contents = (began(1_700_000_000, bytes(range(242))), bytes(range(90)))
        layout = DATA[flavour].CARD
        folder = ("2023-11-14",) if layout.log_folder_by_day else ()
        for name, content in zip(("1.tlog", "2.ulg"), self.contents, strict=True):
            put(self.files, (*layout.logs, *folder, name), content)
        self.armed = False
        self.service = LogTransferService(
            LogBook(self.files, layout), lambda: None, lambda: self.armed, layout.armed_refusal
        )
        self.time_us = START_US

    def ask(self, message: Any, source: Source) -> None:
        deliver(message, source, self.time_us, self.service)

    def tick(self, times: int = 1) -> None:
        for _ in range(times):
            self.service.tick(self.time_us)


def client(component: int = 190) -> Source:
    return Source(Channel(), 255, component)


def list_of(start: int = 0, end: int = 65535) -> Any:
    return dialect.MAVLink_log_request_list_message(1, 1, start, end)


def data_of(log: int, offset: int, count: int) -> Any:
    return dialect.MAVLink_log_request_data_message(1, 1, log, offset, count)


def received(source: Source) -> list[Any]:
    sent, source.channel.sent = source.channel.sent, []  # type: ignore[attr-defined]
    return sent  # type: ignore[no-any-return]


def data(source: Source) -> list[tuple[int, int, bytes]]:
    return [(message.id, message.ofs, bytes(message.data[: message.count])) for message in received(source)]


@pytest.mark.parametrize(("flavour", "first"), [("px4", 0), ("ardupilot", 1)])
def test_every_entry_of_the_log_list(flavour: str, first: int) -> None:
    transfer, asker = Transfer(flavour), client()
    transfer.ask(list_of(), asker)
    transfer.tick()
    assert [(e.id, e.num_logs, e.last_log_num, e.time_utc, e.size) for e in received(asker)] == [
        (first, 2, first + 1, 1_700_000_000, 250),
        (first + 1, 2, first + 1, 0, 90),
    ]
    for start, end, numbers in ((first + 1, 9, [first + 1]), (0, first, [first]), (first + 2, 9, [])):
        transfer.ask(list_of(start, end), asker)
        transfer.tick()
        assert [entry.id for entry in received(asker)] == numbers


def test_an_empty_card_has_one_entry_of_zeros() -> None:
    transfer, asker = Transfer(), client()
    transfer.ask(dialect.MAVLink_log_erase_message(1, 1), asker)
    transfer.ask(list_of(), asker)
    transfer.tick()
    (entry,) = received(asker)
    assert (entry.id, entry.num_logs, entry.last_log_num, entry.time_utc, entry.size) == (0, 0, 0, 0, 0)


@pytest.mark.parametrize(
    ("offset", "count", "pieces"),
    [
        (0, 90, [(0, 90)]),
        (0, 91, [(0, 90), (90, 1)]),
        (0, 4_000_000_000, [(0, 90), (90, 90), (180, 70)]),
        (200, 90, [(200, 50)]),
        (250, 90, [(250, 0)]),  # the end of the log
        (9999, 90, [(9999, 0)]),
    ],
)
def test_data_come_in_pieces_of_90_bytes(offset: int, count: int, pieces: list[tuple[int, int]]) -> None:
    transfer, asker = Transfer(), client()
    transfer.ask(data_of(0, offset, count), asker)
    transfer.tick(3)
    whole = transfer.contents[0]
    assert data(asker) == [(0, at, whole[at : at + size]) for at, size in pieces]


def test_several_ranges_are_queued_and_repeated_ones_are_not() -> None:
    transfer, asker = Transfer(), client()
    for offset in (180, 0, 180):
        transfer.ask(data_of(0, offset, 10), asker)
    transfer.tick()
    assert [(at, len(part)) for _, at, part in data(asker)] == [(180, 10), (0, 10)]
    transfer.ask(data_of(0, 20, 10), asker)
    transfer.ask(data_of(0, 0, 90_001), asker)  # the rest of the log contains the earlier request
    transfer.tick()
    assert [at for _, at, _ in data(asker)] == [0, 90, 180]
    transfer.ask(data_of(0, 20, 10), asker)
    transfer.ask(data_of(0, 0, 90_000), asker)
    transfer.tick()
    assert [at for _, at, _ in data(asker)] == [20, 0, 90, 180]


def test_another_log_ends_the_download_of_the_first() -> None:
    transfer, asker = Transfer(), client()
    transfer.ask(data_of(0, 0, 90), asker)
    transfer.ask(data_of(1, 0, 90), asker)
    transfer.tick()
    assert data(asker) == [(1, 0, transfer.contents[1])]
    transfer.ask(data_of(0, 0, 90), asker)
    transfer.ask(data_of(7, 0, 90), asker)  # there is none
    transfer.tick()
    assert data(asker) == []
    transfer.ask(data_of(0, 0, 90), asker)
    transfer.ask(dialect.MAVLink_log_request_end_message(1, 1), asker)
    transfer.tick()
    assert data(asker) == []
    transfer.ask(data_of(0, 0, 90), asker)  # the download that was ended begins anew
    transfer.tick()
    assert [at for _, at, _ in data(asker)] == [0]


def test_no_more_than_64_ranges_are_queued() -> None:
    transfer, asker = Transfer(), client()
    for offset in range(70):
        transfer.ask(data_of(0, offset, 1), asker)
    transfer.tick(3)
    assert [at for _, at, _ in data(asker)] == list(range(64))


def test_forty_replies_are_sent_in_each_fiftieth_of_a_second() -> None:
    transfer, asker = Transfer(), client()
    for offset in range(50):
        transfer.ask(data_of(0, offset, 1), asker)
    transfer.tick()
    assert len(data(asker)) == 40


def test_sixteen_clients_load_at_once_and_the_oldest_makes_room() -> None:
    transfer, askers = Transfer(), [client(component) for component in range(17)]
    for asker in askers:
        transfer.time_us += 1
        transfer.ask(data_of(0, 0, 90), asker)
    transfer.tick()
    assert [len(received(asker)) for asker in askers] == [0] + [1] * 16


@pytest.mark.parametrize(("idle_us", "known"), [(60_000_000, True), (60_000_001, False)])
def test_an_idle_client_is_forgotten_after_a_minute(idle_us: int, known: bool) -> None:
    """Its log is closed; the one with this number may have been erased and written anew by then."""
    transfer, asker = Transfer(), client()
    transfer.ask(data_of(0, 0, 90), asker)
    transfer.tick()
    received(asker)
    transfer.time_us += idle_us
    transfer.tick()
    path = ("log", "2023-11-14", "1.tlog")
    transfer.files.remove(path)
    transfer.ask(data_of(0, 0, 90), asker)
    transfer.tick()
    assert bool(data(asker)) == known


def test_ardupilot_sends_no_logs_while_armed() -> None:
    transfer, asker = Transfer("ardupilot"), client()
    transfer.ask(data_of(1, 0, 180), asker)
    transfer.armed = True
    transfer.tick()
    for _ in range(2):
        transfer.ask(list_of(), asker)
    (refusal,) = received(asker)
    assert (refusal.severity, refusal.text) == (dialect.MAV_SEVERITY_ERROR, "Disarm for log download")
    transfer.armed = False
    transfer.tick()  # the running download continues
    assert [at for _, at, _ in data(asker)] == [0, 90]
    transfer.ask(list_of(), asker)
    received(asker)
    transfer.armed = True
    transfer.ask(list_of(), asker)
    assert len(received(asker)) == 1


def test_px4_sends_logs_in_flight() -> None:
    transfer, asker = Transfer(), client()
    transfer.armed = True
    transfer.ask(data_of(0, 0, 90), asker)
    transfer.tick()
    assert len(data(asker)) == 1
