"""Public names of `estimators.handoff`, each where it is defined; see `__init__.py`."""

from estimators.handoff.aircraft_tracks import AircraftTracks as AircraftTracks
from estimators.handoff.alignment import Alignment as Alignment
from estimators.handoff.alignment import align as align
from estimators.handoff.comparison import TrackComparison as TrackComparison
from estimators.handoff.comparison import TrackWindows as TrackWindows
from estimators.handoff.dead_reckoning import DeadReckoning as DeadReckoning
from estimators.handoff.dead_reckoning import TrackHistory as TrackHistory
from estimators.handoff.designation import Designation as Designation
from estimators.handoff.estimate import HandoffEstimate as HandoffEstimate
from estimators.handoff.estimator import HandoffEstimator as HandoffEstimator
from estimators.handoff.evidence import EvidenceComparison as EvidenceComparison
from estimators.handoff.evidence import EvidenceParameters as EvidenceParameters
from estimators.handoff.identities import DesignationParameters as DesignationParameters
from estimators.handoff.matching import Match as Match
from estimators.handoff.matching import MatchComparison as MatchComparison
from estimators.handoff.matching import MatchingParameters as MatchingParameters
from estimators.handoff.matching import Residual as Residual
from estimators.handoff.matching import blended as blended
from estimators.handoff.process import HandoffProcess as HandoffProcess
from estimators.handoff.process import TrackerReport as TrackerReport
from estimators.handoff.process import WindowParameters as WindowParameters
from estimators.handoff.settings import HandoffSettings as HandoffSettings
