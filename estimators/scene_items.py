"""The items of a scene: typed, frozen, and without any viewer.

Positions are metres, north east down of the scene's origin, unless an item is `Relative`. Each item has a
role, from which a viewer takes its colour.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Final, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.vectors import Quaternion, Vector

__all__ = [
    "Camera",
    "Cleared",
    "Entry",
    "Field",
    "Gaussian",
    "Item",
    "Line",
    "Origin",
    "Picture",
    "PointSet",
    "Pose",
    "Relative",
    "Role",
    "Text",
    "Value",
]

Array = NDArray[np.float64]

_ON_CIRCLE: Final = 72


class Layout(Protocol):
    """Square cells over a rectangle: its south-western corner and the side of a cell."""

    @property
    def south_m(self) -> float: ...

    @property
    def west_m(self) -> float: ...

    @property
    def cell_m(self) -> float: ...


class Role(StrEnum):
    """What an item is to the reader; viewers colour by it."""

    TRUTH = "truth"
    """The true state, from the log only."""
    ESTIMATE = "estimate"
    """What a vehicle or an estimator reports."""
    COMMANDED = "commanded"
    """What a vehicle was commanded: paths, waypoints, setpoints."""
    BELIEF = "belief"
    """Where something may be: particles, grids, Gaussians."""
    FOUND = "found"
    """What was decided to be there."""
    MEASURED = "measured"
    """What a sensor measured: detections, lines of sight, footprints, readings."""
    AREA = "area"
    """Where the mission looks."""
    FENCE = "fence"
    """Where a vehicle must stay in, or out of."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Origin:
    """The origin of the scene's positions: home of the first vehicle."""

    lat_deg: float
    lon_deg: float
    alt_m: float

    @property
    def place(self) -> GeodeticPosition:
        """The place on the Earth."""
        return GeodeticPosition(lat_deg=self.lat_deg, lon_deg=self.lon_deg, alt_m=self.alt_m)

    def moved(self, by_ned_m: Vector) -> Self:
        """The same: an origin is on the Earth."""
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """A place, with an attitude where it is known.

    Attributes:
        pos_ned_m: the place.
        q_ned_from_frd: Hamilton quaternion, w x y z; None: not known.
        label: short text beside it; "": none.
    """

    pos_ned_m: Vector
    q_ned_from_frd: Quaternion | None = None
    role: Role = Role.ESTIMATE
    label: str = ""

    def moved(self, by_ned_m: Vector) -> Self:
        """The item at another place."""
        return replace(self, pos_ned_m=_sum(self.pos_ned_m, by_ned_m))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Line:
    """Straight legs between points.

    Attributes:
        points_ned_m: (n, 3).
        closed: the last point is joined to the first: an area, a fence.
        label: short text beside it; "": none.
    """

    points_ned_m: Array
    closed: bool = False
    role: Role = Role.COMMANDED
    label: str = ""

    @classmethod
    def rectangle(
        cls,
        *,
        south_m: float,
        west_m: float,
        north_m: float,
        east_m: float,
        label: str = "",
        role: Role = Role.AREA,
    ) -> Self:
        """A closed rectangle on the ground."""
        corners = ((south_m, west_m), (north_m, west_m), (north_m, east_m), (south_m, east_m))
        points = np.array([(*corner, 0.0) for corner in corners])
        return cls(points_ned_m=points, closed=True, role=role, label=label)

    @classmethod
    def circle(
        cls, middle_ned_m: Vector, radius_m: float, *, label: str = "", role: Role = Role.COMMANDED
    ) -> Self:
        """A level circle."""
        angle = np.linspace(0.0, 2.0 * np.pi, _ON_CIRCLE, endpoint=False)
        points = np.column_stack([radius_m * np.cos(angle), radius_m * np.sin(angle), np.zeros(_ON_CIRCLE)])
        return cls(points_ned_m=points + np.asarray(middle_ned_m), closed=True, role=role, label=label)

    def moved(self, by_ned_m: Vector) -> Self:
        """The item at another place."""
        return replace(self, points_ned_m=self.points_ned_m + np.asarray(by_ned_m))

    @property
    def drawn_ned_m(self) -> Array:
        """(n, 3) or, where it is closed, (n + 1, 3): the points of an open line."""
        if not self.closed or len(self.points_ned_m) < 2:
            return self.points_ned_m
        return np.concatenate([self.points_ned_m, self.points_ned_m[:1]])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PointSet:
    """Points: particles, waypoints, targets, readings.

    Attributes:
        points_ned_m: (n, 3); n is 0 where nothing is there (any more).
        weights: (n,) probability, mass or value of each; empty: all are alike.
        unit: of the weights; "": a probability or a number.
        labels: of each point; empty: none.
    """

    points_ned_m: Array
    weights: Array = field(default_factory=lambda: np.zeros(0))
    unit: str = ""
    labels: tuple[str, ...] = ()
    role: Role = Role.BELIEF

    @classmethod
    def on_ground(
        cls,
        places_ne_m: Sequence[tuple[float, float]],
        *,
        labels: Sequence[str] = (),
        role: Role = Role.FOUND,
    ) -> Self:
        """Places, north and east, at the height of the origin."""
        points = np.array([(north_m, east_m, 0.0) for north_m, east_m in places_ne_m]).reshape(-1, 3)
        return cls(points_ned_m=points, labels=tuple(labels), role=role)

    def moved(self, by_ned_m: Vector) -> Self:
        """The item at another place."""
        return replace(self, points_ned_m=self.points_ned_m + np.asarray(by_ned_m))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gaussian:
    """A normal distribution of a place; viewers draw its ellipse of three standard deviations.

    Attributes:
        mean_ned_m: the mean.
        covariance_m2: (2, 2) north and east, or (3, 3).
        label: short text beside it; "": none.
    """

    mean_ned_m: Vector
    covariance_m2: Array
    role: Role = Role.BELIEF
    label: str = ""

    def moved(self, by_ned_m: Vector) -> Self:
        """The item at another place."""
        return replace(self, mean_ned_m=_sum(self.mean_ned_m, by_ned_m))

    @property
    def half_axes_m(self) -> tuple[float, float]:
        """Half axes of the horizontal ellipse of three standard deviations, the longer first."""
        values = np.linalg.eigvalsh(self.covariance_m2[:2, :2])
        longer, shorter = (3.0 * float(np.sqrt(max(0.0, value))) for value in (values[1], values[0]))
        return longer, shorter

    def outline_ned_m(self, points: int = 48) -> Array:
        """The horizontal ellipse of three standard deviations, (points, 3)."""
        values, axes = np.linalg.eigh(self.covariance_m2[:2, :2])
        angle = np.linspace(0.0, 2.0 * np.pi, points, endpoint=False)
        circle = 3.0 * np.sqrt(np.maximum(values, 0.0))[:, None] * np.stack([np.cos(angle), np.sin(angle)])
        outline = np.zeros((points, 3))
        outline[:, :2] = (axes @ circle).T
        return outline + np.asarray(self.mean_ned_m)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Field:
    """A quantity in square cells over the ground: a grid belief, an intensity, a map.

    Attributes:
        values: (rows, columns), rows to the north, columns to the east; NaN: not known.
        south_m, west_m: corner of the grid.
        down_m: height of the grid below the origin.
        cell_m: side of a cell.
        unit: of the values: "probability", "nT".
        low, high: values at the ends of the colour scale; None: the least and the largest of each time.
    """

    values: NDArray[np.floating]
    south_m: float
    west_m: float
    cell_m: float
    unit: str
    down_m: float = 0.0
    low: float | None = None
    high: float | None = None
    role: Role = Role.BELIEF

    @classmethod
    def on(
        cls,
        layout: Layout,
        values: NDArray[np.floating],
        *,
        unit: str,
        low: float | None = None,
        high: float | None = None,
    ) -> Self:
        """Values, as they are now, in the cells of a grid (`estimators.tracking.grid.GridLayout`)."""
        return cls(
            values=values.astype(np.float32),
            south_m=layout.south_m,
            west_m=layout.west_m,
            cell_m=layout.cell_m,
            unit=unit,
            low=low,
            high=high,
        )

    def moved(self, by_ned_m: Vector) -> Self:
        """The item at another place."""
        north_m, east_m, down_m = by_ned_m
        return replace(
            self, south_m=self.south_m + north_m, west_m=self.west_m + east_m, down_m=self.down_m + down_m
        )

    @property
    def scale(self) -> tuple[float, float]:
        """Values at the ends of the colour scale; they differ."""
        known = self.values[np.isfinite(self.values)]
        low = self.low if self.low is not None else float(known.min(initial=0.0)) if len(known) else 0.0
        high = self.high if self.high is not None else float(known.max()) if len(known) else 1.0
        return low, high if high > low else low + 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Camera:
    """A pinhole camera.

    Attributes:
        pos_ned_m: the place of the camera.
        q_ned_from_camera: attitude of the camera: x right, y down, z along the optical axis.
        width_px, height_px: size of its pictures.
        focal_px, centre_px: focal lengths and principal point, x and y.
        distortion: coefficients k1, k2, p1, p2, k3 of Brown's model; empty: none.
    """

    pos_ned_m: Vector
    q_ned_from_camera: Quaternion
    width_px: int
    height_px: int
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    distortion: tuple[float, ...] = ()
    role: Role = Role.MEASURED

    def moved(self, by_ned_m: Vector) -> Self:
        """The item at another place."""
        return replace(self, pos_ned_m=_sum(self.pos_ned_m, by_ned_m))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Picture:
    """A picture of a camera, with what was detected in it.

    Attributes:
        pixels: (height, width) grey or (height, width, 3) BGR, uint8.
        marks_px: (n, 2) detections, x to the right and y down.
        labels: of the detections; empty: none.
    """

    pixels: NDArray[np.uint8]
    marks_px: Array = field(default_factory=lambda: np.zeros((0, 2)))
    labels: tuple[str, ...] = ()
    role: Role = Role.MEASURED

    def moved(self, by_ned_m: Vector) -> Self:
        """The same: a picture has no place."""
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """One sample of a series over time.

    Attributes:
        value: NaN: not known from here on.
        unit: "m", "deg", "m/s", "nT"; "": a number.
        sigma: its standard deviation, whose band of three sigma is drawn around it (around 0 for an error);
            NaN: not known.
        error: the value is an error, estimate minus truth.
    """

    value: float
    unit: str = ""
    sigma: float = np.nan
    error: bool = False
    role: Role = Role.ESTIMATE

    def moved(self, by_ned_m: Vector) -> Self:
        """The same: a value has no place."""
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class Text:
    """An event: a mode, a phase, a text of the autopilot.

    Attributes:
        text: one line.
        state: short name of a state that lasts from here to the next one at the path: a mode, a phase;
            viewers draw it as a band over time. "": an event only.
        warning: it is a warning or worse.
    """

    text: str
    state: str = ""
    warning: bool = False
    role: Role = Role.ESTIMATE

    def moved(self, by_ned_m: Vector) -> Self:
        """The same: a text has no place."""
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class Cleared:
    """What was shown at the path is there no more."""

    role: Role = Role.BELIEF

    def moved(self, by_ned_m: Vector) -> Self:
        """The same."""
        return self


Placed = Origin | Pose | Line | PointSet | Gaussian | Field | Camera | Picture | Value | Text | Cleared


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Relative:
    """An item whose positions are relative to a vehicle: to its true place where the log has one, else to the
    place that it reports. For what an aircraft knows that does not know its own position.

    Attributes:
        item: with positions from the vehicle, along north, east and down.
        system_id: of the vehicle.
    """

    item: Placed
    system_id: int


Item = Placed | Relative
"""What estimators and missions show."""


class Entry(NamedTuple):
    """An item at a path from a time on, until another one replaces it.

    Attributes:
        path: such as "vehicles/1/estimate"; parts are words, numbers, `-` and `_`.
        time_us: on the timeline of the run: vehicle time of the first vehicle.
    """

    path: str
    time_us: int
    item: Placed


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]
