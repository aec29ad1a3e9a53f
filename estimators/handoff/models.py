"""What the parameters of the handoff make: windows, comparison and tracker."""

from estimators.handoff.evidence import EvidenceParameters
from estimators.handoff.process import WindowParameters
from estimators.handoff.settings import HandoffSettings
from estimators.tracking.recursive_ransac import RansacParameters


def windows_of(settings: HandoffSettings) -> WindowParameters:
    """The windows that are compared."""
    every_s = 1.0 / settings.rate_hz
    return WindowParameters(samples=max(3, round(settings.window_s * settings.rate_hz)), every_s=every_s)


def evidence_of(settings: HandoffSettings) -> EvidenceParameters:
    """The comparison."""
    return EvidenceParameters(
        tilt_sigma_rad=settings.tilt_sigma_rad,
        pose_sigma_m=settings.pose_sigma_m,
        pose_sigma_rad=settings.pose_sigma_rad,
        wrong_sigma_m=4.0 * settings.pose_sigma_m,
        decision=settings.decision,
        hold_s=settings.hold_s,
    )


def ransac_of(settings: HandoffSettings) -> RansacParameters:
    """The tracker of this aircraft."""
    return RansacParameters(
        noise_density=0.2,
        clutter_per_m2=settings.clutter_per_m2,
        window=round(2.0 * settings.rate_hz),
        good_age=round(1.0 * settings.rate_hz),
        lost_after=round(1.5 * settings.rate_hz),
        inlier_m=4.0,
        speed_max_m_s=settings.speed_max_m_s,
        seed_support=round(0.6 * settings.rate_hz),
        seed=2 * settings.seed + (settings.role == "tracker"),
    )
