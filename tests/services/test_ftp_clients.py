"""Clients and sessions of MAVLink FTP: how many there may be, and when they are forgotten."""

import errno

import pytest

from autopilot_bridge.services.channel import Source
from autopilot_bridge.services.files import ftp_sessions as ftp
from autopilot_bridge.services.files.ftp_protocol import FtpError, FtpRefusal
from tests.services.command_rig import Channel

NOW_US = 100_000_000


class File:
    """A file that notes whether it is closed."""

    def __init__(self) -> None:
        self.closed = False

    def close(self) -> None:
        self.closed = True


def source(number: int, channel: Channel) -> Source:
    return Source(channel, 255, number)


def open_session(client: ftp.Client, number: int, time_us: int) -> File:
    file = File()
    session = ftp.Session(number, file, writable=False, used_us=time_us)  # type: ignore[arg-type]
    client.sessions[number] = session
    return file


def test_as_many_clients_as_there_may_be_and_then_the_longest_idle_one_goes() -> None:
    clients, channel = ftp.Clients(), Channel()
    for number in range(ftp.MAX_CLIENTS):
        clients.client(source(number + 1, channel), NOW_US + number)
    first = next(iter(clients))
    assert len(list(clients)) == ftp.MAX_CLIENTS == 32
    clients.client(source(1, channel), NOW_US + 1000)  # seen again
    clients.client(source(200, channel), NOW_US + 2000)
    assert len(list(clients)) == ftp.MAX_CLIENTS
    known = {client.component_id for client in clients}
    assert first.component_id in known
    assert 200 in known
    assert 2 not in known  # idle longest


def test_a_client_with_an_open_file_outlives_one_without() -> None:
    clients, channel = ftp.Clients(), Channel()
    busy = clients.client(source(1, channel), NOW_US)
    file = open_session(busy, 0, NOW_US)
    for number in range(1, ftp.MAX_CLIENTS + 1):
        clients.client(source(number + 1, channel), NOW_US + number)
    assert 1 in {client.component_id for client in clients}
    assert not file.closed


def test_a_client_on_another_channel_of_that_name_starts_again() -> None:
    clients = ftp.Clients()
    before = clients.client(source(1, Channel("link")), NOW_US)
    file = open_session(before, 0, NOW_US)
    after = clients.client(source(1, Channel("link")), NOW_US)
    assert after is not before
    assert file.closed
    assert len(list(clients)) == 1


@pytest.mark.parametrize(("idle_us", "kept"), [(ftp.IDLE_US, True), (ftp.IDLE_US + 1, False)])
def test_idle_sessions_are_closed_and_their_clients_forgotten(idle_us: int, kept: bool) -> None:
    clients, channel = ftp.Clients(), Channel()
    with_file = clients.client(source(1, channel), NOW_US)
    clients.client(source(2, channel), NOW_US)
    file = open_session(with_file, 0, NOW_US)
    clients.close_idle(NOW_US + idle_us)
    assert file.closed is not kept
    assert len(list(clients)) == (2 if kept else 0)


@pytest.mark.parametrize(
    ("age_us", "repeated"), [(0, True), (ftp.REPEAT_US, True), (ftp.REPEAT_US + 1, False)]
)
def test_a_repeated_request_gets_the_same_reply_for_a_short_time(age_us: int, repeated: bool) -> None:
    client = ftp.Clients().client(source(1, Channel()), NOW_US)
    client.remember(b"request", b"reply", NOW_US)
    assert client.repeated(b"request", NOW_US + age_us) == (b"reply" if repeated else None)
    assert client.repeated(b"another", NOW_US) is None


@pytest.mark.parametrize(
    ("code", "data"),
    [
        (errno.ENOENT, (FtpError.FILE_NOT_FOUND,)),
        (errno.EEXIST, (FtpError.FILE_EXISTS,)),
        (errno.EACCES, (FtpError.FILE_PROTECTED,)),
        (errno.EPERM, (FtpError.FILE_PROTECTED,)),
        (errno.EROFS, (FtpError.FILE_PROTECTED,)),
        (errno.ENOSPC, (FtpError.FAIL_ERRNO, errno.ENOSPC)),
        (1000, (FtpError.FAIL_ERRNO, 255)),
        (None, (FtpError.FAIL_ERRNO, errno.EIO)),
    ],
)
def test_refusals_carry_the_systems_error(code: int | None, data: tuple[int, ...]) -> None:
    failure = OSError() if code is None else OSError(code, "text")
    assert FtpRefusal.of_os_error(failure).data == bytes(data)
