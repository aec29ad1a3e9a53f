"""Limits of a vehicle for a planner, and checks against them."""

import math
from dataclasses import dataclass, fields
from typing import Final

from flightsim.foundation.atmosphere import GRAVITY_M_S2, true_over_equivalent_airspeed
from missions.errors import PlanError
from missions.kind import VehicleKind

TURN_MARGIN: Final = 1.2  # factor of the radius, for gusts and for the time of the roll into a bank
FORECAST_WIND_M_S: Final = 5.0
"""Wind that turns are planned for when no forecast was specified: a breezy day."""


_MAY_BE_ZERO: Final = frozenset({"wind_m_s", "guidance_s", "waypoint_lead_s"})


@dataclass(frozen=True, slots=True, kw_only=True)
class _Limits:
    """Limits that apply to every vehicle.

    Attributes:
        altitude_min_m, altitude_max_m: heights above home. 120 m is the ceiling of the open category (EU
            2019/947).
        reach_m: largest distance of a pattern from home.
        separation_min_m: smallest distance between the layers of a team: both vehicles have a height error,
            and a multicopter's wake is strongest directly below it.
    """

    altitude_min_m: float = 1.5
    altitude_max_m: float = 120.0
    reach_m: float = 5000.0
    separation_min_m: float = 2.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, float) or (value == 0.0 and field.name in _MAY_BE_ZERO):
                continue
            if field.name == "air_altitude_m" and math.isfinite(value):
                continue
            if not (math.isfinite(value) and value > 0.0):
                raise PlanError(
                    f"vehicle limit {field.name} = {value} is not possible; it must be more than 0"
                )

    def check_altitude(self, altitude_m: float) -> None:
        """Refuse an altitude above home outside the limits."""
        if not self.altitude_min_m <= altitude_m <= self.altitude_max_m:
            raise PlanError(
                f"altitude {altitude_m:g} m is not in {self.altitude_min_m:g}..{self.altitude_max_m:g} m "
                "above home; change `altitude_m`"
            )

    def check_separation(self, separation_m: float, vehicles: int) -> None:
        """Refuse layers of a team that are too close for its vehicles."""
        if vehicles > 1 and not separation_m >= self.separation_min_m:
            raise PlanError(
                f"layers of {separation_m:.3g} m are too thin for a team of {vehicles} with such a vehicle; "
                f"ask for `separation_m` {self.separation_min_m:g} or more, or fewer `vehicles`"
            )

    def check_reach(self, distance_m: float) -> None:
        """Refuse a pattern that extends too far from home."""
        if not distance_m <= self.reach_m:
            raise PlanError(
                f"the pattern reaches {distance_m:.0f} m from home, more than {self.reach_m:g} m; "
                "ask for a smaller `width_m, height_m` or a lower `speed_m_s`, or for a simpler `pattern` "
                "(L1)"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class MulticopterLimits(_Limits):
    """Limits of a multicopter for planning.

    Attributes:
        speed_m_s: largest ground speed (PX4 MPC_XY_VEL_MAX 12; ArduCopter WPNAV_SPEED 10).
        acceleration_m_s2: largest horizontal acceleration (PX4 MPC_ACC_HOR 3; ArduCopter WPNAV_ACCEL 2.5).
        yaw_rate_rad_s: largest yaw rate (PX4 MPC_YAWRAUTO_MAX 60 deg/s).
        smoothing_s: time over which an acceleration builds up; jerk stays below 2 acceleration / smoothing.
    """

    speed_m_s: float = 12.0
    acceleration_m_s2: float = 3.0
    yaw_rate_rad_s: float = math.radians(60.0)
    smoothing_s: float = 0.8

    @property
    def kind(self) -> VehicleKind:
        return VehicleKind.MULTICOPTER

    @property
    def lateral_m_s2(self) -> float:
        """Share of the acceleration for turning; combined with `tangential_m_s2` it gives the whole (0.8,
        0.6, 1).
        """
        return 0.8 * self.acceleration_m_s2

    @property
    def tangential_m_s2(self) -> float:
        """Share of the acceleration for changes of speed."""
        return 0.6 * self.acceleration_m_s2

    def check_speed(self, speed_m_s: float) -> None:
        """Refuse a ground speed the vehicle can't fly."""
        if not (math.isfinite(speed_m_s) and 0.0 < speed_m_s <= self.speed_m_s):
            raise PlanError(
                f"speed {speed_m_s:g} m/s is not in 0..{self.speed_m_s:g} m/s, the vehicle's range; "
                "change `speed_m_s`"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedWingLimits(_Limits):
    """Limits of a fixed wing for planning.

    Attributes:
        airspeed_min_m_s, airspeed_trim_m_s, airspeed_max_m_s: equivalent airspeed.
        bank_max_rad: largest bank that its autopilot commands.
        bank_parameter: name of the autopilot's parameter for it, for messages.
        wind_m_s: forecast of the steady wind that turns are planned for.
        air_altitude_m: altitude of the flight above mean sea level: in thinner air it flies faster and turns
            wider.
        guidance_s: time in which its path guidance converges on a line: period times damping over pi. The
            reference length of L1 guidance (S. Park et al., AIAA 2004-4900) is the distance flown in this
            time. 0: not known, and no limit.
        guidance_parameter: name of the parameter that sets it, for messages.
        waypoint_lead_s: time before a bend at which the next leg must begin, if a waypoint's own radius
            determines it. 0: the autopilot determines it by itself.
    """

    altitude_min_m: float = 20.0
    reach_m: float = 20_000.0
    separation_min_m: float = 10.0  # in gusts the height is held to about 4 m
    airspeed_min_m_s: float = 10.0
    airspeed_trim_m_s: float = 15.0
    airspeed_max_m_s: float = 20.0
    bank_max_rad: float = math.radians(50.0)
    bank_parameter: str = "bank limit"
    wind_m_s: float = 0.0
    air_altitude_m: float = 0.0
    guidance_s: float = 0.0
    guidance_parameter: str = "guidance period"
    waypoint_lead_s: float = 0.0

    @property
    def kind(self) -> VehicleKind:
        return VehicleKind.FIXED_WING

    def check_airspeed(self, airspeed_m_s: float) -> None:
        """Refuse an airspeed the aircraft can't fly."""
        if not self.airspeed_min_m_s <= airspeed_m_s <= self.airspeed_max_m_s:
            raise PlanError(
                f"airspeed {airspeed_m_s:g} m/s is not in "
                f"{self.airspeed_min_m_s:g}..{self.airspeed_max_m_s:g} m/s, the aircraft's range; "
                "change the speed"
            )
        if airspeed_m_s <= 1.2 * self.wind_m_s:
            raise PlanError(
                f"airspeed {airspeed_m_s:g} m/s leaves no way forward in {self.wind_m_s:.3g} m/s of wind "
                "at the height of the flight; fly faster, or wait for less wind"
            )

    def true_airspeed_m_s(self, airspeed_m_s: float) -> float:
        """True airspeed at the altitude of the flight, for an equivalent airspeed."""
        return airspeed_m_s * true_over_equivalent_airspeed(self.air_altitude_m)

    def turn_radius_m(self, airspeed_m_s: float, *, drift_m_s: float = 0.0) -> float:
        """Radius of the tightest circle over ground that can be held all the way round, with a margin.

        Somewhere on the circle the wind is a tail wind: (V + w)^2 / (g tan(bank)), times 1.2, with the true
        airspeed V.

        Args:
            airspeed_m_s: equivalent airspeed.
            drift_m_s: ground speed of the circle's centre.
        """
        fastest = self.true_airspeed_m_s(airspeed_m_s) + self.wind_m_s + drift_m_s
        return TURN_MARGIN * fastest**2 / (GRAVITY_M_S2 * math.tan(self.bank_max_rad))

    def guided_radius_m(self, airspeed_m_s: float) -> float:
        """Radius of the tightest bend over ground that the autopilot's own path guidance still follows
        closely.

        A bend much tighter than the guidance's reference length ends before the guidance has reacted.
        """
        return (self.true_airspeed_m_s(airspeed_m_s) + self.wind_m_s) * self.guidance_s

    def path_radius_m(self, airspeed_m_s: float) -> float:
        """Radius of the tightest bend of a path for this aircraft, limited by its bank and its guidance."""
        return max(self.turn_radius_m(airspeed_m_s), self.guided_radius_m(airspeed_m_s))


Limits = MulticopterLimits | FixedWingLimits
"""Limits of one vehicle."""

WIDEST_LIMITS: Final = MulticopterLimits(speed_m_s=20.0, acceleration_m_s2=5.0)
"""Limits beyond which any multicopter is refused; a vehicle's own limits are read from it later."""

WIDEST_FIXED_WING_LIMITS: Final = FixedWingLimits(
    airspeed_min_m_s=3.0,
    airspeed_trim_m_s=20.0,
    airspeed_max_m_s=150.0,
    bank_max_rad=math.radians(80.0),
    bank_parameter="more than its autopilot will allow",
    altitude_max_m=3000.0,
)
"""Limits beyond which any fixed wing is refused."""
