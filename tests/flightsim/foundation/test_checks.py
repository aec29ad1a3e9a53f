"""Checks of parameters: which numbers are looked at, and what an error says."""

import math
from dataclasses import dataclass
from enum import IntEnum

import pytest

from flightsim.foundation.checks import (
    Finite,
    PositiveOrInf,
    check_amounts,
    check_fields,
    require_not_negative,
    require_positive,
)


class Kind(IntEnum):
    NONE = 0


@dataclass(frozen=True, kw_only=True)
class Parameters:
    time_s: float = 1.0
    noise_m: float = 0.0
    angle_rad: Finite = -1.0
    reach_m: PositiveOrInf = math.inf
    count: int = 3
    limits_m: tuple[float, float] = (1.0, 2.0)
    place_m: tuple[float, float] | None = None
    on: bool = False
    kind: Kind = Kind.NONE
    name: str = ""

    def __post_init__(self) -> None:
        check_fields(self, require_positive, but={"noise_m": require_not_negative}, unchecked=("place_m",))


def test_everything_else_than_numbers_is_passed_over() -> None:
    assert Parameters(place_m=(math.nan, -1.0)).reach_m == math.inf


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"time_s": 0.0}, "time_s = 0.0 is not accepted: a finite number above 0 is"),
        ({"time_s": math.nan}, "time_s = nan is not accepted"),
        ({"count": 0}, "count = 0 is not accepted"),
        ({"noise_m": -0.1}, "noise_m = -0.1 is not accepted: a finite number of at least 0 is"),
        ({"noise_m": math.inf}, "noise_m = inf is not accepted"),
        ({"angle_rad": math.inf}, "angle_rad = inf is not accepted: a finite number is"),
        ({"reach_m": -math.inf}, "reach_m = -inf is not accepted"),
        ({"limits_m": (1.0, -2.0)}, "limits_m = -2.0 is not accepted"),
    ],
)
def test_what_is_refused(given: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Parameters(**given)  # type: ignore[arg-type]


@dataclass(frozen=True, kw_only=True)
class Amounts:
    rate_hz: int = 5
    noise_m: float = 0.0
    time_constant_s: float = 1.0


@pytest.mark.parametrize("values", [{"noise_m": -0.1}, {"noise_m": math.nan}, {"time_constant_s": 0.0}])
def test_amounts_are_named_by_field(values: dict[str, float]) -> None:
    check_amounts(Amounts(rate_hz=-1), "time_constant_s")
    with pytest.raises(ValueError, match=f"{next(iter(values))} = .* is not accepted"):
        check_amounts(Amounts(**values), "time_constant_s")  # type: ignore[arg-type]
