"""Reading vehicle descriptions: finding the file a user means, and its TOML."""

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from flightsim import truth as t
from flightsim.airframe_channels import read_channels, standard_channel
from flightsim.airframe_types import (
    DEFAULT_LAUNCHES,
    Airframe,
    AirframeError,
    AirframeKind,
    FlightLimits,
    LaunchKind,
    LaunchParameters,
    Role,
)
from flightsim.foundation.conversion import Conversion, NotMade, Refused
from flightsim.foundation.documents import excerpt, read_toml
from flightsim.foundation.file_content import FileError
from flightsim.jsbsim_package import jsbsim
from flightsim.toml_tables import listed, names_of, number, only, table_of, text

_MODELS_DIR: Final = Path(__file__).parent / "models"
_DESCRIPTION: Final = "vehicle.toml"

# What makes an aircraft ready to fly: engines running on a rich mixture, gear down.
_READY: Final = (
    ("gear/gear-cmd-norm", 1.0),
    ("gear/gear-pos-norm", 1.0),
    *((f"fcs/mixture-cmd-norm[{i}]", 1.0) for i in range(8)),
    *((f"fcs/advance-cmd-norm[{i}]", 1.0) for i in range(8)),
    ("propulsion/magneto_cmd", 3.0),
    ("propulsion/set-running", -1.0),
)
# An aircraft with a generator: what its autopilot's power module sees.
_GENERATOR: Final = (
    (t.BATTERY_VOLTAGE_V, 14.0),
    (t.BATTERY_CURRENT_A, 0.0),
    (t.BATTERY_USED_AH, 0.0),
    (t.BATTERY_CAPACITY_AH, 30.0),
)
_VEHICLE_KEYS: Final = ("name", "kind", "jsbsim", "cg_height_at_rest_m")
_TABLES: Final = ("vehicle", "actuators", "start", "truth", "limits", "launch")
_HOW_TO: Final = (
    'a description is a few lines of TOML: [vehicle] with name, kind = "fixed_wing" and jsbsim = the name '
    "of an aircraft of the jsbsim package or of an .xml file beside it; see docs/vehicles.md"
)


def known_models() -> tuple[str, ...]:
    """Names of the models that come with the package."""
    return tuple(sorted(path.parent.name for path in _MODELS_DIR.glob(f"*/{_DESCRIPTION}")))


def package_aircraft() -> tuple[str, ...]:
    """Names of the aircraft of the `jsbsim` package."""
    folders = (_package_root() / "aircraft").iterdir()
    return tuple(sorted(path.name for path in folders if (path / f"{path.name}.xml").is_file()))


def load_airframe(model: str | Path) -> Airframe:
    """Read the description of a vehicle.

    Args:
        model: name of a model that comes with the package; path of a folder with a `vehicle.toml`, of such a
            file by any name, or of a JSBSim aircraft (`.xml`, or its folder `NAME` with `NAME.xml`); or name
            of an aircraft of the `jsbsim` package. The last two need no description: the standard pilot's
            commands are taken, and the limits are worked out.

    Raises:
        AirframeError: unknown model, or a description that cannot be used.
    """
    if isinstance(model, str):
        if model in known_models():
            return _read(_MODELS_DIR / model / _DESCRIPTION)
        if model in package_aircraft() and not Path(model).is_dir():
            return _bare(_package_root() / "aircraft" / model / f"{model}.xml")
    path = Path(model)
    if path.is_dir():
        description, xml = path / _DESCRIPTION, path / f"{path.resolve().name}.xml"
        path = description if description.is_file() or not xml.is_file() else xml
    if not path.is_file():
        raise AirframeError(
            f"vehicle model '{model}' is unknown; accepted are {listed(known_models())}, the path of a "
            f"folder with a {_DESCRIPTION}, of a description (.toml) or of a JSBSim aircraft (.xml), and "
            f"aircraft of the jsbsim package ({listed(package_aircraft())}); {_HOW_TO}"
        )
    return _bare(path) if path.suffix == ".xml" else _read(path)


def _package_root() -> Path:
    return Path(jsbsim.get_default_root_dir())


def _bare(xml: Path) -> Airframe:
    """A JSBSim aircraft without a description: the standard commands, limits worked out."""
    return Airframe(
        name=xml.stem,
        kind=AirframeKind.FIXED_WING,
        folder=xml.parent.resolve(),
        jsbsim=xml.stem,
        cg_height_at_rest_m=None,
        channels=tuple(standard_channel(role) for role in Role),
        constants=_GENERATOR,
        start=_READY,
        start_optional=True,
    )


def _read(path: Path) -> Airframe:
    try:
        data = read_toml(path)
    except FileError as error:
        raise AirframeError(f"the vehicle description {error}") from None
    if unknown := [name for name in data if name not in _TABLES]:
        accepted = ", ".join(f"[{name}]" for name in _TABLES)
        raise AirframeError(f"{path}: '{unknown[0]}' is unknown; tables are {accepted}")
    vehicle = table_of(data, "vehicle", path)
    only(vehicle, _VEHICLE_KEYS, "keys of [vehicle]", path)
    kind_name = text(vehicle, "kind", path)
    try:
        kind = AirframeKind(kind_name)
    except ValueError:
        accepted = ", ".join(member.value for member in AirframeKind)
        raise AirframeError(f"{path}: kind '{kind_name}' is unknown; accepted are {accepted}") from None
    try:
        return _described(data, vehicle, kind, path)
    except AirframeError as error:
        if str(path) in str(error):
            raise
        raise AirframeError(f"{path}: {error}") from None


def _described(data: dict[str, Any], vehicle: dict[str, Any], kind: AirframeKind, path: Path) -> Airframe:
    fixed_wing = kind is AirframeKind.FIXED_WING
    xml = _jsbsim_file(text(vehicle, "jsbsim", path), path)
    height_m = None
    if not fixed_wing or "cg_height_at_rest_m" in vehicle:
        height_m = number(vehicle, "cg_height_at_rest_m", path)
    truth, scale, constants = _truth(
        data.get("truth", {}) if fixed_wing else table_of(data, "truth", path), path
    )
    common: dict[str, Any] = {
        "name": text(vehicle, "name", path),
        "kind": kind,
        "folder": xml.parent.resolve(),
        "jsbsim": xml.stem,
        "cg_height_at_rest_m": height_m,
        "truth": truth,
        "truth_scale": scale,
    }
    if not fixed_wing:
        actuators = table_of(data, "actuators", path)
        return Airframe(
            **common,
            actuators=names_of(actuators, "properties", path),
            effectiveness=names_of(actuators, "effectiveness", path) if "effectiveness" in actuators else (),
            constants=constants,
        )
    known = {index for index, _ in (*truth, *constants)}
    kind_of_launch, launches = _launch(data.get("launch", {}), path)
    own_start = table_of(data, "start", path) if "start" in data else None
    return Airframe(
        **common,
        channels=read_channels(data.get("actuators", {}), path),
        constants=(*constants, *(item for item in _GENERATOR if item[0] not in known)),
        start=_READY if own_start is None else _start(own_start, path),
        start_optional=own_start is None,
        limits=_limits(data.get("limits", {}), path),
        launch_kind=kind_of_launch,
        launches=launches,
    )


def _jsbsim_file(name: str, path: Path) -> Path:
    try:
        beside = (path.parent / name).with_suffix(".xml")
        if beside.is_file():
            return beside
        packaged = _package_root() / "aircraft" / name / f"{name}.xml"
        if packaged.is_file():
            return packaged
    except (OSError, ValueError) as error:  # a name that no file can have
        raise AirframeError(
            f"{path} names the JSBSim model {excerpt(name)}: {getattr(error, 'strerror', None) or error}"
        ) from None
    raise AirframeError(
        f"{path} names the JSBSim model {beside}, which does not exist; nor has the jsbsim package an "
        f"aircraft '{name}' (it has {', '.join(package_aircraft())})"
    )


def _start(table: dict[str, Any], path: Path) -> tuple[tuple[str, float], ...]:
    return tuple((name, number(table, name, path)) for name in table)


def _limits(table: Any, path: Path) -> FlightLimits:
    return FlightLimits(**_converted(table, "limits", FlightLimits, path))


def _launch(table: Any, path: Path) -> tuple[LaunchKind, tuple[LaunchParameters, ...]]:
    """The usual kind, and how catapult and hand do it: [launch] kind, [launch.catapult], [launch.hand]."""
    if not isinstance(table, dict):
        raise AirframeError(f"{path}: [launch] is {table!r}; expected is a table")
    only(table, ("kind", *(launch.kind for launch in DEFAULT_LAUNCHES)), "keys of [launch]", path)
    kind = text(table, "kind", path) if "kind" in table else LaunchKind.RUNWAY.value
    if kind not in tuple(LaunchKind):
        raise AirframeError(f"{path}: launch kind '{kind}' is unknown; accepted are {listed(LaunchKind)}")
    launches = tuple(
        replace(
            launch,
            **_converted(table.get(launch.kind, {}), f"launch.{launch.kind}", LaunchParameters, path, "kind"),
        )
        for launch in DEFAULT_LAUNCHES
    )
    return LaunchKind(kind), launches


def _converted(table: Any, name: str, target: Any, path: Path, *left_out: str) -> dict[str, Any]:
    """Fields of a dataclass from a TOML table; degrees become radians."""
    try:
        return Conversion().arguments(target, table, without=left_out)
    except NotMade as error:
        raise AirframeError(f"{path}: [{name}] {error.where}{error}") from None
    except Refused as error:
        where = error.where or f"[{name}]"
        raise AirframeError(f"{path}: {where} is {error.value!r}; expected is {error.accepted}") from None


def _truth(
    table: Any, path: Path
) -> tuple[tuple[tuple[int, str], ...], tuple[float, ...], tuple[tuple[int, float], ...]]:
    """Properties, their factors, and constants of the truth vector."""
    if not isinstance(table, dict):
        raise AirframeError(f"{path}: [truth] is {table!r}; expected is a table")
    found: list[tuple[int, str]] = []
    scales: list[float] = []
    constants: list[tuple[int, float]] = []
    for key, value in table.items():
        place = getattr(t, key, None) if key.isupper() else None
        if key == "TRUTH_SIZE" or not isinstance(place, int | slice):
            raise AirframeError(f"{path}: [truth] names {key}, which flightsim/truth.py does not have")
        entries = value if isinstance(value, list) else [value]
        first, room = (place.start, place.stop - place.start) if isinstance(place, slice) else (place, 1)
        if len(entries) > room or isinstance(value, list) != isinstance(place, slice):
            raise AirframeError(
                f"{path}: {key} is {value!r}; "
                + (f"a list of at most {room} properties fits" if room > 1 else "one property fits")
            )
        for index, entry in enumerate(entries, start=first):
            if isinstance(entry, int | float) and not isinstance(entry, bool):
                constants.append((index, float(entry)))
                continue
            scale = 1.0
            if isinstance(entry, dict):
                only(entry, ("property", "scale"), f"keys of {key}", path)
                scale = number(entry, "scale", path, 1.0)
                entry = entry.get("property")
            if not isinstance(entry, str):
                raise AirframeError(
                    f"{path}: {key} is {value!r}; expected is a JSBSim property name, {{property, scale}} or "
                    "a number"
                )
            found.append((index, entry))
            scales.append(scale)
    return tuple(found), tuple(scales), tuple(constants)
