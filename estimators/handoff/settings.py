"""Parameters of the estimator `handoff`."""

from dataclasses import dataclass
from typing import Literal

from estimators.relative_pose.parameters import RelativePoseSettings
from flightsim.foundation.options import option, other_default


@dataclass(frozen=True, slots=True, kw_only=True)
class HandoffSettings(RelativePoseSettings):
    """Parameters of the estimator. The noise is that of flights at some 300 m from the targets."""

    role: Literal["handoff", "tracker"] = option(
        "handoff",
        help="Aircraft on board of which it runs: handoff, which decides, or tracker, which reports.",
    )
    target_north_m: float | None = option(
        None,
        varies="the nearest track",
        help="Place north of home at which the tracker's operator designates the target.",
    )
    target_east_m: float | None = option(
        None,
        varies="the nearest track",
        help="Place east of home at which the tracker's operator designates the target.",
    )
    # larger than of relative-pose: to approach makes the pose narrower, and the comparison knows its width
    converged_sigma_m: float = other_default(30.0)
    designate_m: float = option(
        80.0, above=0.0, help="Distance from that place within which a track is designated."
    )
    ground_altitude_m: float | None = option(
        None, varies="that before it is armed", help="Pressure altitude of the ground."
    )
    rate_hz: float = option(10.0, above=0.0, help="Rate of the camera.")
    tilt_step_rad: float = option(
        0.004, above=0.0, help="Errors of roll and pitch that change from frame to frame."
    )
    tilt_sigma_rad: float = option(0.015, above=0.0, help="Slow errors of roll and pitch.")
    pose_sigma_m: float = option(
        10.0, above=0.0, help="Error of the pose's place that its covariance does not contain."
    )
    pose_sigma_rad: float = option(
        0.05, above=0.0, help="Error of the pose's heading that its covariance does not contain."
    )
    speed_max_m_s: float = option(
        15.0, above=0.0, help="Largest speed against the air of a target whose track is kept."
    )
    clutter_per_m2: float = option(2.5e-5, above=0.0, help="Density of false points.")
    window_s: float = option(10.0, above=0.0, help="Time over which tracks are compared (paper: 100 frames).")
    decision: float = option(0.99, above=0.5, below=1.0, help="Probability that decides for a track.")
    hold_s: float = option(3.0, above=0.0, help="Time for which that probability must last.")
    report_s: float = option(0.2, above=0.0, help="Time between the tracker's reports.")
    motion_s: float = option(0.1, above=0.0, help="Time between the tracker's messages about its motion.")
    decision_s: float = option(
        0.5, above=0.0, help="Time between messages of the decision until the tracker has answered."
    )

    def check_together(self) -> None:
        if (self.target_north_m is None) != (self.target_east_m is None):
            raise ValueError("target_north_m and target_east_m make a place together; give both, or neither")
