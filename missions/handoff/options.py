"""Options of a handoff."""

import math
from dataclasses import dataclass
from typing import Final

from estimators.handoff.settings import HandoffSettings
from flightsim.foundation.options import held, option
from missions.base.options import MissionOptions
from missions.gps_off import GpsOff

_TRACKER_ORBIT: Final = 1.25
"""Radius of the tracker's orbit over that of the first aircraft. In opposite orbits with equal rates of turn
the relative velocity keeps its direction, and the ranges can't tell a place from its mirror image on the
other side of it (docs/handoff.md).
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class HandoffOptions(MissionOptions):
    """A handoff between two aircraft: the first arrives without GPS, the second tracks the target.

    Attributes:
        estimator: parameters of the estimators that the mission runs, but for aircraft and target.
    """

    altitude_m: float = option(95.0, help="Height of the first aircraft above home.")
    separation_m: float = option(20.0, above=0.0, help="Height of the second aircraft above the first.")
    radius_m: float = option(
        150.0, above=0.0, help="Radius of the first aircraft's orbit; the tracker's is 1.25 times as wide."
    )
    airspeed_m_s: float | None = option(
        None, above=0.0, varies="the aircraft's own", help="Equivalent airspeed of the aircraft."
    )
    target_ne_m: tuple[float, float] = option(
        (900.0, 200.0),
        metavar="NORTH,EAST",
        help="Place where the operator has seen the target, m from home; the nearest track is designated.",
    )
    start_distance_m: float = option(
        700.0, above=0.0, help="Distance from the target to the place where GPS is lost."
    )
    start_bearing_rad: float = option(math.pi, help="Bearing from the target to the place where GPS is lost.")
    gps_fault: bool = option(True, help="GPS is left on; the handoff doesn't use it.")
    gps_off: GpsOff = option(GpsOff.AUTO, help="Way of switching GPS off, as for the mission orbit.")
    timeout_s: float = option(
        900.0, above=0.0, help="Time without a decision after which the flight fails (paper: 15 minutes)."
    )
    takeover_s: float = option(
        60.0, above=0.0, help="Time for which the first aircraft follows the target alone."
    )
    confirm_after_s: float = option(
        5.0,
        least=0.0,
        varies="with `connect`: 0",
        help="Time after which the tracker's operator confirms a doubtful target; 0: never.",
    )
    link_loss: float = option(0.02, least=0.0, below=1.0, help="Share of the messages that are lost.")
    link_delay_s: float = option(0.05, least=0.0, most=5.0, help="Mean delay of the messages.")
    estimator: HandoffSettings = held(
        HandoffSettings(), belief="belief", decision="decision", estimator_seed="seed"
    )

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
