"""Archives of arrays, damaged and crafted."""

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from flightsim.foundation import npz_file
from flightsim.foundation.npz_file import NpzFileError, read_npz


def _npy(values: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.lib.format.write_array(file, values)
    return file.getvalue()


def _save(path: Path, data: bytes, method: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", compression=method) as archive:
        archive.writestr("a.npy", data)
    return path


def test_arrays_come_back(tmp_path: Path) -> None:
    arrays = {
        "a": np.arange(12.0).reshape(3, 4),
        "b": np.asfortranarray(np.arange(6, dtype=np.int16).reshape(2, 3)),
        "c": np.array("text"),
        "d": np.empty((0, 3)),
    }
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "a.npz", **arrays)
        found = read_npz(tmp_path / "a.npz")
        assert found.keys() == arrays.keys()
        for name, values in arrays.items():
            np.testing.assert_array_equal(found[name], values)
            assert found[name].dtype == values.dtype and found[name].flags.writeable


def test_what_can_not_be_unpacked_within_bounds_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.npz"
    whole = _npy(np.zeros(1000))
    for method in (zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2):
        with pytest.raises(NpzFileError, match=r"compressed by method 1\d of ZIP; accepted are"):
            read_npz(_save(path, whole, method))
    with pytest.raises(NpzFileError, match=r"a\.npy has 8128 bytes for the shape \(900000,\)"):
        read_npz(_save(path, whole.replace(b"(1000,), }  ", b"(900000,), }")))
    with pytest.raises(NpzFileError, match="Python objects"):
        read_npz(_save(path, _npy(np.zeros(1000)).replace(b"'<f8'", b"'|O' ")))
    monkeypatch.setattr(npz_file, "_MAX_BYTES", 1 << 20)
    with pytest.raises(NpzFileError, match="it holds 1 arrays of 2097152 bytes"):
        read_npz(_save(path, bytes(2 << 20)))


def test_damage_is_noticed_by_the_checksum(tmp_path: Path) -> None:
    path = _save(tmp_path / "a.npz", _npy(np.arange(1000.0)), zipfile.ZIP_STORED)
    data = bytearray(path.read_bytes())
    data[4000] ^= 1
    path.write_bytes(data)
    with pytest.raises(NpzFileError, match="Bad CRC-32"):
        read_npz(path)
