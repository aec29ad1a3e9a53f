"""What a file is that is not what a reader expects."""

import gzip
import io
import os
import tarfile
import zipfile
from pathlib import Path

import pytest

from flightsim.foundation.file_content import ZIP, FileError, file_head, open_file, read_text


def _zip() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("flight.tlog", b"x")
    return file.getvalue()


def _tar() -> bytes:
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w") as archive:
        archive.addfile(tarfile.TarInfo("flight.tlog"))
    return file.getvalue()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (gzip.compress(b"a log"), "compressed with gzip; unpack it with gunzip"),
        (_zip(), "a ZIP archive; unpack it with unzip"),
        (_tar(), "a tar archive; unpack it with tar"),
        (
            b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n",
            "a Git LFS pointer to a file of 12345 bytes; get the file with `git lfs pull`",
        ),
        (b"/annex/objects/SHA256E-s7--4d7a.tlog\n", "a git-annex pointer"),
        (b"\n<!DOCTYPE html>\n<html>404</html>", r"a web page \(HTML\)"),
        (b"<?xml version='1.0'?>\n<!DOCTYPE html PUBLIC '-//W3C//DTD XHTML 1.0'>", r"a web page \(HTML\)"),
        (b"", "it is empty"),
        ("a,b\n".encode("utf-16"), "text in UTF-16; save it as UTF-8"),
        (b"abc\xff", r"not text \(byte 3 is not UTF-8\)"),
        (b"x" * 101, "it has 101 bytes; accepted are up to 100"),
    ],
)
def test_other_content_is_named(tmp_path: Path, content: bytes, reason: str) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    limit = max(100, 0 if content.startswith(b"xx") else len(content))
    with pytest.raises(FileError, match=rf"a\.csv can't be read: .*{reason}"):
        read_text(path, max_bytes=limit)


def test_what_is_no_regular_file_is_named_without_waiting(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)  # nobody writes to it: an ordinary open would wait
    for path, reason in (
        (pipe, "it is a pipe"),
        (tmp_path, "it is a directory"),
        (Path("/dev/zero"), "it is a device"),
        (tmp_path / "none", "No such file"),
        ("a\0b", "embedded null byte"),
    ):
        with pytest.raises(FileError, match=reason):
            open_file(path)


def test_what_is_accepted_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    path.write_bytes(_zip())
    assert file_head(path, accepted=(ZIP,)) == _zip()
    path.write_bytes(b"\xef\xbb\xbfa = 1")
    assert read_text(path) == "a = 1"
    path.write_bytes(b"")
    assert read_text(path, may_be_empty=True) == ""
