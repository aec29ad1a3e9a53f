"""The paper's handoff logic: matches with forgetting (Tolman et al. 2021, equations 44 to 47)."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from estimators.handoff.alignment import Alignment
from estimators.handoff.comparison import TrackComparison, TrackWindows
from estimators.relative_pose.belief import PoseMode
from flightsim.foundation.checks import Positive, Share
from flightsim.foundation.options import Options
from flightsim.foundation.vectors import wrap_pi


class Residual(StrEnum):
    """What T_r limits: the paper does not say which."""

    FROBENIUS = "frobenius"
    RMS = "rms"


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchingParameters(Options):
    """Thresholds of a match. The paper gives T_r and T_gamma.

    Attributes:
        residual: what `residual_m` limits: the norm over the whole window, or the root mean square per place.
        residual_m: T_r.
        rotation_rad: T_theta, largest difference between the rotation of the alignment and the relative
            heading.
        translation_m: T_t, largest distance between the target's place by the relative pose and the track.
        forgetting: zeta.
        decision: T_gamma.
    """

    residual: Residual = Residual.FROBENIUS
    residual_m: Positive = 15.0
    rotation_rad: Positive = 0.35
    translation_m: Positive = 20.0
    forgetting: Share = 0.05
    decision: Share = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class Match:
    """A track of the handoff aircraft beside the tracker's target.

    Attributes:
        alignment: of both windows.
        rotation_error_rad: e_theta with its sign: rotation of the alignment less relative heading, -pi..pi.
        translation_error_m: e_t: distance between the middle of the track and the middle of the target's
            window, taken to the handoff aircraft by the relative pose. The translation of the alignment
            itself would carry the error of its rotation over the distance to the target.
        matches: m of equation 47.
    """

    alignment: Alignment
    rotation_error_rad: float
    translation_error_m: float
    matches: bool


class MatchComparison(TrackComparison):
    """One score for each track: gamma <- zeta m + (1 - zeta) gamma.

    Args:
        parameters: thresholds.

    Attributes:
        newest: matches of the newest windows by track.
    """

    def __init__(self, parameters: MatchingParameters | None = None) -> None:
        super().__init__()
        self.parameters = parameters or MatchingParameters()
        self.newest: dict[int, Match] = {}
        self._scores: dict[int, float] = {}

    def update(self, windows: TrackWindows, pose: PoseMode) -> None:
        p = self.parameters
        self.newest = {}
        if windows.target is not None:
            self.newest = {
                number: self._match(windows.alignment(number, windows.target), window, windows.target, pose)
                for number, window in windows.handoff.items()
            }
        for number in sorted({*self._scores, *self.newest}):
            match = self.newest.get(number)
            score = self._scores.get(number, 0.0) * (1.0 - p.forgetting)
            self._scores[number] = score + (p.forgetting if match is not None and match.matches else 0.0)
            if self._scores[number] < 1e-6 and match is None:
                del self._scores[number]
        if self.decided is None and self._scores:
            best = max(self._scores, key=lambda number: self._scores[number])
            if self._scores[best] > p.decision:
                self.decided = best

    def _match(self, alignment: Alignment, handoff: np.ndarray, target: np.ndarray, pose: PoseMode) -> Match:
        p = self.parameters
        rotation = wrap_pi(alignment.heading_rad - pose.heading_rad)
        expected = pose.from_tracker(*target.mean(axis=0).tolist())
        off = handoff.mean(axis=0) - expected
        translation = float(np.hypot(off[0], off[1]))
        left = alignment.residual_m if p.residual is Residual.FROBENIUS else alignment.rms_m
        return Match(
            alignment=alignment,
            rotation_error_rad=rotation,
            translation_error_m=translation,
            matches=left < p.residual_m and abs(rotation) < p.rotation_rad and translation < p.translation_m,
        )

    @property
    def scores(self) -> Mapping[int, float]:
        return dict(self._scores)

    def reset(self) -> None:
        self.newest.clear()
        self._scores.clear()
        self.decided = None


def blended(visual: tuple[float, float], relative: tuple[float, float], score: float) -> tuple[float, float]:
    """Line of sight between that of the track and that of the relative pose (equation 45).

    Args:
        visual, relative: forward and right, m.
        score: gamma_b, 0..1.
    """
    return (score * visual[0] + (1.0 - score) * relative[0], score * visual[1] + (1.0 - score) * relative[1])
