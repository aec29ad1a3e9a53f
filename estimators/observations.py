"""Observations other than MAVLink messages, such as images, and the file that holds those of a run.

An observation is a frozen dataclass with `time_us` (vehicle time) and `src_system` (system id of the
vehicle); its other fields are numbers, strings, tuples of numbers, or arrays. Those of a run are in
`flight.observations` beside `flight.tlog`. Each record has the number of frames that the log had before it,
so that a replay passes messages and observations to an estimator in the order of the flight.

The file is one of `estimators.dataclass_records`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from estimators.dataclass_records import RecordWriter, read_records
from flightsim.foundation.vectors import Quaternion, Vector

SUFFIX: Final = ".observations"
_MAGIC: Final = b"FSO1"


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
        self._records = RecordWriter(path, _MAGIC)

    def write(self, observation: Observation, frames: int) -> None:
        """Append an observation that was received after this number of frames of the log.

        Raises:
            OSError: the file exists, or can't be written.
        """
        self._records.write(observation, {"frames": frames})

    def close(self) -> None:
        """Close the file."""
        self._records.close()


def observations_beside(log: Path) -> Path | None:
    """The observations of a log's run; None when it has none."""
    path = log.with_suffix(SUFFIX)
    return path if path.is_file() else None


def read_observations(path: Path, kinds: Sequence[type[Any]]) -> Iterator[tuple[int, Observation]]:
    """(number of frames before it, observation) of those kinds, in the order of the file."""
    for header, observation in read_records(path, _MAGIC, kinds):
        frames = header.get("frames")
        if not isinstance(frames, int):
            return
        yield frames, observation
