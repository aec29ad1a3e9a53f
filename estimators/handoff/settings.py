"""Parameters of the estimator `handoff`."""

import math
from dataclasses import dataclass
from typing import Literal

from estimators.handoff.evidence import EvidenceParameters
from estimators.handoff.process import WindowParameters
from estimators.relative_pose.estimator import RelativePoseSettings
from estimators.tracking.recursive_ransac import RansacParameters
from flightsim.foundation.checks import require_positive, require_probability


@dataclass(frozen=True, slots=True, kw_only=True)
class HandoffSettings(RelativePoseSettings):
    """Parameters of the estimator. The noise is that of flights at some 300 m from the targets.

    Attributes:
        role: aircraft on board of which it runs: "handoff" (`vehicle`), which decides, or "tracker"
            (`other`), which reports its tracks.
        target_north_m, target_east_m: place from home at which the tracker's operator designates the target;
            None: the track nearest to the aircraft is designated.
        converged_sigma_m: as of `relative-pose`, but larger: to approach is what makes the pose narrower, and
            the comparison knows how wide it is.
        designate_m: a track within this distance of the place is designated.
        ground_altitude_m: pressure altitude of the ground; None: that before the aircraft is armed.
        rate_hz: of the camera.
        tilt_step_rad: errors of roll and pitch that change from frame to frame.
        tilt_sigma_rad: slow errors of roll and pitch.
        pose_sigma_m, pose_sigma_rad: errors of the pose that its covariance does not contain.
        speed_max_m_s: largest speed of a target against the air, in which tracks are kept.
        clutter_per_m2: density of false points.
        window_s: time over which tracks are compared (paper: 100 frames).
        decision: probability of a track that is decided for.
        hold_s: time for which it must stay above.
        report_s: time between the tracker's reports.
        motion_s: time between the tracker's messages about its motion.
        decision_s: time between messages of the decision until the tracker has answered.
    """

    role: Literal["handoff", "tracker"] = "handoff"
    target_north_m: float | None = None
    target_east_m: float | None = None
    converged_sigma_m: float = 30.0
    designate_m: float = 80.0
    ground_altitude_m: float | None = None
    rate_hz: float = 10.0
    tilt_step_rad: float = 0.004
    tilt_sigma_rad: float = 0.015
    pose_sigma_m: float = 10.0
    pose_sigma_rad: float = 0.05
    speed_max_m_s: float = 15.0
    clutter_per_m2: float = 2.5e-5
    window_s: float = 10.0
    decision: float = 0.99
    hold_s: float = 3.0
    report_s: float = 0.2
    motion_s: float = 0.1
    decision_s: float = 0.5

    def __post_init__(self) -> None:
        # zero-argument super() does not reach the base of a dataclass with slots
        RelativePoseSettings.__post_init__(self)
        if (self.target_north_m is None) != (self.target_east_m is None):
            raise ValueError("target_north_m and target_east_m make a place together; give both, or neither")
        if self.ground_altitude_m is not None and not math.isfinite(self.ground_altitude_m):
            raise ValueError(f"ground_altitude_m {self.ground_altitude_m} is not a height")
        require_positive(
            **{
                name: getattr(self, name)
                for name in (
                    *("designate_m", "rate_hz", "tilt_step_rad", "tilt_sigma_rad", "pose_sigma_m"),
                    *("pose_sigma_rad", "speed_max_m_s", "clutter_per_m2"),
                    *("window_s", "hold_s", "report_s", "motion_s", "decision_s"),
                )
            }
        )
        require_probability(decision=self.decision)

    @property
    def windows(self) -> WindowParameters:
        """The windows that are compared."""
        every_s = 1.0 / self.rate_hz
        return WindowParameters(samples=max(3, round(self.window_s * self.rate_hz)), every_s=every_s)

    @property
    def evidence(self) -> EvidenceParameters:
        """The comparison."""
        return EvidenceParameters(
            tilt_sigma_rad=self.tilt_sigma_rad,
            pose_sigma_m=self.pose_sigma_m,
            pose_sigma_rad=self.pose_sigma_rad,
            wrong_sigma_m=4.0 * self.pose_sigma_m,
            decision=self.decision,
            hold_s=self.hold_s,
        )

    @property
    def ransac(self) -> RansacParameters:
        """The tracker of this aircraft."""
        return RansacParameters(
            noise_density=0.2,
            clutter_per_m2=self.clutter_per_m2,
            window=round(2.0 * self.rate_hz),
            good_age=round(1.0 * self.rate_hz),
            lost_after=round(1.5 * self.rate_hz),
            inlier_m=4.0,
            speed_max_m_s=self.speed_max_m_s,
            seed_support=round(0.6 * self.rate_hz),
            seed=2 * self.seed + (self.role == "tracker"),
        )
