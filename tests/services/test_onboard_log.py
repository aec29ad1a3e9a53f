"""When an onboard log begins and ends, and that what is written are whole records."""

from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.events import Armed, Disarmed
from autopilot_bridge.mavlink import FrameParser, decode
from autopilot_bridge.services.files.card_layout import LogTimes
from autopilot_bridge.services.files.onboard_log import LogChannel, OnboardLog
from autopilot_bridge.storage.files import Mode, read_whole
from autopilot_bridge.storage.memory import MemoryCard
from tests.services.command_rig import ServiceRig

ARMED_US, DISARMED_US = 10_000_000, 60_000_000
UNIX_US = 1_700_000_000_000_000


class Book:
    """Logs that are numbered as they begin."""

    def __init__(self) -> None:
        self.files = MemoryCard(logs=False).files
        self.started: list[int] = []
        self.full = False

    def create(self, unix_us: int) -> tuple[Any, Any]:
        if self.full:
            raise OSError(28, "No space left on device")
        self.started.append(unix_us)
        path = (f"{len(self.started)}.log",)
        return path, self.files.open(path, Mode.NEW)


class Layout:
    def __init__(self, times: LogTimes | None) -> None:
        self.times = times

    def log_times(self, parameters: Any) -> LogTimes | None:
        return self.times


class Rig:
    def __init__(self, times: LogTimes | None) -> None:
        self.book, self.texts = Book(), []
        self.channels: list[Any] = []
        self.log = OnboardLog(
            self.book,  # type: ignore[arg-type]
            Layout(times),  # type: ignore[arg-type]
            ServiceRig("px4").store,
            lambda severity, text: self.texts.append(text),
            system_id=7,
            unix_us=lambda: UNIX_US,
            add_channel=lambda channel, role: self.channels.append(channel),
            remove_channel=lambda channel: self.channels.remove(channel),
        )

    @property
    def running(self) -> bool:
        assert bool(self.channels) is (self.log.path is not None)
        return self.log.path is not None


def times(**on: bool) -> LogTimes:
    off = {"from_boot": False, "after_disarming": False, "new_at_disarming": False}
    return LogTimes(**(off | on))


def armed(time_us: int = ARMED_US) -> Armed:
    return Armed(
        **{"time_us": time_us, **{name: None for name in Armed.__dataclass_fields__ if name != "time_us"}}
    )


def disarmed(time_us: int = DISARMED_US) -> Disarmed:
    names = [name for name in Disarmed.__dataclass_fields__ if name != "time_us"]
    return Disarmed(**{"time_us": time_us, **dict.fromkeys(names)})


@pytest.mark.parametrize(
    ("when", "at_boot", "in_flight", "after", "logs"),
    [
        (None, False, False, False, 0),
        (times(), False, True, False, 1),
        (times(from_boot=True), True, True, False, 1),
        (times(after_disarming=True), False, True, True, 1),
        (times(from_boot=True, after_disarming=True), True, True, True, 1),
        (times(after_disarming=True, new_at_disarming=True), False, True, True, 2),
        (times(new_at_disarming=True), False, True, False, 1),
    ],
)
def test_times_of_a_log(
    when: LogTimes | None, at_boot: bool, in_flight: bool, after: bool, logs: int
) -> None:
    rig = Rig(when)
    rig.log.tick(20_000)
    assert rig.running is at_boot
    rig.log.follow(armed())
    rig.log.tick(ARMED_US + 20_000)
    assert rig.running is in_flight
    first = rig.log.path
    rig.log.follow(disarmed())
    rig.log.tick(DISARMED_US + 1_999_999)
    assert rig.running is in_flight
    assert rig.log.path == first
    rig.log.tick(DISARMED_US + 2_000_000)
    assert rig.running is after
    assert len(rig.book.started) == logs
    assert set(rig.book.started) <= {UNIX_US}


def test_arming_again_before_the_end_goes_on_in_the_same_log() -> None:
    rig = Rig(times())
    rig.log.follow(armed())
    rig.log.follow(disarmed(DISARMED_US))
    rig.log.follow(armed(DISARMED_US + 1_000_000))
    rig.log.tick(DISARMED_US + 5_000_000)
    assert rig.running
    assert len(rig.book.started) == 1


def text(words: bytes) -> Any:
    return mavlink.MAVLink_statustext_message(6, words)


def test_records_are_written_whole_and_in_order() -> None:
    rig = Rig(times())
    rig.log.follow(armed())
    path = rig.log.path
    assert path is not None
    for k in range(3):
        rig.channels[0].send(text(f"text {k}".encode()))
        rig.log.tick(ARMED_US + 20_000 * k)
    rig.channels[0].send(text(b"the last"))
    rig.log.close()
    assert not rig.running
    data = read_whole(rig.book.files, path, at_most=1 << 30)
    found = []
    while data:
        assert int.from_bytes(data[:8], "big") == UNIX_US
        size = 12 + data[9]
        (frame,) = FrameParser().feed(data[8 : 8 + size])
        message = decode(frame)
        assert (frame.system_id, frame.component_id) == (7, 1)
        found.append(message.text)  # type: ignore[attr-defined]
        data = data[8 + size :]
    assert found == ["text 0", "text 1", "text 2", "the last"]


def test_a_channel_has_no_records_twice() -> None:
    channel = LogChannel(1, lambda: UNIX_US)
    assert channel.take() == b""
    channel.send(text(b"once"))
    assert channel.take()
    assert channel.take() == b""


def test_a_full_card_is_reported() -> None:
    rig = Rig(times())
    rig.book.full = True
    rig.log.follow(armed())
    assert not rig.running
    assert rig.texts == ["Logging failed: No space left on device"]
