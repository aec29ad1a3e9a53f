"""What a target adds to the total field around it."""

import math
from dataclasses import dataclass
from typing import Final, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import Positive
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options

Array = NDArray[np.float64]
Places: TypeAlias = NDArray[np.float64] | np.float64

_MU0_4PI_NT: Final = 1e-7 * 1e9
"""mu_0 / 4 pi in nT m / A."""


class Signature(Protocol):
    """A target's part of the total field."""

    @property
    def north_m(self) -> float:
        """Where the target is, metres north of home."""

    @property
    def east_m(self) -> float:
        """Metres east of home."""

    @property
    def velocity_ne_m_s(self) -> tuple[float, float]:
        """Velocity of a target that drifts, north and east; it is at its place at boot."""

    def anomaly_nt(self, north_m: Places, east_m: Places, height_m: float, field_ned_nt: Array) -> Places:
        """What it adds at places of any shape, at a height above home, in an Earth's field (3,)."""

    def anomaly_at_nt(self, north_m: float, east_m: float, height_m: float, field_ned_nt: Array) -> float:
        """What it adds at one place: `anomaly_nt`, compiled."""


_FASTEST_M_S: Final = 20.0


def require_velocity(velocity_ne_m_s: tuple[float, float]) -> None:
    """Raise ValueError unless a target drifts slowly."""
    if len(velocity_ne_m_s) != 2 or not math.hypot(*velocity_ne_m_s) <= _FASTEST_M_S:
        raise ValueError(
            f"velocity_ne_m_s = {velocity_ne_m_s!r} is not accepted: north and east, together up to "
            f"{_FASTEST_M_S:g} m/s, are"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class GaussianSignature(Options):
    """A two-dimensional Gaussian, the same at every height (Lum et al. 2005, figure 3).

    Attributes:
        north_m, east_m: centre, local NED of home.
        amplitude_nt: at the centre; below zero for a hole.
        sigma_along_m, sigma_across_m: standard deviations along and across the target's axis.
        heading_rad: of that axis, clockwise from north.
        velocity_ne_m_s: of a target that drifts, north and east.
    """

    north_m: float
    east_m: float
    amplitude_nt: float = 30.0
    sigma_along_m: Positive = 250.0
    sigma_across_m: Positive = 120.0
    heading_rad: float = 0.0
    velocity_ne_m_s: tuple[float, float] = (0.0, 0.0)

    def check_together(self) -> None:
        require_velocity(self.velocity_ne_m_s)

    def anomaly_nt(self, north_m: Places, east_m: Places, height_m: float, field_ned_nt: Array) -> Places:
        """The Gaussian; height and field don't matter."""
        north, east = north_m - self.north_m, east_m - self.east_m
        cosine, sine = math.cos(self.heading_rad), math.sin(self.heading_rad)
        along = (north * cosine + east * sine) / self.sigma_along_m
        across = (east * cosine - north * sine) / self.sigma_across_m
        value: Places = self.amplitude_nt * np.exp(-0.5 * (along * along + across * across))
        return value

    def anomaly_at_nt(self, north_m: float, east_m: float, height_m: float, field_ned_nt: Array) -> float:
        """The Gaussian at one place."""
        return _gaussian_nt(
            north_m - self.north_m,
            east_m - self.east_m,
            self.amplitude_nt,
            self.sigma_along_m,
            self.sigma_across_m,
            self.heading_rad,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class DipoleSignature(Options):
    """A magnetic dipole: the field of any compact body at some of its lengths away.

    B = mu_0 / 4 pi (3 (m r) r / |r|^5 - m / |r|^3) adds as a vector to the Earth's field; a scalar
    magnetometer reads what that does to the magnitude (Blakely, Potential theory in gravity and magnetic
    applications, sections 4.2 and 8.3).

    Attributes:
        north_m, east_m: place, local NED of home.
        height_m: above home; below the ground or the water it is negative.
        moment_ned_a_m2: dipole moment. Steel has some 0.1 to 1 A m2 per kilogram, a submarine 1e5.
        velocity_ne_m_s: of a target that drifts, north and east.
    """

    north_m: float
    east_m: float
    height_m: float
    moment_ned_a_m2: tuple[float, float, float]
    velocity_ne_m_s: tuple[float, float] = (0.0, 0.0)

    def check_together(self) -> None:
        require_velocity(self.velocity_ne_m_s)
        if len(self.moment_ned_a_m2) != 3 or not all(map(math.isfinite, self.moment_ned_a_m2)):
            raise ValueError(
                f"moment_ned_a_m2 = {self.moment_ned_a_m2!r} is not accepted: 3 finite numbers are"
            )

    def field_ned_nt(self, north_m: Places, east_m: Places, height_m: float) -> Array:
        """Field vectors (..., 3) of the dipole."""
        north, east = np.broadcast_arrays(north_m - self.north_m, east_m - self.east_m)
        down = np.full_like(north, self.height_m - height_m)
        offset = np.stack([north, east, down], axis=-1)
        # The model is not valid inside the body: a metre is the least distance.
        distance = np.maximum(1.0, np.sqrt(np.sum(offset * offset, axis=-1, keepdims=True)))
        moment = np.array(self.moment_ned_a_m2)
        along = np.sum(offset * moment, axis=-1, keepdims=True)
        field: Array = _MU0_4PI_NT * (3.0 * along * offset / distance**5 - moment / distance**3)
        return field

    def anomaly_nt(self, north_m: Places, east_m: Places, height_m: float, field_ned_nt: Array) -> Places:
        """Change of the magnitude of the Earth's field."""
        total = field_ned_nt + self.field_ned_nt(north_m, east_m, height_m)
        value: Places = np.sqrt(np.sum(total * total, axis=-1)) - math.sqrt(
            float(field_ned_nt @ field_ned_nt)
        )
        return value

    def anomaly_at_nt(self, north_m: float, east_m: float, height_m: float, field_ned_nt: Array) -> float:
        """Change of the magnitude of the Earth's field at one place."""
        moment = self.moment_ned_a_m2
        return _dipole_nt(
            north_m - self.north_m,
            east_m - self.east_m,
            self.height_m - height_m,
            moment[0],
            moment[1],
            moment[2],
            field_ned_nt,
        )


@kernel
def _gaussian_nt(
    north_m: float, east_m: float, amplitude_nt: float, along_m: float, across_m: float, heading_rad: float
) -> float:
    """A Gaussian at an offset from its centre."""
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
    along = (north_m * cosine + east_m * sine) / along_m
    across = (east_m * cosine - north_m * sine) / across_m
    return amplitude_nt * math.exp(-0.5 * (along * along + across * across))


@kernel
def _dipole_nt(
    north_m: float,
    east_m: float,
    down_m: float,
    moment_n: float,
    moment_e: float,
    moment_d: float,
    field_ned_nt: Array,
) -> float:
    """Change of the magnitude of a field (3,) by a dipole, at an offset from it."""
    # The model is not valid inside the body: a metre is the least distance.
    distance2 = max(1.0, north_m * north_m + east_m * east_m + down_m * down_m)
    per_distance3 = _MU0_4PI_NT / (distance2 * math.sqrt(distance2))
    along = 3.0 * (north_m * moment_n + east_m * moment_e + down_m * moment_d) / distance2
    north_nt = field_ned_nt[0] + per_distance3 * (along * north_m - moment_n)
    east_nt = field_ned_nt[1] + per_distance3 * (along * east_m - moment_e)
    down_nt = field_ned_nt[2] + per_distance3 * (along * down_m - moment_d)
    before_nt2 = field_ned_nt[0] ** 2 + field_ned_nt[1] ** 2 + field_ned_nt[2] ** 2
    return math.sqrt(north_nt**2 + east_nt**2 + down_nt**2) - math.sqrt(before_nt2)
