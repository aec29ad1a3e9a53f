"""The decision which of the handoff aircraft's tracks is the tracker's target (Tolman et al. 2021)."""

from estimators.handoff.aircraft_tracks import AircraftTracks
from estimators.handoff.alignment import Alignment, align
from estimators.handoff.comparison import TrackComparison, TrackWindows
from estimators.handoff.dead_reckoning import DeadReckoning, TrackHistory
from estimators.handoff.designation import Designation, DesignationParameters
from estimators.handoff.estimate import HandoffEstimate
from estimators.handoff.estimator import HandoffEstimator
from estimators.handoff.evidence import EvidenceComparison, EvidenceParameters
from estimators.handoff.matching import Match, MatchComparison, MatchingParameters, Residual, blended
from estimators.handoff.process import HandoffProcess, TrackerReport, WindowParameters
from estimators.handoff.settings import HandoffSettings

__all__ = [
    "AircraftTracks",
    "Alignment",
    "DeadReckoning",
    "Designation",
    "DesignationParameters",
    "EvidenceComparison",
    "EvidenceParameters",
    "HandoffEstimate",
    "HandoffEstimator",
    "HandoffProcess",
    "HandoffSettings",
    "Match",
    "MatchComparison",
    "MatchingParameters",
    "Residual",
    "TrackComparison",
    "TrackHistory",
    "TrackWindows",
    "TrackerReport",
    "WindowParameters",
    "align",
    "blended",
]
