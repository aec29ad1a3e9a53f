"""An estimator as a user would write one in a file: sets of targets from images. For the tests."""

from dataclasses import dataclass, field
from typing import ClassVar

from estimators.interface import Estimator, Need, Outcome
from estimators.observations import Image


@dataclass(frozen=True, slots=True, kw_only=True)
class FinderParameters:
    """Parameters.

    Attributes:
        least: smallest value of a bright pixel.
    """

    least: int = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """Bright pixels as places."""

    COLUMNS: ClassVar[tuple[str, ...]] = ("north_m", "east_m", "level")
    time_us: int
    subject: int = 0
    places: tuple[tuple[float, float, float], ...] = field(default=())

    def rows(self):
        return self.places


class Finder(Estimator[FinderParameters]):
    """Every bright pixel of an image is a target, offset by the newest roll."""

    NAME = "finder"
    PARAMETERS = FinderParameters
    OBSERVES = (Image,)

    @property
    def needs(self):
        return (Need(messages=("ATTITUDE",), rate_hz=0.0, purpose="roll"),)

    def handle(self, time_us, message):
        self.roll = message.roll
        return Outcome.USED

    def observe(self, time_us, observation):
        bright = (observation.pixels >= self.parameters.least).nonzero()
        places = tuple(
            (float(row) + self.roll, float(column), float(observation.pixels[row, column]))
            for row, column in zip(*(axis.tolist() for axis in bright), strict=True)
        )
        self.newest = Found(time_us=time_us, places=places)
        return Outcome.UPDATED

    def reset(self):
        self.roll = 0.0

    @property
    def estimates(self):
        return (self.newest,)
