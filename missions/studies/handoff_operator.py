"""The operator of the study `handoff`: a model of the person who points at the target in a picture.

The person sees what the picture shows at that moment, answers after seconds, and sometimes takes another
person for the target: the more often, the smaller they are in the picture and the closer together. The
tracker knows how often that happens (`slip`) and counts every request.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flightsim.foundation.checks import Count, NotNegative, Positive, Share
from flightsim.foundation.options import Options
from missions.studies.handoff_world import SeenTarget

__all__ = ["Answer", "Person", "PersonParameters", "slip"]

Pixel = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class PersonParameters(Options):
    """The person.

    Attributes:
        answer_s: least and greatest time from a request to the answer (Endsley and Kiris 1995, "The
            out-of-the-loop performance problem", have some seconds to regain the situation).
        patience_s: time that the person waits beyond it for the target to be clear of others.
        clear_px: distance in the picture from which it is.
        least_px: smaller persons are not recognised.
        legible_px: height from which smallness adds no error (Johnson 1958: 8 pixels, four line pairs, over
            the least dimension recognise an object).
        close_px: distance of another person in the picture, both of that height, at which it is taken for
            the target with a probability of 0.5 exp(-1/2).
        lapse: probability that any other person in view is taken for the target.
        click_px: standard deviation per axis of the point that is clicked.
        requests: largest number of requests in a trial.
    """

    answer_s: tuple[NotNegative, NotNegative] = (3.0, 8.0)
    patience_s: NotNegative = 15.0
    clear_px: Positive = 50.0
    least_px: Positive = 2.5
    legible_px: Positive = 8.0
    close_px: Positive = 10.0
    lapse: Share = 0.002
    click_px: Positive = 2.5
    requests: Count = 5


def slip(away_px: float, height_px: float, parameters: PersonParameters) -> float:
    """Probability that another person at a distance in the picture is taken for the target.

    Args:
        away_px: distance of both in the picture.
        height_px: of the smaller one.
        parameters: of the person who looks.
    """
    p = parameters
    close_px = p.close_px * max(1.0, p.legible_px / height_px)
    return 0.5 * math.exp(-0.5 * (away_px / close_px) ** 2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What the person says.

    Attributes:
        point: where it was clicked in the picture, right and down from its middle; None: not at all.
        yes: the marked track is the target.
        clear: no other person was close to the target in the picture.
    """

    point: Pixel | None = None
    yes: bool = False
    clear: bool = False


class Person:
    """Looks at the tracker's picture, and answers requests.

    Args:
        parameters: what the person can.
        rng: of delays and errors.

    Attributes:
        asked: number of requests so far.
        waiting: there is a request without an answer.
        mistaken: the last answer named another person than the target; the study reports it.
    """

    def __init__(self, parameters: PersonParameters, rng: np.random.Generator) -> None:
        self.parameters = parameters
        self.asked = 0
        self.mistaken = False
        self._rng = rng
        self._from_us: int | None = None

    @property
    def waiting(self) -> bool:
        return self._from_us is not None

    def ask(self, time_us: int) -> bool:
        """Ask for the target; returns whether there was a request left."""
        p = self.parameters
        if self.asked >= p.requests:
            return False
        self.asked += 1
        self._from_us = time_us + round(1e6 * self._rng.uniform(*p.answer_s))
        return True

    def look(self, time_us: int, picture: Sequence[SeenTarget], marked: Pixel | None) -> Answer | None:
        """Look at the picture.

        Args:
            time_us: present time.
            picture: who is in it.
            marked: where the program marks the track that it follows; None: it follows none.

        Returns:
            the answer to the request; None: there is no request, or the person still looks.
        """
        p = self.parameters
        if self._from_us is None or time_us < self._from_us:
            return None
        late = time_us >= self._from_us + 1e6 * p.patience_s
        seen = [target for target in picture if target.height_px >= p.least_px]
        wanted = next((target for target in seen if target.wanted), None)
        if wanted is None:
            if late:
                self._from_us = None
                return Answer()
            return None
        others = [target for target in seen if target is not wanted]
        away = [math.hypot(t.x_px - wanted.x_px, t.y_px - wanted.y_px) for t in others]
        clear = min(away, default=math.inf) >= p.clear_px
        if not (late or clear):
            return None
        self._from_us = None
        taken = self._taken(wanted, others, away)
        self.mistaken = taken is not wanted
        if marked is not None:
            off_px = [(math.dist(marked, (t.x_px, t.y_px)), t is taken) for t in seen]
            nearest_px, is_it = min(off_px)
            if is_it and nearest_px < p.clear_px:
                return Answer(yes=True, clear=clear)
        x_px, y_px = self._rng.normal((taken.x_px, taken.y_px), p.click_px).tolist()
        return Answer(point=(x_px, y_px), clear=clear)

    def _taken(
        self, wanted: SeenTarget, others: Sequence[SeenTarget], away_px: Sequence[float]
    ) -> SeenTarget:
        """Whom the person takes for the target."""
        p = self.parameters
        for other, distance_px in zip(others, away_px, strict=True):
            if self._rng.random() < slip(distance_px, min(wanted.height_px, other.height_px), p):
                return other
        if others and self._rng.random() < p.lapse:
            return others[int(self._rng.integers(len(others)))]
        return wanted
