"""A store in a folder: no path leads out of it."""

import errno
import os
from pathlib import Path

import pytest

from autopilot_bridge.storage import FOLDER_QUOTA, Mode, Quota, parse_path
from autopilot_bridge.storage.files import make_directories, read_whole, replace_whole
from autopilot_bridge.storage.folder import FolderStore


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    secret = tmp_path / "secret"
    secret.mkdir()
    (secret / "key").write_text("do not read")
    return secret


@pytest.mark.parametrize("link", ["file", "directory", "dangling", "loop"])
def test_symbolic_links_lead_nowhere(tmp_path: Path, outside: Path, link: str) -> None:
    card = FolderStore(tmp_path / "card")
    target = {
        "file": outside / "key",
        "directory": outside,
        "dangling": outside / "new",
        "loop": tmp_path / "card" / "x",
    }[link]
    (tmp_path / "card" / "x").symlink_to(target)
    for path in (("x",), ("x", "key"), ("x", "new")):
        for mode in (Mode.READ, Mode.WRITE, Mode.REPLACE):
            with pytest.raises(OSError):
                card.open(path, mode)
        for change in (card.remove, card.remove_directory, lambda path: card.truncate(path, 0)):
            with pytest.raises(OSError):
                change(path)
    with pytest.raises(OSError):
        card.entries(("x",))
    with pytest.raises(OSError):
        card.rename(("x",), ("y",))
    assert card.entries(()) == []
    assert (outside / "key").read_text() == "do not read"
    assert [path.name for path in outside.iterdir()] == ["key"]
    card.close()


def test_pipes_and_devices_are_not_opened(tmp_path: Path) -> None:
    card = FolderStore(tmp_path)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError):
        card.open(("pipe",), Mode.READ)  # and doesn't wait for a writer
    assert card.entries(()) == []
    card.close()


@pytest.mark.parametrize(
    ("text", "number"),
    [
        (b"../x", errno.EACCES),
        (b"a/../../x", errno.EACCES),
        (b"a/..", errno.EACCES),
        (b"\xc0\xae\xc0\xae/x", errno.EILSEQ),  # an overlong '..'
        (b"\xed\xb0\x80", errno.EILSEQ),  # half a surrogate pair
        (b"a\nb", errno.EILSEQ),
        ("‮gpj".encode(), errno.EILSEQ),  # writes backwards
        (b"x" * 128, errno.ENAMETOOLONG),
        (b"a/" * 17, errno.ENAMETOOLONG),
    ],
)
def test_paths_that_are_refused(text: bytes, number: int) -> None:
    with pytest.raises(OSError) as refusal:
        parse_path(text)
    assert refusal.value.errno == number


@pytest.mark.parametrize(
    ("text", "names"),
    [(b"/etc/passwd", ("etc", "passwd")), (b"//a/./b/", ("a", "b")), (b"a\0/../b", ("a",)), (b"", ())],
)
def test_absolute_paths_begin_at_the_card(text: bytes, names: tuple[str, ...]) -> None:
    assert parse_path(text) == names


def test_what_lies_there_counts(tmp_path: Path) -> None:
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "f").write_bytes(bytes(900))
    card = FolderStore(tmp_path, Quota(size_bytes=1000, files=3))
    file = card.open(("g",), Mode.NEW)
    with pytest.raises(OSError) as full:
        file.write(0, bytes(101))
    assert full.value.errno == errno.ENOSPC
    file.write(0, bytes(100))
    file.close()
    with pytest.raises(OSError):
        card.make_directory(("h",))
    card.remove(("d", "f"))
    card.remove_directory(("d",))
    assert (card.usage.size_bytes, card.usage.files) == (100, 1)
    card.close()


def test_a_whole_file_is_replaced_in_one_go(tmp_path: Path) -> None:
    card = FolderStore(tmp_path, Quota(size_bytes=100, files=5))
    make_directories(card, ("a", "b"))
    path = ("a", "b", "parameters")
    replace_whole(card, path, b"old")
    with pytest.raises(OSError):
        replace_whole(card, path, bytes(200))
    assert read_whole(card, path, at_most=1 << 30) == b"old"
    assert [entry.name for entry in card.entries(("a", "b"))] == ["parameters"]
    assert card.usage.size_bytes == 3
    card.close()


def test_a_folder_belongs_to_one_run(tmp_path: Path) -> None:
    card = FolderStore(tmp_path)
    with pytest.raises(OSError):
        FolderStore(tmp_path)
    card.close()
    FolderStore(tmp_path, FOLDER_QUOTA).close()
