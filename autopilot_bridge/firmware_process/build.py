"""Where a firmware's program is: `px4=FOLDER`, `ardupilot=FILE`, or the environment."""

import os
import shutil
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

from flightsim.airframe import AirframeKind

FORMS: Final = "px4=FOLDER (with bin/px4 and etc), ardupilot=FILE (arducopter or arduplane), px4, ardupilot"

_VARIABLES: Final[Mapping[tuple[str, AirframeKind], str]] = {
    ("px4", AirframeKind.MULTICOPTER): "FLIGHTSTACK_PX4",
    ("px4", AirframeKind.FIXED_WING): "FLIGHTSTACK_PX4",
    ("ardupilot", AirframeKind.MULTICOPTER): "FLIGHTSTACK_ARDUCOPTER",
    ("ardupilot", AirframeKind.FIXED_WING): "FLIGHTSTACK_ARDUPLANE",
}
FIRMWARES: Final = tuple(dict.fromkeys(name for name, _ in _VARIABLES))


@dataclass(frozen=True, slots=True)
class FirmwareBuild:
    """A firmware that is built on this machine.

    Attributes:
        firmware: "px4" or "ardupilot".
        path: PX4's build folder, or ArduPilot's program; None: as the environment says (FLIGHTSTACK_PX4,
            FLIGHTSTACK_ARDUCOPTER, FLIGHTSTACK_ARDUPLANE).
    """

    firmware: str
    path: Path | None = None

    @classmethod
    def parse(cls, text: str) -> Self:
        """The build that a text names: "px4=FOLDER", "ardupilot=FILE", "px4" or "ardupilot".

        Raises:
            ValueError: it is none of them; the message lists the forms. On Windows, always.
        """
        firmware, equals, path = text.partition("=")
        if firmware not in FIRMWARES or (equals and not path):
            raise ValueError(f"firmware {text!r} is not accepted; give {FORMS}")
        if sys.platform == "win32":
            raise ValueError(
                f"firmware {text!r} is not possible on Windows; start the firmware's SITL in WSL "
                "or elsewhere, and connect to it"
            )
        return cls(firmware, Path(path) if path else None)

    def __str__(self) -> str:
        return self.firmware if self.path is None else f"{self.firmware}={self.path}"

    def located(self, kind: AirframeKind) -> Path:
        """PX4's folder or ArduPilot's program for a class of vehicle, absolute.

        Raises:
            ValueError: nothing is given, or there is no such build; the message says what is needed.
        """
        path = self.path
        source = f"firmware {self}"
        if path is None:
            variable = _VARIABLES[self.firmware, kind]
            given = os.environ.get(variable)
            if not given:
                raise ValueError(f"firmware {self}: give its build ({FORMS}), or set {variable}")
            path, source = Path(given), variable
        return _FOUND[self.firmware](path, source)


def _px4_folder(path: Path, source: str) -> Path:
    missing = [name for name in ("bin/px4", "etc") if not (path / name).exists()]
    if missing:
        raise ValueError(
            f"{source}: {path} has no {' and no '.join(missing)}; it must be PX4's build folder for SITL"
        )
    return path.resolve()


def _ardupilot_program(path: Path, source: str) -> Path:
    found: str | None = shutil.which(path)
    if found is None:
        raise ValueError(f"{source}: {path} is not a program; give ArduPilot's SITL binary")
    return Path(found).resolve()


_FOUND: Final[Mapping[str, Callable[[Path, str], Path]]] = {
    "px4": _px4_folder,
    "ardupilot": _ardupilot_program,
}
