"""The file `flight.scene` beside the log of a run: what its mission and its estimators showed.

The messages are in the log; with both, a recorded run gives the scene that was live.
"""

from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, get_args

import numpy as np

from estimators.dataclass_records import RecordWriter, read_records
from estimators.scene.shown import Estimates, Shown, Subject
from estimators.scene_items import Placed, Relative, Role
from flightsim.foundation.geodesy import GeodeticPosition

__all__ = ["SUFFIX", "SceneWriter", "read_scene", "scene_beside"]

SUFFIX: Final = ".scene"
_MAGIC: Final = b"FSS1"
_KINDS: Final[tuple[type[Any], ...]] = (*get_args(Placed), Estimates)


class SceneWriter:
    """Writes what is shown; the file is created with the first item.

    Args:
        path: the file; it must not exist.
    """

    def __init__(self, path: Path) -> None:
        self._records = RecordWriter(path, _MAGIC)

    def write(self, shown: Shown) -> None:
        """Append an item.

        Raises:
            OSError: the file exists, or can't be written.
        """
        item, origin = shown.item, shown.origin
        about: dict[str, Any] = {
            "base": shown.subject.base,
            "system_id": shown.subject.system_id,
            "name": shown.name,
            "time_us": shown.time_us,
            "origin": None if origin is None else (origin.lat_deg, origin.lon_deg, origin.alt_m),
        }
        if isinstance(item, Relative):
            about["relative_to"] = item.system_id
            self._records.write(item.item, about)
        else:
            self._records.write(item, about)

    def close(self) -> None:
        """Close the file."""
        self._records.close()


def scene_beside(log: Path) -> Path | None:
    """The recorded scene of a log's run; None when it has none."""
    path = log.with_suffix(SUFFIX)
    return path if path.is_file() else None


def read_scene(path: Path) -> Iterator[Shown]:
    """What was shown, in order; a damaged record ends it."""
    for header, item in read_records(path, _MAGIC, _KINDS):
        try:
            subject = Subject(base=str(header["base"]), system_id=int(header["system_id"]))
            place = header["origin"]
            origin = None
            if place is not None:
                lat_deg, lon_deg, alt_m = map(float, place)
                origin = GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m)
            item = replace(item, role=Role(item.role)) if hasattr(item, "role") else item
            if not _is_sound(item):
                return
            relative_to = header.get("relative_to")
            found = item if relative_to is None else Relative(item=item, system_id=int(relative_to))
            shown = Shown(subject, str(header["name"]), int(header["time_us"]), origin, found)
        except (ValueError, TypeError, LookupError):
            return
        yield shown


_SHAPES: Final[Mapping[str, tuple[tuple[int | None, ...], ...]]] = MappingProxyType(
    {
        "points_ned_m": ((None, 3),),
        "weights": ((None,),),
        "covariance_m2": ((2, 2), (3, 3)),
        "marks_px": ((None, 2),),
        "pixels": ((None, None), (None, None, 3)),
        "values": ((None, None),),
        "pos_ned_m": ((3,),),
        "mean_ned_m": ((3,),),
        "q_ned_from_camera": ((4,),),
    }
)
"""Shapes of the fields of items, by name; None: any length."""


def _is_sound(item: Any) -> bool:
    """Whether arrays and vectors of an item are numbers in the shapes that they have."""
    for field in fields(item):
        shapes = _SHAPES.get(field.name)
        if shapes is None:
            continue
        value = np.asarray(getattr(item, field.name))
        fits = any(
            len(shape) == value.ndim
            and all(own in (None, length) for own, length in zip(shape, value.shape, strict=True))
            for shape in shapes
        )
        if not fits or value.dtype.kind not in "fiu":
            return False
    return True
