"""Checks of parameters: which numbers are looked at, and what an error says."""

import math
from dataclasses import dataclass
from enum import IntEnum

import pytest

from flightsim.foundation.checks import (
    Count,
    Finite,
    NotNegative,
    NotNegativeOrNan,
    Positive,
    PositiveOrInf,
    Rate,
    Share,
    Whole,
    require_finite,
    require_not_negative,
    require_positive,
    require_probability,
)
from flightsim.foundation.options import Options


class Kind(IntEnum):
    NONE = 0


@dataclass(frozen=True, kw_only=True)
class Parameters(Options):
    time_s: Positive = 1.0
    noise_m: NotNegative = 0.0
    angle_rad: Finite = -1.0
    reach_m: PositiveOrInf = math.inf
    search_m: NotNegativeOrNan = math.nan
    share: Share = 0.5
    count: Count = 3
    tries: Whole = 0
    rate_hz: Rate = 5
    limits_m: tuple[Positive, float] = (1.0, 2.0)
    place_m: tuple[float, float] | None = None
    gap_s: Positive | None = None
    on: bool = False
    kind: Kind = Kind.NONE
    name: str = ""


def test_everything_else_than_numbers_is_passed_over() -> None:
    assert Parameters(place_m=(-1.0, 1.0), on=True, kind=Kind.NONE, name="nan").reach_m == math.inf


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"time_s": 0.0}, "time_s 0 is not possible; ask for more than 0"),
        ({"time_s": math.nan}, "time_s nan is not possible"),
        ({"count": 0}, "count 0 is not possible; ask for 1 or more"),
        ({"count": 2.5}, "count 2.5 is not a whole number"),
        ({"rate_hz": 12.5}, "rate_hz 12.5 is not a whole number"),
        ({"tries": -1}, "tries -1 is not possible; ask for 0 or more"),
        ({"noise_m": -0.1}, "noise_m -0.1 is not possible; ask for 0 or more"),
        ({"noise_m": math.inf}, "noise_m inf is not possible"),
        ({"angle_rad": math.inf}, "angle_rad inf is not a finite number"),
        ({"reach_m": -math.inf}, "reach_m -inf is not possible"),
        ({"search_m": -1.0}, "search_m -1 is not possible"),
        ({"share": 1.5}, "share 1.5 is not in 0..1"),
        ({"limits_m": (1.0, -2.0)}, "limits_m -2 is not possible"),
        ({"place_m": (0.0, math.nan)}, "place_m nan is not a finite number"),
        ({"gap_s": 0.0}, "gap_s 0 is not possible"),
    ],
)
def test_what_is_refused(given: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Parameters(**given)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("check", "value", "accepted"),
    [
        (require_positive, 0.0, "a finite number above 0 is"),
        (require_not_negative, -0.1, "a finite number of at least 0 is"),
        (require_finite, math.nan, "a finite number is"),
        (require_probability, 1.1, "0 to 1 is"),
    ],
)
def test_arguments_are_named(check, value, accepted) -> None:
    with pytest.raises(ValueError, match=f"noise_m = .* is not accepted: {accepted}"):
        check(noise_m=value)
