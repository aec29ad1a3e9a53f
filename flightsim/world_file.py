"""Reads a world from a TOML file (docs/world.md).

A table of the file has the fields of a parameter class as its keys. The reader follows the type hints of the
classes (`flightsim.foundation.conversion`), so that a new field can be set in files at once.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

from flightsim.environment import Environment
from flightsim.foundation import documents
from flightsim.foundation.conversion import Conversion, NotMade, Refused
from flightsim.foundation.file_content import FileError
from flightsim.foundation.plug_ins import PlugInError, plug_in_class, plug_ins
from flightsim.home import Home
from flightsim.payload import (
    Circle,
    ConstantVelocity,
    DeviceParameters,
    DipoleSignature,
    GaussianSignature,
    InducedDipole,
    MagneticField,
    MagneticSpec,
    PictureDetection,
    RandomWalk,
    ResolutionDetection,
    SignatureSpec,
    Static,
    TargetMotion,
    Terrain,
    TerrainSpec,
)
from flightsim.payload.detection import DetectionModel
from flightsim.payload.payload import DEVICES_GROUP
from flightsim.wind_profile import WindProfile

T = TypeVar("T")


class WorldFileError(ValueError):
    """A world file can't be used; the message names file, key, value and what is accepted."""


def _home(*, lat_deg: float, lon_deg: float, alt_m: float, heading_deg: float = 0.0) -> Home:
    return Home(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m, heading_deg=heading_deg)


_MAKERS: Final[Mapping[Any, Callable[..., Any]]] = {
    Environment: Environment.from_wind,
    Home: _home,
    MagneticSpec | MagneticField: MagneticSpec,
    TerrainSpec | Terrain: TerrainSpec,
}
"""What makes a value of a type from a table, where it is not the class itself."""

_KINDS: Final[Mapping[Any, Mapping[str, type]]] = {
    TargetMotion: {
        "static": Static,
        "straight": ConstantVelocity,
        "circle": Circle,
        "random-walk": RandomWalk,
    },
    SignatureSpec: {"gaussian": GaussianSignature, "dipole": DipoleSignature, "induced": InducedDipole},
    DetectionModel: {"picture": PictureDetection, "resolution": ResolutionDetection},
}
"""Types of which a table selects one by its key `kind`."""


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a world file.

    Raises:
        WorldFileError: it can't be read.
    """
    try:
        return documents.read_toml(path)
    except FileError as error:
        raise WorldFileError(f"world file {error}") from None


def made_from(kind: type[T], table: Any, path: Path) -> T:
    """A value of a parameter class from a table of a file.

    Args:
        kind: the class.
        table: the table.
        path: the file, for errors and for the paths in it.

    Raises:
        WorldFileError: a value is not accepted.
    """
    try:
        devices = {
            name: plug_in_class(DEVICES_GROUP, name, DeviceParameters)  # type: ignore[type-abstract]  # a base
            for name in plug_ins(DEVICES_GROUP)
        }
        conversion = Conversion(
            folder=path.parent,
            makers=_MAKERS,
            kinds={**_KINDS, DeviceParameters: devices},
            short={WindProfile: "law"},
        )
        made: T = conversion.called(kind, table)
    except PlugInError as error:
        raise WorldFileError(f"{path}: {error}") from error
    except NotMade as error:
        raise WorldFileError(f"{path}: {error.where}{error}".replace(": : ", ": ")) from error
    except Refused as error:
        raise WorldFileError(
            f"{path}: {error.where} is {error.value!r}; accepted: {error.accepted}"
        ) from error
    return made
