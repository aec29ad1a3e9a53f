"""MAVLink FTP by its page (mavlink.io/en/services/ftp.html): requests, errors, repeats and bursts."""

import errno
import zlib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopilot_bridge.services.files.file_transfer import BURST_REPLIES, REPLIES_PER_TICK
from autopilot_bridge.services.files.ftp_protocol import MAX_DATA, FtpError, Opcode, crc32
from autopilot_bridge.services.files.ftp_sessions import IDLE_US, MAX_SESSIONS, MAX_SESSIONS_PER_CLIENT
from autopilot_bridge.storage import MemoryStore, Quota
from autopilot_bridge.storage.folder import FolderStore
from tests.services.ftp_rig import HEADER, FtpRig, Link

DATA = bytes(range(256)) * 40


@pytest.fixture
def rig() -> FtpRig:
    made = FtpRig()
    made.ask(Opcode.CREATE_DIRECTORY, b"/log")
    made.put(b"/log/a.tlog", DATA)
    return made


def test_listing_has_directories_and_files_with_sizes(rig: FtpRig) -> None:
    assert rig.ask(Opcode.LIST_DIRECTORY, b"/").data == b"Dlog\0"
    assert rig.ask(Opcode.LIST_DIRECTORY, b"log/").data == b"Fa.tlog\t%d\0" % len(DATA)
    assert rig.ask(Opcode.LIST_DIRECTORY, b"/", offset=1).error == (FtpError.END_OF_FILE,)


def test_long_listing_comes_in_parts() -> None:
    rig = FtpRig()
    names = [f"a_rather_long_name_{number:03}" for number in range(40)]
    for name in names:
        rig.put(name.encode(), b"x")
    listed: list[bytes] = []
    while (reply := rig.ask(Opcode.LIST_DIRECTORY, b"/", offset=len(listed))).error is None:
        assert len(reply.data) <= MAX_DATA
        listed += reply.data.rstrip(b"\0").split(b"\0")
    assert listed == [f"F{name}\t1".encode() for name in names]


def test_read_in_pieces(rig: FtpRig) -> None:
    opened = rig.ask(Opcode.OPEN_FILE_RO, b"/log/a.tlog")
    assert int.from_bytes(opened.data, "little") == len(DATA)
    read = bytearray()
    while True:
        reply = rig.ask(Opcode.READ_FILE, session=opened.session, offset=len(read), size=100)
        if reply.error is not None:
            break
        read += reply.data
    assert reply.error == (FtpError.END_OF_FILE,)
    assert bytes(read) == DATA


def burst(rig: FtpRig, session: int, size: int = MAX_DATA) -> bytes:
    """Read by bursts, as clients do: a burst that is complete is followed by the next."""
    read, sequence = bytearray(), 1000
    assert rig.send(Opcode.BURST_READ_FILE, session=session, size=size, sequence=sequence) == []
    for _ in range(10_000):
        for reply in rig.run():
            sequence += 1
            assert reply.sequence == sequence & 0xFFFF
            if reply.error is not None:
                assert reply.error == (FtpError.END_OF_FILE,)
                return bytes(read)
            assert reply.offset == len(read)
            read += reply.data
            if reply.complete:
                sequence += 10
                rig.send(
                    Opcode.BURST_READ_FILE, session=session, size=size, offset=len(read), sequence=sequence
                )
    raise AssertionError("no end of file")


@pytest.mark.parametrize("size", [80, 239, 0, 255])
def test_burst_read(rig: FtpRig, size: int) -> None:
    data = DATA * 6
    rig.put(b"long", data)
    session = rig.ask(Opcode.OPEN_FILE_RO, b"long").session
    assert burst(rig, session, size) == data


def test_burst_is_paced_and_waits_for_a_congested_line(rig: FtpRig) -> None:
    rig.put(b"long", bytes(MAX_DATA * 3 * BURST_REPLIES))
    session = rig.ask(Opcode.OPEN_FILE_RO, b"long").session
    rig.link.congested = True
    rig.send(Opcode.BURST_READ_FILE, session=session, size=MAX_DATA)
    assert rig.run(5) == []
    rig.link.congested = False
    assert len(rig.run()) == REPLIES_PER_TICK
    replies = rig.run(50)
    assert len(replies) == BURST_REPLIES - REPLIES_PER_TICK
    assert [reply.complete for reply in replies] == [0] * (len(replies) - 1) + [1]


def test_two_clients_have_sessions_of_their_own(rig: FtpRig) -> None:
    other = Link("other")
    first = rig.ask(Opcode.OPEN_FILE_RO, b"/log/a.tlog", session=3)
    second = rig.ask(Opcode.OPEN_FILE_RO, b"/log/a.tlog", session=3, client=1)
    third = rig.ask(Opcode.OPEN_FILE_RO, b"/log/a.tlog", session=3, link=other)
    assert (first.session, second.session, third.session) == (3, 3, 3)
    rig.ask(Opcode.RESET_SESSIONS)
    assert rig.ask(Opcode.READ_FILE, session=3, size=1).error == (FtpError.INVALID_SESSION,)
    assert rig.ask(Opcode.READ_FILE, session=3, size=1, client=1).error is None
    assert rig.ask(Opcode.READ_FILE, session=3, size=1, link=other).error is None


def test_a_lost_reply_is_repeated_and_nothing_done_twice(rig: FtpRig) -> None:
    first = rig.ask(Opcode.CREATE_FILE, b"new", sequence=7)
    again = rig.ask(Opcode.CREATE_FILE, b"new", sequence=7)
    assert first.whole == again.whole
    rig.ask(Opcode.WRITE_FILE, b"abc", session=first.session)
    for _ in range(3):  # closed once, acknowledged three times
        assert rig.ask(Opcode.TERMINATE_SESSION, session=first.session, sequence=9).error is None
    for _ in range(2):
        assert rig.ask(Opcode.REMOVE_FILE, b"new", sequence=11).error is None
    assert rig.ask(Opcode.REMOVE_FILE, b"new", sequence=13).error == (FtpError.FILE_NOT_FOUND,)


def test_write_truncate_rename_checksum(rig: FtpRig) -> None:
    rig.put(b"b", DATA)
    assert rig.ask(Opcode.TRUNCATE_FILE, b"b", offset=100).error is None
    assert rig.ask(Opcode.RENAME, b"b\0log/c").error is None
    assert rig.send(Opcode.CALC_FILE_CRC32, b"log/c", sequence=50) == []
    (reply,) = rig.run()
    assert int.from_bytes(reply.data, "little") == crc32(DATA[:100])
    assert (reply.sequence, reply.requested) == (51, Opcode.CALC_FILE_CRC32)
    session = rig.ask(Opcode.OPEN_FILE_WO, b"log/c").session
    rig.ask(Opcode.WRITE_FILE, b"XY", session=session, offset=98)
    rig.ask(Opcode.TERMINATE_SESSION, session=session)
    session = rig.ask(Opcode.OPEN_FILE_RO, b"log/c").session
    assert rig.ask(Opcode.READ_FILE, session=session, size=239).data == DATA[:98] + b"XY"


def test_checksum_is_the_one_of_ardupilot_and_px4() -> None:
    """CRC-32 with zero at the start and no inversion, by its polynomial, bit by bit."""
    crc = 0
    for byte in b"123456789":
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
    assert crc32(b"123456789") == crc != zlib.crc32(b"123456789")
    assert crc32(b"6789", crc32(b"12345")) == crc


@pytest.mark.parametrize(
    ("opcode", "data", "error"),
    [
        (Opcode.OPEN_FILE_RO, b"nothing", (FtpError.FILE_NOT_FOUND,)),
        (Opcode.OPEN_FILE_RO, b"log", (FtpError.FAIL_ERRNO, errno.EISDIR)),
        (Opcode.OPEN_FILE_RO, b"log/a.tlog/x", (FtpError.FAIL_ERRNO, errno.ENOTDIR)),
        (Opcode.OPEN_FILE_RO, b"../etc/passwd", (FtpError.FILE_PROTECTED,)),
        (Opcode.OPEN_FILE_RO, b"log/\xff\xfe", (FtpError.FAIL_ERRNO, errno.EILSEQ)),
        (Opcode.OPEN_FILE_RO, b"log/\x1b[2J", (FtpError.FAIL_ERRNO, errno.EILSEQ)),
        (Opcode.CREATE_FILE, b"n" * 200, (FtpError.FAIL_ERRNO, errno.ENAMETOOLONG)),
        (Opcode.CREATE_FILE, b"C:\\x", (FtpError.FAIL_ERRNO, errno.EINVAL)),
        (Opcode.CREATE_FILE, b"no/where", (FtpError.FILE_NOT_FOUND,)),
        (Opcode.CREATE_DIRECTORY, b"log", (FtpError.FILE_EXISTS,)),
        (Opcode.REMOVE_DIRECTORY, b"log", (FtpError.FAIL_ERRNO, errno.ENOTEMPTY)),
        (Opcode.REMOVE_DIRECTORY, b"log/a.tlog", (FtpError.FAIL_ERRNO, errno.ENOTDIR)),
        (Opcode.REMOVE_FILE, b"log", (FtpError.FAIL_ERRNO, errno.EISDIR)),
        (Opcode.REMOVE_FILE, b"x", (FtpError.FILE_NOT_FOUND,)),
        (Opcode.RENAME, b"log", (FtpError.INVALID_DATA_SIZE,)),
        (Opcode.RENAME, b"log\0log/in", (FtpError.FAIL_ERRNO, errno.EINVAL)),
        (Opcode.RENAME, b"x\0y", (FtpError.FILE_NOT_FOUND,)),
        (Opcode.TRUNCATE_FILE, b"x", (FtpError.FILE_NOT_FOUND,)),
        (Opcode.LIST_DIRECTORY, b"x", (FtpError.FILE_NOT_FOUND,)),
        (Opcode.LIST_DIRECTORY, b"log/a.tlog", (FtpError.FAIL_ERRNO, errno.ENOTDIR)),
        (Opcode.CALC_FILE_CRC32, b"x", (FtpError.FILE_NOT_FOUND,)),
        (Opcode.READ_FILE, b"", (FtpError.INVALID_SESSION,)),
        (Opcode.BURST_READ_FILE, b"", (FtpError.INVALID_SESSION,)),
        (Opcode.WRITE_FILE, b"x", (FtpError.INVALID_SESSION,)),
        (Opcode.TERMINATE_SESSION, b"", (FtpError.INVALID_SESSION,)),
        (99, b"", (FtpError.UNKNOWN_COMMAND,)),
    ],
)
@pytest.mark.parametrize("kind", ["memory", "folder"])
def test_refusals(kind: str, opcode: int, data: bytes, error: tuple[int, ...], tmp_path: Path) -> None:
    rig = FtpRig(MemoryStore() if kind == "memory" else FolderStore(tmp_path / "card"))
    rig.ask(Opcode.CREATE_DIRECTORY, b"log")
    rig.put(b"log/a.tlog", DATA)
    reply = rig.ask(opcode, data, sequence=65535)
    assert reply.error == error
    assert (reply.sequence, reply.requested) == (0, opcode)


def test_a_session_for_reading_is_not_for_writing(rig: FtpRig) -> None:
    reading = rig.ask(Opcode.OPEN_FILE_RO, b"log/a.tlog").session
    writing = rig.ask(Opcode.OPEN_FILE_WO, b"log/b").session
    bad = (FtpError.FAIL_ERRNO, errno.EBADF)
    assert rig.ask(Opcode.WRITE_FILE, b"x", session=reading).error == bad
    assert rig.ask(Opcode.READ_FILE, session=writing, size=1).error == bad
    assert rig.ask(Opcode.WRITE_FILE, bytes(239), size=250, session=writing).error == (
        FtpError.INVALID_DATA_SIZE,
    )


def test_sessions_are_limited_and_time_out(rig: FtpRig) -> None:
    for _ in range(MAX_SESSIONS_PER_CLIENT):
        assert rig.ask(Opcode.OPEN_FILE_RO, b"log/a.tlog").error is None
    none_left = (FtpError.NO_SESSIONS_AVAILABLE,)
    assert rig.ask(Opcode.OPEN_FILE_RO, b"log/a.tlog").error == none_left
    for client in range(1, MAX_SESSIONS - MAX_SESSIONS_PER_CLIENT + 1):
        assert rig.ask(Opcode.OPEN_FILE_RO, b"log/a.tlog", client=client).error is None
    assert rig.ask(Opcode.OPEN_FILE_RO, b"log/a.tlog", client=200).error == none_left
    rig.time_us += IDLE_US + 1
    rig.run()
    assert rig.ask(Opcode.OPEN_FILE_RO, b"log/a.tlog", client=200).error is None
    assert rig.ask(Opcode.READ_FILE, session=0, size=1).error == (FtpError.INVALID_SESSION,)


def test_a_full_card_says_so_and_half_writes_nothing() -> None:
    store = MemoryStore(Quota(size_bytes=300, files=2))
    rig = FtpRig(store)
    session = rig.ask(Opcode.CREATE_FILE, b"a").session
    full = (FtpError.FAIL_ERRNO, errno.ENOSPC)
    assert rig.ask(Opcode.WRITE_FILE, bytes(200), session=session).error is None
    assert rig.ask(Opcode.WRITE_FILE, bytes(200), session=session, offset=200).error == full
    assert rig.ask(Opcode.TRUNCATE_FILE, b"a", offset=0xFFFFFFFF).error == full
    assert store.entry(("a",)).size == 200
    assert rig.ask(Opcode.CREATE_DIRECTORY, b"b").error is None
    assert rig.ask(Opcode.CREATE_FILE, b"c").error == full


@pytest.mark.parametrize("opcode", [Opcode.ACK, Opcode.NAK])
def test_replies_are_not_answered(rig: FtpRig, opcode: int) -> None:
    assert rig.send(opcode) == []


@settings(max_examples=300, deadline=None)
@given(st.lists(st.binary(max_size=251), max_size=20))
def test_whatever_comes_is_answered_and_harms_nothing(payloads: list[bytes]) -> None:
    rig = FtpRig(MemoryStore(Quota(size_bytes=10_000, files=20)))
    rig.put(b"kept", DATA[:500])
    for payload in payloads:
        for reply in rig.send_raw(payload):
            assert reply.opcode in (Opcode.ACK, Opcode.NAK)
        rig.run()
    usage = rig.files.usage  # type: ignore[attr-defined]
    assert 0 <= usage.size_bytes <= 10_000
    assert 0 <= usage.files <= 20


PATHS = st.sampled_from(
    [b"a", b"d", b"d/a", b"d/e", b"..", b"/", b"", b"d/../a", b"a\0b", b"d\0d/e", b"\xff"]
)
OPCODES = st.sampled_from([*range(17)])
REQUESTS = st.tuples(
    OPCODES, PATHS, st.integers(0, 3), st.sampled_from([0, 1, 500, 2**32 - 1]), st.integers(0, 255)
)


@settings(max_examples=200, deadline=None)
@given(st.lists(REQUESTS, max_size=40))
def test_memory_and_folder_answer_alike(
    tmp_path_factory: pytest.TempPathFactory, requests: list[tuple[int, bytes, int, int, int]]
) -> None:
    quota = Quota(size_bytes=2000, files=5)
    root = tmp_path_factory.mktemp("card")
    folder = FolderStore(root / "inside", quota)
    rigs = [FtpRig(MemoryStore(quota)), FtpRig(folder)]
    for number, (opcode, path, session, offset, size) in enumerate(requests):
        answers = []
        for rig in rigs:
            header = HEADER.pack(
                2 * number, session, opcode, len(path) if opcode > 2 else size, 0, 0, 0, offset
            )
            replies = rig.send_raw(header + path) + rig.run(2)
            answers.append([reply.whole for reply in replies])
        assert answers[0] == answers[1], (Opcode(opcode) if opcode < 16 else opcode, path, offset)
    assert rigs[0].files.usage.files == rigs[1].files.usage.files  # type: ignore[attr-defined]
    assert rigs[0].files.usage.size_bytes == rigs[1].files.usage.size_bytes  # type: ignore[attr-defined]
    assert [path.name for path in root.iterdir()] == ["inside"]
    rigs[1].service.close()
    folder.close()
