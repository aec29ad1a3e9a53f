"""References for estimates: the autopilot's own estimate and, if the log contains it, a simulator's truth.

Estimates and references are matched by the names of their columns: `roll_rad`, `north_m`. Estimators do not
use this module; they never receive the truth.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.wire_units import degrees, home, m_s, place_columns
from estimators.received import received_positions
from estimators.tracking.metrics import mean_square
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.vectors import euler_from_quaternions, wrap_pi

if TYPE_CHECKING:
    from estimators.logs import Log, Table

Column = NDArray[np.float64]

AUTOPILOT: Final = "autopilot"
TRUTH: Final = "truth"

MAX_AWAY_US: Final = 100_000
"""An estimate that is farther from every sample of the reference has no reference value, microseconds."""
MAX_BRIDGED_US: Final = 1_000_000
"""Longest gap of the reference that is interpolated, microseconds."""
_LEAST_SPEED_M_S: Final = 1.0
"""Below this speed the direction of travel is not meaningful."""
TARGET_SYSTEM: Final = 251
"""MAVLink system id of the simulated targets' truth; the first target is component 1."""
_SIMULATORS: Final = (25, 1)
"""Components that send the truth, the preferred one first: our SITL's, PX4's own."""


@dataclass(frozen=True, slots=True)
class Series:
    """A quantity over time.

    Attributes:
        source: name of the message it is taken from.
        time_us: (n,) vehicle time, ascending.
        values: (n,) finite values.
        angle: whether it wraps around at a full turn.
    """

    source: str
    time_us: NDArray[np.int64]
    values: Column
    angle: bool

    def at(self, time_us: NDArray[np.int64]) -> Column:
        """Values at the given times, linear between samples (angles the short way round); NaN when no sample
        is within 0.1 s, and in gaps longer than a second.
        """
        times = self.time_us
        if not len(times):
            return np.full(len(time_us), np.nan)
        values = np.unwrap(self.values) if self.angle else self.values
        found = np.interp(time_us.astype(np.float64), times.astype(np.float64), values)
        after = np.clip(np.searchsorted(times, time_us), 1, max(1, len(times) - 1))
        left, right = times[after - 1], times[np.minimum(after, len(times) - 1)]
        away = np.minimum(np.abs(time_us - left), np.abs(time_us - right))
        inside = (time_us >= left) & (time_us <= right)
        bridged = ~inside | (right - left <= MAX_BRIDGED_US) | (away == 0)
        return np.where((away <= MAX_AWAY_US) & bridged, found, np.nan)


@dataclass(frozen=True, slots=True)
class Reference:
    """A source that estimates of a vehicle are compared with.

    Attributes:
        name: "autopilot" or "truth".
        columns: quantities by the column names of the estimates.
    """

    name: str
    columns: Mapping[str, Series]

    @property
    def sources(self) -> list[str]:
        """Names of the messages it is taken from."""
        return list(dict.fromkeys(series.source for series in self.columns.values()))


def references(
    log: "Log", system_id: int, *, origin: GeodeticPosition | None = None, boot: int | None = None
) -> dict[str, Reference]:
    """The references of a vehicle in a log, by name; empty references are left out.

    Args:
        log: an open log.
        system_id: system id of the vehicle.
        origin: origin of `north_m` and `east_m`; None: the vehicle's home.
        boot: number of a boot of the log; None: the whole log.
    """
    place = home_of(log, system_id, boot) if origin is None else origin
    frame = None if place is None else LocalFrame(place)
    truth = _truth(log, system_id, boot, frame)
    if truth and boot is None:  # boots of different systems have no common time
        truth |= _offsets(log, truth)
    found = {AUTOPILOT: _autopilot(log, system_id, boot, frame), TRUTH: truth}
    return {name: Reference(name, columns) for name, columns in found.items() if columns}


def lacking_references(log: "Log", system_id: int, columns: Sequence[str]) -> list[str]:
    """Messages that would be the references of columns, and that a vehicle's autopilot has not sent."""
    angles = ("roll_rad", "pitch_rad", "yaw_rad")
    needed = ["ATTITUDE"] if any(column in angles for column in columns) else []
    if any(column not in angles for column in columns):
        needed.append("GLOBAL_POSITION_INT")
    if any(column in ("north_m", "east_m") for column in columns):
        needed.append("HOME_POSITION")
    return [name for name in needed if _table(log, name, system_id, None) is None]


def target_reference(
    log: "Log", number: int, *, origin: GeodeticPosition | None, boot: int | None = None
) -> Reference | None:
    """The true position of a ground target of our SITL.

    Args:
        number: number of its tag; when only one target is known, it is used regardless of its number.
        origin: origin of `north_m` and `east_m`; None: they are not compared.
    """
    name = "HIL_STATE_QUATERNION"
    known = sorted(
        {key.component_id for key in log.keys if key.name == name and key.system_id == TARGET_SYSTEM}
    )
    if not known:
        return None
    component = number + 1 if number + 1 in known else known[0]
    if component != number + 1 and len(known) > 1:
        return None
    table = log.table(name, system_id=TARGET_SYSTEM, component_id=component, boot=boot)
    frame = None if origin is None else LocalFrame(origin)
    return Reference(TRUTH, _from_hil_state(table, frame))


def targets_reference(
    log: "Log", time_us: NDArray[np.int64], *, origin: GeodeticPosition | None
) -> NDArray[np.float64]:
    """True places of all ground targets of our SITL, (n, targets, 2) north and east at n times; NaN: not
    known.
    """
    name = "HIL_STATE_QUATERNION"
    known = sorted(
        {key.component_id for key in log.keys if key.name == name and key.system_id == TARGET_SYSTEM}
    )
    places = np.full((len(time_us), len(known), 2), np.nan)
    for k, component in enumerate(known):
        found = target_reference(log, component - 1, origin=origin)
        if found is not None and "north_m" in found.columns:
            places[:, k, 0] = found.columns["north_m"].at(time_us)
            places[:, k, 1] = found.columns["east_m"].at(time_us)
    return places


def _offsets(log: "Log", own: Mapping[str, Series]) -> dict[str, Series]:
    """From a vehicle to the first ground target of our SITL, at the times of the vehicle's truth."""
    lat, lon = own["lat_deg"], own["lon_deg"]
    if not len(lat.time_us):
        return {}
    first = GeodeticPosition(lat_deg=float(lat.values[0]), lon_deg=float(lon.values[0]), alt_m=0.0)
    target = target_reference(log, 0, origin=first)
    if target is None:
        return {}
    north_m, east_m, _ = LocalFrame(first).ned_from_geodetic(
        lat.values, lon.values, np.zeros_like(lat.values)
    )
    return {
        f"offset_{name}": Series(
            lat.source, lat.time_us, target.columns[name].at(lat.time_us) - values, angle=False
        )
        for name, values in (("north_m", north_m), ("east_m", east_m))
    }


def home_of(log: "Log", system_id: int, boot: int | None = None) -> GeodeticPosition | None:
    """A vehicle's home: the newest valid HOME_POSITION; None when it has sent none."""
    table = _table(log, "HOME_POSITION", system_id, boot)
    if table is None:
        return None
    for k in range(len(table) - 1, -1, -1):
        lat_e7, lon_e7, alt_mm = (int(table[name][k]) for name in ("latitude", "longitude", "altitude"))
        place = home(lat_e7, lon_e7, alt_mm)
        if place is not None:
            return place
    return None


def _table(log: "Log", name: str, system_id: int, boot: int | None) -> "Table | None":
    """A message of the autopilot as a table, or None."""
    tables = _tables(log, name, system_id, boot, (1,))
    return tables[0] if tables else None


def _tables(
    log: "Log", name: str, system_id: int, boot: int | None, preferred: Sequence[int]
) -> "list[Table]":
    """A message of one system, from the preferred components first. It is looked up only if the log contains
    it, because the log's dialect may not define it.
    """
    if not any(key.name == name and key.system_id == system_id for key in log.keys):
        return []
    found = {table.component_id: table for table in log.tables(name, system_id=system_id, boot=boot)}
    return [found[component] for component in preferred if component in found]


def _autopilot(log: "Log", system_id: int, boot: int | None, frame: LocalFrame | None) -> dict[str, Series]:
    columns: dict[str, Series] = {}
    attitude = _table(log, "ATTITUDE", system_id, boot)
    if attitude is not None:
        columns |= _series(
            attitude, {f"{axis}_rad": _floats(attitude[axis]) for axis in ("roll", "pitch", "yaw")}
        )
    position = _table(log, "GLOBAL_POSITION_INT", system_id, boot)
    if position is not None:
        columns |= _series(position, _places(position, frame))
    return columns


def _truth(log: "Log", system_id: int, boot: int | None, frame: LocalFrame | None) -> dict[str, Series]:
    for name, read in _TRUTHS.items():
        tables = _tables(log, name, system_id, boot, (*_SIMULATORS, *range(256)))
        if tables:
            return read(tables[0], frame)
    return {}


def _from_hil_state(table: "Table", frame: LocalFrame | None) -> dict[str, Series]:
    names = ("roll_rad", "pitch_rad", "yaw_rad")
    angles = dict(zip(names, euler_from_quaternions(table["attitude_quaternion"]), strict=True))
    return _series(table, angles | _places(table, frame))


def _from_simstate(table: "Table", frame: LocalFrame | None) -> dict[str, Series]:
    angles = {f"{axis}_rad": _floats(table[axis]) for axis in ("roll", "pitch", "yaw")}
    lat, lon = degrees(_floats(table["lat"])), degrees(_floats(table["lng"]))
    return _series(table, angles | _placed(table.time_us, lat, lon, frame))


def _from_sim_state(table: "Table", frame: LocalFrame | None) -> dict[str, Series]:
    angles = {f"{axis}_rad": _floats(table[axis]) for axis in ("roll", "pitch", "yaw")}
    # `lat` and `lon` are floats, accurate to some metres; the integers came later and may be 0.
    whole = np.any(table["lat_int"]) or np.any(table["lon_int"])
    lat = degrees(_floats(table["lat_int"])) if whole else _floats(table["lat"])
    lon = degrees(_floats(table["lon_int"])) if whole else _floats(table["lon"])
    moving = _moving(_floats(table["vn"]), _floats(table["ve"]))
    return _series(table, angles | _placed(table.time_us, lat, lon, frame) | moving)


_TRUTHS: Final[Mapping[str, Callable[["Table", LocalFrame | None], dict[str, Series]]]] = {
    "HIL_STATE_QUATERNION": _from_hil_state,
    "SIM_STATE": _from_sim_state,
    "SIMSTATE": _from_simstate,
}
"""Best first. SIMSTATE has no time of its own."""


def _places(table: "Table", frame: LocalFrame | None) -> dict[str, Column]:
    """Position and velocity from GLOBAL_POSITION_INT and HIL_STATE_QUATERNION."""
    lat_deg, lon_deg, alt_m = place_columns(table)
    north, east, down = (m_s(_floats(table[name])) for name in ("vx", "vy", "vz"))
    places = _placed(table.time_us, lat_deg, lon_deg, frame, alt_m)
    return places | _moving(north, east) | {"down_m_s": down}


def _placed(
    time_us: NDArray[np.int64],
    lat_deg: Column,
    lon_deg: Column,
    frame: LocalFrame | None,
    alt_m: Column | None = None,
) -> dict[str, Column]:
    """Places; NaN where no vehicle can have been (`estimators.received`)."""
    height_m = np.zeros_like(lat_deg) if alt_m is None else alt_m
    known = np.zeros(len(lat_deg), dtype=np.bool_)
    known[received_positions(time_us, lat_deg, lon_deg, height_m).rows] = True
    lat_deg, lon_deg = np.where(known, lat_deg, np.nan), np.where(known, lon_deg, np.nan)
    places = {"lat_deg": lat_deg, "lon_deg": lon_deg}
    if alt_m is not None:
        places["alt_m"] = np.where(known, alt_m, np.nan)
    if frame is None:
        return places
    north_m, east_m, _ = frame.ned_from_geodetic(lat_deg, lon_deg, np.zeros_like(lat_deg))
    return places | {"north_m": north_m, "east_m": east_m}


def _moving(north_m_s: Column, east_m_s: Column) -> dict[str, Column]:
    course = np.arctan2(east_m_s, north_m_s)
    moving = np.hypot(north_m_s, east_m_s) > _LEAST_SPEED_M_S
    return {"north_m_s": north_m_s, "east_m_s": east_m_s, "course_rad": np.where(moving, course, np.nan)}


def _series(table: "Table", columns: Mapping[str, Column]) -> dict[str, Series]:
    """Series over the table's time: sorted, finite, and with each time once."""
    time_us, first = np.unique(table.time_us, return_index=True)
    made = {}
    for name, values in columns.items():
        chosen = values[first]
        good = np.isfinite(chosen)
        made[name] = Series(table.name, time_us[good], chosen[good], name.endswith("_rad"))
    return made


def _floats(values: NDArray[Any]) -> Column:
    return np.asarray(values, dtype=np.float64)


def errors(name: str, estimate: Column, reference: Column) -> Column:
    """Estimate minus reference; angles are wrapped to half a turn, but not latitude and longitude."""
    difference = estimate - reference
    if name.endswith("_rad"):
        return wrap_pi(difference)
    return difference


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorFigures:
    """Errors of one quantity, in `unit`.

    Attributes:
        quantity: "roll", "north".
        unit: "deg", "m", "m_s".
        samples: number of compared estimates.
        mean, rms, mse, max: mean, root of the mean square, mean square, largest magnitude.
    """

    quantity: str
    unit: str
    samples: int
    mean: float
    rms: float
    mse: float
    max: float

    def as_summary(self) -> dict[str, float]:
        """`roll_mean_deg`, `roll_rms_deg`, `roll_mse_deg2`, `roll_max_deg`."""
        q, u = self.quantity, self.unit
        if not u:
            return {f"{q}_mean": self.mean, f"{q}_rms": self.rms, f"{q}_mse": self.mse, f"{q}_max": self.max}
        square = {"m_s": "m2_s2"}.get(u, f"{u}2")
        return {
            f"{q}_mean_{u}": self.mean,
            f"{q}_rms_{u}": self.rms,
            f"{q}_mse_{square}": self.mse,
            f"{q}_max_{u}": self.max,
        }


_QUANTITIES: Final = (
    ("_rad", "deg", 180.0 / math.pi),
    ("_m_s", "m_s", 1.0),
    ("_m", "m", 1.0),
    ("_nt", "nT", 1.0),
)
"""Suffixes of columns, the unit that users see, and the factor to it."""


def quantity_of(column: str) -> tuple[str, str, float]:
    """Name of a column's quantity, its unit for users, and the factor to that unit: `roll_rad` in degrees."""
    for suffix, unit, factor in _QUANTITIES:
        if column.endswith(suffix):
            return column.removesuffix(suffix), unit, factor
    return column, "", 1.0


def error_figures(column: str, error: Column, counted: NDArray[np.bool_]) -> ErrorFigures | None:
    """Statistics of the errors that are counted and finite; None when there are none."""
    name, unit, factor = quantity_of(column)
    chosen = factor * error[counted & np.isfinite(error)]
    if not len(chosen):
        return None
    mse = mean_square(chosen)
    return ErrorFigures(
        quantity=name,
        unit=unit,
        samples=len(chosen),
        mean=float(np.mean(chosen)),
        rms=math.sqrt(mse),
        mse=mse,
        max=float(np.max(np.abs(chosen))),
    )


COMPARED: Final[Sequence[str]] = (
    "roll_rad", "pitch_rad", "yaw_rad", "north_m", "east_m", "down_m", "alt_m",
    "north_m_s", "east_m_s", "down_m_s", "course_rad", "offset_north_m", "offset_east_m",
)  # fmt: skip
"""Columns that have references, in the order of tables and pictures."""
