"""Observations other than MAVLink messages, such as images, and the file that holds those of a run.

An observation is a frozen dataclass with `time_us` (vehicle time) and `src_system` (system id of the
vehicle); its other fields are numbers, strings, tuples of numbers, or arrays. Those of a run are in
`flight.observations` beside `flight.tlog`. Each record has the number of frames that the log had before it,
so that a replay passes messages and observations to an estimator in the order of the flight.

The file is a sequence of records: the magic bytes, lengths of header and body (uint32), CRC-32 of both, the
    header
(JSON: kind, frames, fields; arrays as type, shape and place in the body), and the body, compressed by zlib. A
record that is damaged or incomplete ends the file.
"""

import json
import struct
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, BinaryIO, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.vectors import Quaternion, Vector

SUFFIX: Final = ".observations"
_MAGIC: Final = b"FSO1"
_MAX_BODY: Final = 1 << 30
_HEAD: Final = struct.Struct("<4sIII")


class Observation(Protocol):
    """What an estimator observes beside messages."""

    @property
    def time_us(self) -> int: ...

    @property
    def src_system(self) -> int: ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Image:
    """An image, and the camera that took it.

    Attributes:
        time_us: vehicle time of the exposure.
        src_system: system id of the vehicle.
        pixels: (height, width) or (height, width, 3), uint8.
        focal_px: focal lengths, x and y.
        centre_px: principal point.
        distortion: coefficients k1, k2, p1, p2, k3 of Brown's model; empty: none.
        q_ned_from_camera: attitude of the camera (x right, y down, z along the optical axis).
        pos_ned_m: place of the camera from the vehicle's home; NaN: not known.
    """

    time_us: int
    src_system: int
    pixels: NDArray[np.uint8]
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    distortion: tuple[float, ...] = ()
    q_ned_from_camera: Quaternion
    pos_ned_m: Vector


class ObservationWriter:
    """Writes the observations of a run; the file is created with the first one.

    Args:
        path: the file; it must not exist.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: BinaryIO | None = None

    def write(self, observation: Observation, frames: int) -> None:
        """Append an observation that was received after this number of frames of the log.

        Raises:
            OSError: the file exists, or can't be written.
        """
        if self._file is None:
            self._file = self._path.open("xb")
        header: dict[str, Any] = {"kind": type(observation).__name__, "frames": frames}
        arrays, start = [], 0
        for field in fields(observation):  # type: ignore[arg-type]  # observations are dataclasses
            value = getattr(observation, field.name)
            if isinstance(value, np.ndarray):
                raw = np.ascontiguousarray(value).tobytes()
                arrays.append(raw)
                value = {"dtype": value.dtype.str, "shape": value.shape, "start": start}
                start += len(raw)
            header[f".{field.name}"] = value
        head = json.dumps(header).encode()
        body = zlib.compress(b"".join(arrays), 1)
        self._file.write(_HEAD.pack(_MAGIC, len(head), len(body), zlib.crc32(head + body)) + head + body)
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()


def observations_beside(log: Path) -> Path | None:
    """The observations of a log's run; None when it has none."""
    path = log.with_suffix(SUFFIX)
    return path if path.is_file() else None


def read_observations(path: Path, kinds: Sequence[type[Any]]) -> Iterator[tuple[int, Observation]]:
    """(number of frames before it, observation) of those kinds, in the order of the file."""
    known = {kind.__name__: kind for kind in kinds}
    with path.open("rb") as file:
        while len(start := file.read(_HEAD.size)) == _HEAD.size:
            magic, head_size, body_size, crc = _HEAD.unpack(start)
            if magic != _MAGIC or head_size + body_size > path.stat().st_size:
                return
            content = file.read(head_size + body_size)
            if len(content) < head_size + body_size or zlib.crc32(content) != crc:
                return
            try:
                header = json.loads(content[:head_size])
                kind = known.get(header["kind"])
                if kind is None:
                    continue
                body = zlib.decompressobj().decompress(content[head_size:], _MAX_BODY)
                items = header.items()
                values = {name[1:]: _value(value, body) for name, value in items if name.startswith(".")}
                found = int(header["frames"]), kind(**values)
            except (ValueError, TypeError, LookupError, AttributeError, RecursionError, zlib.error):
                return  # no record of this program, though its checksum is right
            yield found


def _value(value: Any, body: bytes) -> Any:
    if isinstance(value, dict):
        shape = tuple(value["shape"])
        array = np.frombuffer(body, value["dtype"], int(np.prod(shape)), value["start"])
        return array.reshape(shape)
    return tuple(value) if isinstance(value, list) else value
