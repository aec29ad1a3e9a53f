"""Fields that declare themselves: the check of the constructor, and what users see."""

import math
import subprocess
import sys
from dataclasses import MISSING, dataclass, fields
from enum import StrEnum

import pytest

from flightsim.foundation.options import (
    OptionError,
    Options,
    Shown,
    declared,
    held,
    name_for_users,
    option,
    unit_of,
)
from flightsim.foundation.user_options import user_options


class Shape(StrEnum):
    ROUND = "round"
    FLAT = "flat"


@dataclass(frozen=True, slots=True, kw_only=True)
class Filter(Options):
    yaw_sigma_rad: float = option(math.radians(0.6), least=0.0, help="Standard deviation of the yaw.")
    place_m: tuple[float, float] = option((0.0, 0.0), help="Place of the filter.", metavar="NORTH,EAST")
    reach_m: float = option(math.inf, above=0.0, infinite=True, help="Range of the sensor.")
    share: float | None = option(None, least=0.0, most=1.0, help="Share of the particles.", varies="half")
    count: int = option(3, least=1, most=9)
    shape: Shape = option(Shape.ROUND, help="Shape of the kernel.")
    label: str = "plain"

    def check_together(self) -> None:
        if self.count == 7 and self.shape is Shape.FLAT:
            raise ValueError("count 7 does not go with shape flat")


@dataclass(frozen=True, slots=True, kw_only=True)
class Wider(Filter):
    limit_deg: float = option(4.0, above=0.0, below=90.0)

    def check_together(self) -> None:
        if self.label == "narrow":
            raise ValueError("label narrow is not wide")


@dataclass(frozen=True, slots=True, kw_only=True)
class Search(Options):
    width_m: float = option(20.0, name="size", help="Size of the area.", separators="x,", lone="same")
    altitude_m: float = option(60.0, above=0.0, help="Height above home.", varies="aircraft: 90")
    height_m: float = option(10.0, name="size", help="Size of the area.")
    filter: Filter = held(
        Filter(yaw_sigma_rad=0.02), yaw_sigma="yaw_sigma_rad", spread=Shown(fields=("share",), help="Spread.")
    )


@pytest.mark.parametrize(
    ("given", "reason", "for_users"),
    [
        (
            {"yaw_sigma_rad": -0.1},
            "-0.1 is not possible; ask for 0 or more",
            "-5.72958 is not possible; ask for",
        ),
        ({"yaw_sigma_rad": math.nan}, "nan is not possible; ask for 0 or more", "nan is not"),
        ({"yaw_sigma_rad": math.inf}, "inf is not possible", "inf is not"),
        ({"place_m": (1.0, math.inf)}, "inf is not a finite number", "inf is not a finite number"),
        (
            {"reach_m": 0.0},
            "0 is not possible; ask for more than 0",
            "0 is not possible; ask for more than 0",
        ),
        ({"share": 1.5}, "1.5 is not in 0..1", "1.5 is not in 0..1"),
        ({"count": 10}, "10 is not in 1..9", "10 is not in 1..9"),
        ({"shape": "oval"}, "'oval' is not one of round, flat", "'oval' is not one of round, flat"),
        (
            {"limit_deg": 90.0},
            "90 is not possible; ask for more than 0, less than 90",
            "less than 90 degrees",
        ),
    ],
)
def test_what_is_refused(given, reason, for_users):
    with pytest.raises(OptionError) as refused:
        Wider(**given)
    assert refused.value.field == next(iter(given))
    assert reason in refused.value.reason
    assert for_users in refused.value.reason_for_users
    assert str(refused.value) == f"{refused.value.field} {refused.value.reason}"


def test_what_is_accepted():
    assert Filter(shape="flat").shape is Shape.FLAT
    assert Filter(reach_m=math.inf, share=None, yaw_sigma_rad=0).count == 3


@pytest.mark.parametrize(
    ("given", "reason"), [({"count": 7, "shape": "flat"}, "count 7"), ({"label": "narrow"}, "label narrow")]
)
def test_each_class_of_the_line_checks_its_own_rules(given, reason):
    with pytest.raises(ValueError, match=reason):
        Wider(**given)


def test_users_see_each_option_once_with_its_unit_and_default():
    seen = {each.name: each for each in user_options(Search)}
    assert list(seen) == ["size", "altitude", "yaw-sigma", "spread"]
    assert seen["size"].default == (20.0, 10.0)
    assert [each.name for each in seen["size"].fields] == ["width_m", "height_m"]
    assert seen["altitude"].option.varies == "aircraft: 90"
    yaw = seen["yaw-sigma"]
    assert (yaw.path, yaw.default, yaw.declared.unit) == ("filter", 0.02, "degrees")
    assert yaw.declared.for_users(yaw.default) == pytest.approx(1.14592, abs=1e-5)
    assert (seen["spread"].option.help, seen["spread"].option.varies) == ("Spread.", "half")


def test_defaults_are_those_of_the_dataclass():
    for each, of in zip(declared(Wider), fields(Wider), strict=True):
        assert of.default is not MISSING
        assert (each.name, each.default) == (of.name, getattr(Wider(), of.name))


@pytest.mark.parametrize(
    ("name", "unit", "shown"),
    [
        ("yaw_sigma_rad", "degrees", "yaw-sigma"),
        ("speed_m_s", "m/s", "speed"),
        ("acceleration_m_s2", "m/s2", "acceleration"),
        ("walk_m_sqrt_s", "", "walk-m-sqrt-s"),
        ("gain_1_s", "", "gain-1-s"),
        ("start_ne_m", "m", "start"),
        ("moment_a_m2", "A m2", "moment"),
        ("count", "", "count"),
        ("m", "", "m"),
    ],
)
def test_units_and_names_come_from_the_field(name, unit, shown):
    assert unit_of(name) == unit
    assert name_for_users(name) == shown


def test_declaring_options_loads_nothing_heavy():
    heavy = {"numpy", "numba", "click", "cattrs"}
    code = f"import sys, flightsim.foundation.options; print({heavy} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
