"""A vehicle's description beside its JSBSim model: actuators and truth as property names, from TOML."""

import tomllib
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from flightsim import truth
from flightsim.interface import MAX_ACTUATORS

_MODELS_DIR: Final = Path(__file__).parent / "models"
_DESCRIPTION: Final = "vehicle.toml"


class AirframeError(ValueError):
    """A vehicle model cannot be used; the message says which file and why."""


class AirframeKind(StrEnum):
    """What kind of vehicle it is."""

    MULTICOPTER = "multicopter"
    FIXED_WING = "fixed_wing"


@dataclass(frozen=True, slots=True, kw_only=True)
class Airframe:
    """What the simulator must know of a JSBSim model.

    Attributes:
        name: short name.
        kind: kind of vehicle.
        folder, jsbsim: the JSBSim model is the file `folder/jsbsim.xml`.
        cg_height_at_rest_m: height of the centre of gravity over the ground when it stands.
        actuators: property of each actuator command, in order.
        effectiveness: property of each actuator's effectiveness (1 sound, 0 failed); may be empty.
        truth: (index in the truth vector, property) of what only this model has.
    """

    name: str
    kind: AirframeKind
    folder: Path
    jsbsim: str
    cg_height_at_rest_m: float
    actuators: tuple[str, ...]
    effectiveness: tuple[str, ...]
    truth: tuple[tuple[int, str], ...]

    def __post_init__(self) -> None:
        if not 1 <= len(self.actuators) <= MAX_ACTUATORS:
            raise AirframeError(
                f"vehicle '{self.name}': {len(self.actuators)} actuators; accepted are 1 to {MAX_ACTUATORS}"
            )
        if self.effectiveness and len(self.effectiveness) != len(self.actuators):
            raise AirframeError(
                f"vehicle '{self.name}' names {len(self.effectiveness)} effectiveness properties for "
                f"{len(self.actuators)} actuators; give one for each, or none"
            )
        if not 0.0 <= self.cg_height_at_rest_m <= 100.0:
            raise AirframeError(
                f"vehicle '{self.name}': cg_height_at_rest_m {self.cg_height_at_rest_m} is not 0..100"
            )

    @property
    def xml_path(self) -> Path:
        """The JSBSim file."""
        return self.folder / f"{self.jsbsim}.xml"


def known_models() -> tuple[str, ...]:
    """Names of the models that come with the package."""
    return tuple(sorted(path.parent.name for path in _MODELS_DIR.glob(f"*/{_DESCRIPTION}")))


def load_airframe(model: str | Path) -> Airframe:
    """Read the description of a vehicle.

    Args:
        model: name of a model that comes with the package, or path of a folder with a `vehicle.toml` and a
            JSBSim model, or of the TOML file itself.

    Raises:
        AirframeError: unknown model, or a description that cannot be used.
    """
    path = _find(model)
    try:
        with path.open("rb") as file:
            data = tomllib.load(file)
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise AirframeError(f"cannot read the vehicle description {path}: {error}") from None
    vehicle = _table(data, "vehicle", path)
    actuators = _table(data, "actuators", path)
    kind = _value(vehicle, "kind", str, path)
    try:
        airframe_kind = AirframeKind(kind)
    except ValueError:
        accepted = ", ".join(member.value for member in AirframeKind)
        raise AirframeError(f"{path}: kind '{kind}' is unknown; accepted are {accepted}") from None
    airframe = Airframe(
        name=_value(vehicle, "name", str, path),
        kind=airframe_kind,
        folder=path.parent.resolve(),
        jsbsim=_value(vehicle, "jsbsim", str, path).removesuffix(".xml"),
        cg_height_at_rest_m=float(_value(vehicle, "cg_height_at_rest_m", (int, float), path)),
        actuators=_names(actuators, "properties", path),
        effectiveness=_names(actuators, "effectiveness", path) if "effectiveness" in actuators else (),
        truth=_truth_properties(_table(data, "truth", path), path),
    )
    if not airframe.xml_path.is_file():
        raise AirframeError(f"{path} names the JSBSim model {airframe.xml_path}, which does not exist")
    return airframe


def _find(model: str | Path) -> Path:
    packaged = _MODELS_DIR / str(model) / _DESCRIPTION
    if isinstance(model, str) and model in known_models():
        return packaged
    path = Path(model)
    if path.is_dir():
        path = path / _DESCRIPTION
    if not path.is_file():
        raise AirframeError(
            f"vehicle model '{model}' is unknown; accepted are {', '.join(known_models())} and the path of "
            f"a folder with a {_DESCRIPTION}"
        )
    return path


def _table(data: dict[str, Any], name: str, path: Path) -> dict[str, Any]:
    table = data.get(name)
    if not isinstance(table, dict):
        raise AirframeError(f"{path} has no table [{name}]")
    return table


def _value(table: dict[str, Any], key: str, kind: type | tuple[type, ...], path: Path) -> Any:
    value = table.get(key)
    if not isinstance(value, kind) or isinstance(value, bool):
        expected = "a text" if kind is str else "a number"
        raise AirframeError(f"{path}: {key} is {value!r}; expected is {expected}")
    return value


def _names(table: dict[str, Any], key: str, path: Path) -> tuple[str, ...]:
    names = table.get(key)
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise AirframeError(f"{path}: {key} is {names!r}; expected is a list of JSBSim property names")
    return tuple(names)


def _truth_properties(table: dict[str, Any], path: Path) -> tuple[tuple[int, str], ...]:
    found: list[tuple[int, str]] = []
    for key in table:
        place = getattr(truth, key, None) if key.isupper() else None
        if isinstance(place, slice):
            names = _names(table, key, path)
            if len(names) > place.stop - place.start:
                raise AirframeError(
                    f"{path}: {key} has {len(names)} properties; at most {place.stop - place.start} fit"
                )
            found.extend((place.start + i, name) for i, name in enumerate(names))
        elif isinstance(place, int) and key != "TRUTH_SIZE":
            found.append((place, _value(table, key, str, path)))
        else:
            raise AirframeError(f"{path}: [truth] names {key}, which flightsim/truth.py does not have")
    return tuple(found)
