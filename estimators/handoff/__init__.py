"""The decision which of the handoff aircraft's tracks is the tracker's target (Tolman et al. 2021)."""

from estimators.handoff.alignment import Alignment, align
from estimators.handoff.comparison import TrackComparison, TrackWindows
from estimators.handoff.dead_reckoning import DeadReckoning, TrackHistory
from estimators.handoff.evidence import EvidenceComparison, EvidenceParameters
from estimators.handoff.matching import Match, MatchComparison, MatchingParameters, Residual, blended

__all__ = [
    "Alignment",
    "DeadReckoning",
    "EvidenceComparison",
    "EvidenceParameters",
    "Match",
    "MatchComparison",
    "MatchingParameters",
    "Residual",
    "TrackComparison",
    "TrackHistory",
    "TrackWindows",
    "align",
    "blended",
]
