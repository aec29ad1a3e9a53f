"""Options of a handoff."""

import math
from dataclasses import dataclass
from typing import Final, Literal

from missions.base.options import MissionOptions, check_positive
from missions.errors import PlanError
from missions.vehicle.gps_switch import GpsOff
from missions.vehicle.limits import FixedWingLimits, Limits

_TRACKER_ORBIT: Final = 1.25
"""Radius of the tracker's orbit over that of the first aircraft. In opposite orbits with equal rates of turn
the relative velocity keeps its direction, and the ranges can't tell a place from its mirror image on the
other side of it (docs/handoff.md).
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class HandoffOptions(MissionOptions):
    """A handoff between two aircraft: the first arrives without GPS, the second tracks the target.

    Attributes:
        altitude_m: height of the first aircraft above home; the second is `separation_m` above it.
        radius_m: of the first aircraft's orbit, horizontal.
        airspeed_m_s: equivalent airspeed; None: the aircraft's default.
        target_ne_m: place of the target from home, as the operator of the second aircraft has seen it.
        start_distance_m, start_bearing_rad: place from the target at which the first aircraft loses GPS.
        gps_fault: GPS of the first aircraft is switched off there.
        gps_off: how it is switched off.
        timeout_s: time without a decision after which the mission fails (paper: 15 minutes).
        takeover_s: time for which the first aircraft follows the target alone after the handoff.
        belief: what estimates the relative pose.
        decision: probability of a track that is decided for.
        confirm_after_s: time after which the tracker's operator confirms a target whose identity has become
            doubtful; 0: there is no operator.
        link_loss, link_delay_s: share of the messages between the aircraft that are lost, and their mean
            delay.
        estimator_seed: of the random numbers of estimators and link.
    """

    altitude_m: float = 95.0
    separation_m: float = 20.0
    radius_m: float = 150.0
    airspeed_m_s: float | None = None
    target_ne_m: tuple[float, float] = (900.0, 200.0)
    start_distance_m: float = 700.0
    start_bearing_rad: float = math.pi
    gps_fault: bool = True
    gps_off: GpsOff = GpsOff.AUTO
    timeout_s: float = 900.0
    takeover_s: float = 60.0
    belief: Literal["particles", "gaussians"] = "gaussians"
    decision: float = 0.99
    confirm_after_s: float = 5.0
    link_loss: float = 0.02
    link_delay_s: float = 0.05
    estimator_seed: int = 0

    def __post_init__(self) -> None:
        super(HandoffOptions, self).__post_init__()
        check_positive(
            radius_m=self.radius_m,
            airspeed_m_s=self.airspeed_m_s,
            start_distance_m=self.start_distance_m,
            timeout_s=self.timeout_s,
            takeover_s=self.takeover_s,
        )
        if not all(math.isfinite(value) for value in self.target_ne_m):
            raise PlanError("`target_ne_m` is not a place; give NORTH,EAST in metres from home")
        if not 0.5 < self.decision < 1.0:
            raise PlanError(f"`decision` {self.decision:g} is not a probability between 0.5 and 1")
        if not 0.0 <= self.confirm_after_s < math.inf:
            raise PlanError(f"`confirm_after_s` {self.confirm_after_s:g} is not a time from 0 s")
        if not 0.0 <= self.link_loss < 1.0:
            raise PlanError(f"`link_loss` {self.link_loss:g} is not a share from 0 to below 1")
        if not 0.0 <= self.link_delay_s <= 5.0:
            raise PlanError(f"`link_delay_s` {self.link_delay_s:g} s is not in 0..5 s")
        if self.estimator_seed < 0:
            raise PlanError(f"`estimator_seed` {self.estimator_seed} is not a number from 0")

    @property
    def start_ne_m(self) -> tuple[float, float]:
        """Place from home at which the first aircraft loses GPS."""
        return (
            self.target_ne_m[0] + self.start_distance_m * math.cos(self.start_bearing_rad),
            self.target_ne_m[1] + self.start_distance_m * math.sin(self.start_bearing_rad),
        )

    @property
    def tracker_radius_m(self) -> float:
        """Of the second aircraft's orbit, horizontal."""
        return _TRACKER_ORBIT * self.radius_m

    def airspeed(self, limits: FixedWingLimits) -> float:
        """Equivalent airspeed of the orbits."""
        return limits.airspeed_trim_m_s if self.airspeed_m_s is None else self.airspeed_m_s


def check_vehicle(options: HandoffOptions, limits: Limits) -> None:
    """Refuse a handoff that an aircraft can't fly.

    Raises:
        PlanError: names the reason and what to change.
    """
    if options.vehicles != 2:
        raise PlanError(f"`vehicles` {options.vehicles}: a handoff is flown by 2 aircraft")
    if not isinstance(limits, FixedWingLimits):
        raise PlanError("handoff is flown by aircraft with wings; choose `model=aerosonde`, or another one")
    airspeed_m_s = options.airspeed(limits)
    limits.check_airspeed(airspeed_m_s)
    limits.check_separation(options.separation_m, options.vehicles)
    limits.check_altitude(options.own_altitude_m)
    least_m = limits.turn_radius_m(airspeed_m_s)
    if options.radius_m < least_m:
        raise PlanError(
            f"an orbit of radius {options.radius_m:g} m can't be held at {airspeed_m_s:g} m/s: "
            f"{least_m:.0f} m or more can; ask for `radius_m` {10.0 * math.ceil(0.1 * least_m):g}, or "
            "a lower `airspeed_m_s`"
        )
    orbit_m = options.tracker_radius_m
    reach_m = max(math.hypot(*options.target_ne_m), math.hypot(*options.start_ne_m)) + orbit_m
    if reach_m > limits.reach_m:
        raise PlanError(
            f"the orbits may be {reach_m:.0f} m from home, more than {limits.reach_m:g} m; ask for a "
            "`target_ne_m` nearer to home, or a smaller `start_distance_m`"
        )
    if options.own_altitude_m < 0.2 * orbit_m:
        raise PlanError(
            f"from {options.own_altitude_m:g} m at {orbit_m:g} m targets are seen too flat to "
            "measure their places; ask for a higher `altitude_m` or a smaller `radius_m`"
        )
