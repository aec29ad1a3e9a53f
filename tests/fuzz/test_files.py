"""Damaged, crafted and foreign files for every reader."""

import gzip
import os
import warnings
from pathlib import Path

import pytest

from estimators.errors import EstimatorError
from estimators.survey.map_values import chosen
from tests.fuzz.file_campaign import Reader, campaign
from tests.fuzz.file_readers import readers

_NAMES = tuple(readers())
_OBSERVATIONS = "observations"
"""A reader of the project's own files, beside a log, whose damage ends the file without an error."""


@pytest.mark.parametrize("name", _NAMES)
def test_a_damaged_file_is_read_or_refused_in_one_line(tmp_path: Path, name: str) -> None:
    outcome = campaign(readers()[name], tmp_path, count=12, seed=1, cpu_s=120)
    assert outcome.faults == ()
    assert outcome.read + outcome.refused == 12


@pytest.mark.slow
@pytest.mark.parametrize("name", _NAMES)
def test_many_damaged_files_are_read_or_refused_in_one_line(tmp_path: Path, name: str) -> None:
    outcome = campaign(readers()[name], tmp_path, count=1500, seed=2, cpu_s=1200)
    assert outcome.faults == ()


def _refusal(reader: Reader, path: Path) -> str:
    with pytest.raises(reader.errors) as refused:
        reader.read(path)
    return str(refused.value)


@pytest.mark.parametrize("name", [name for name in _NAMES if name != _OBSERVATIONS])
def test_another_kind_of_file_is_named_for_what_it_is(tmp_path: Path, name: str) -> None:
    reader = readers()[name]
    path = tmp_path / f"file{reader.suffix}"
    for content, words in (
        (gzip.compress(reader.seeds[0]), "it is compressed with gzip; unpack it with gunzip"),
        (b"version https://git-lfs.github.com/spec/v1\nsize 77\n", "it is a Git LFS pointer to a file of 77"),
        (b"<!DOCTYPE html><html><body>Not found</body></html>", "it is a web page (HTML)"),
    ):
        path.write_bytes(content)
        assert words in _refusal(reader, path)


@pytest.mark.parametrize("name", [name for name in _NAMES if name not in (_OBSERVATIONS, "vehicle")])
def test_a_pipe_is_refused_without_waiting(tmp_path: Path, name: str) -> None:
    reader = readers()[name]
    path = tmp_path / f"file{reader.suffix}"
    os.mkfifo(path)
    assert "it is a pipe" in _refusal(reader, path)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("calibration", "image_width: 640\nimage_height: " + "(" * 5000, "is not a whole number of pixels"),
        ("world", "x = '" + "{" * 5000 + "'", "has 5000 characters; accepted are 1000"),
        ("vehicle", f'[vehicle]\nname = "a"\nkind = "fixed_wing"\njsbsim = "{"b" * 400}"', "name too long"),
        (
            "esri grid",
            "ncols 2\nnrows 2\nxllcorner inf\nyllcorner 0\ncellsize 1\n48000 48001\n48002 48003\n",
            "grid lines",
        ),
    ],
)
def test_long_texts_and_infinite_places_are_refused_in_one_short_line(
    tmp_path: Path, name: str, content: str, words: str
) -> None:
    """Faults of the slow campaign."""
    reader = readers()[name]
    path = tmp_path / f"file{reader.suffix}"
    path.write_text(content)
    with warnings.catch_warnings(action="error"):
        refusal = _refusal(reader, path)
    assert words in refusal
    assert len(refusal) < 1500


def test_of_many_bands_a_few_are_named(tmp_path: Path) -> None:
    bands = {str(number): number for number in range(1, 514)}
    with pytest.raises(EstimatorError, match=r"has 513 candidates .*, 20 and 493 more\)"):
        chosen(tmp_path / "a.tif", bands, None)
