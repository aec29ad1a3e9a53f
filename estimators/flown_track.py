"""The tracks of the vehicles in a log: places, attitudes and times, by the autopilot or by the truth."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators.errors import NothingThere
from estimators.received import GAP_US, interpolated
from estimators.references import AUTOPILOT, TRUTH, home_of, references
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.vectors import wrap_pi

if TYPE_CHECKING:
    from estimators.logs.log import Log

__all__ = ["FlownTrack", "flown_tracks"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class FlownTrack:
    """Where a vehicle was during one of its boots.

    Attributes:
        system_id: the vehicle.
        boot: number of its boot in the log.
        source: "autopilot" (what the vehicle reported) or "truth" (what a simulator logged).
        home: its home; its first place, if it reported none.
        time_us: (n,) vehicle time, strictly increasing.
        unix_us: (n,) Unix time; 0: not in the log.
        lat_deg, lon_deg: (n,) geodetic position.
        alt_m: (n,) height above mean sea level; NaN: not known.
        roll_rad, pitch_rad, yaw_rad: (n,) attitude, NED from FRD; NaN: not known.
    """

    system_id: int
    boot: int
    source: str
    home: GeodeticPosition
    time_us: NDArray[np.int64]
    unix_us: NDArray[np.int64]
    lat_deg: Array
    lon_deg: Array
    alt_m: Array
    roll_rad: Array
    pitch_rad: Array
    yaw_rad: Array

    @property
    def height_m(self) -> Array:
        """(n,) height above home."""
        return self.alt_m - self.home.alt_m

    def pos_ned_m(self, origin: GeodeticPosition | None = None) -> Array:
        """(n, 3) north, east and down of an origin; None: of home."""
        frame = LocalFrame(self.home if origin is None else origin)
        return np.column_stack(frame.ned_from_geodetic(self.lat_deg, self.lon_deg, self.alt_m))

    @property
    def parts(self) -> list[NDArray[np.int64]]:
        """Rows of each part between two gaps, in which nothing was received."""
        return np.split(np.arange(len(self.time_us)), np.flatnonzero(np.diff(self.time_us) > GAP_US) + 1)


def flown_tracks(log: "Log", system_id: int | None = None, *, source: str = AUTOPILOT) -> list[FlownTrack]:
    """The tracks in a log, one for each vehicle and boot with a position, ordered by them.

    Args:
        log: an open log.
        system_id: the only vehicle; None: all.
        source: "autopilot" or "truth".

    Raises:
        NothingThere: there is no such position in it.
    """
    boots = [
        boot
        for boot in log.boots
        if system_id in (None, boot.system_id)
        and log.has("HEARTBEAT", system_id=boot.system_id, component_id=AUTOPILOT_COMPONENT)
    ]
    found = [_track(log, boot.system_id, boot.number, source) for boot in boots]
    tracks = [track for track in found if track is not None]
    if not tracks:
        of = "a vehicle" if system_id is None else f"vehicle {system_id}"
        raise NothingThere(f"{log.path} has no positions of {of} by the {source}")
    return tracks


def has_truth(log: "Log") -> bool:
    """Whether a log has true places of a vehicle."""
    try:
        return bool(flown_tracks(log, source=TRUTH))
    except NothingThere:
        return False


def _track(log: "Log", system_id: int, boot: int, source: str) -> FlownTrack | None:
    """The track of one boot; None: there are no positions of that source."""
    reference = references(log, system_id, boot=boot).get(source)
    if reference is None or not {"lat_deg", "lon_deg"} <= reference.columns.keys():
        return None
    lat, lon = reference.columns["lat_deg"], reference.columns["lon_deg"]
    placed = (lat.values != 0.0) | (lon.values != 0.0)  # ArduPilot sends 0, 0 until it has a position
    time_us, lat_deg, lon_deg = lat.time_us[placed], lat.values[placed], lon.values[placed]
    if not len(time_us):
        return None

    def column(name: str) -> Array:
        series = reference.columns.get(name)
        if series is None or not len(series.time_us):
            return np.full(len(time_us), np.nan)
        values = np.unwrap(series.values) if series.angle else series.values
        found = interpolated(time_us, series.time_us.astype(np.float64), values, gap=GAP_US)
        return wrap_pi(found) if series.angle else found

    alt_m = column("alt_m")
    first_m = float(alt_m[0]) if np.isfinite(alt_m[0]) else 0.0
    first = GeodeticPosition(lat_deg=float(lat_deg[0]), lon_deg=float(lon_deg[0]), alt_m=first_m)
    return FlownTrack(
        system_id=system_id,
        boot=boot,
        source=source,
        home=home_of(log, system_id, boot) or first,
        time_us=time_us,
        unix_us=_unix_us(log, system_id, boot, lat.source, time_us),
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        alt_m=alt_m,
        **{f"{axis}_rad": column(f"{axis}_rad") for axis in ("roll", "pitch", "yaw")},
    )


def _unix_us(
    log: "Log", system_id: int, boot: int, name: str, time_us: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Unix times of vehicle times: those of the records of the message that has them."""
    table = log.tables(name, system_id=system_id, boot=boot)[0]
    found, first = np.unique(table.time_us, return_index=True)
    return table.log_time_us[first][np.searchsorted(found, time_us)]
