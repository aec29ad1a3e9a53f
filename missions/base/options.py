"""Options of a flight. They are data: what suits a vehicle, and what it can fly, is decided elsewhere."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum
from types import MappingProxyType
from typing import Any, Final, Self

from flightsim.foundation.geodetic_position import GeodeticPosition
from flightsim.foundation.options import OptionError, Options, option, other_default
from missions.errors import PlanError

MAX_VEHICLES: Final = 250
"""Largest team."""
MAX_SEARCH_TIME_S: Final = 24 * 3600.0
_MIN_SIDE_M: Final = 1.0
_MAX_PHASE_RAD: Final = math.radians(3600.0) + 1e-9
_WINGS: Final = "aircraft: {}"


class Via(StrEnum):
    """The way in which a pattern is commanded."""

    WAYPOINTS = "waypoints"
    SETPOINTS = "setpoints"


class PlanOptions(Options):
    """Base of what users give to plan a flight: an impossible value is a PlanError that names the field in
    backquotes, in the unit in which users give it.
    """

    __slots__ = ()

    def __post_init__(self) -> None:
        try:
            Options.__post_init__(self)
        except OptionError as error:
            raise PlanError(f"`{error.field}` {error.reason_for_users}") from error


@dataclass(frozen=True, slots=True, kw_only=True)
class SeedOptions(PlanOptions):
    """What all that draws random numbers has."""

    seed: int = option(0, least=0, help="Seed of the random numbers: one seed makes one result.")


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionOptions(PlanOptions):
    """Options that every mission has, such as the number of vehicles and the altitude. Each mission derives
    its own class.

    Attributes:
        vehicles, index: size of the team, and the number of this vehicle in it from 0.
        centre: centre of the mission; None: the vehicle's home.
        arguments: further arguments that the user gave to their own mission, by name.
        given: names of the fields that the user specified; None: the fields that differ from their default. A
            mission may give the other fields values that suit the vehicle (`Mission.adapted`).
    """

    altitude_m: float = option(10.0, help="Height above home.")
    vehicles: int = option(1, least=1, most=MAX_VEHICLES)
    index: int = 0
    separation_m: float = option(4.0, above=0.0, help="Distance between the altitudes of a team.")
    centre: GeodeticPosition | None = None
    rate_hz: float = option(25.0, least=2.5, most=100.0, help="Setpoints per second of vehicle time.")
    arguments: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    allow_below_home: bool = option(
        False, help="Heights below home may be commanded: where the ground is lower."
    )
    given: frozenset[str] | None = None

    @property
    def own_altitude_m(self) -> float:
        """This vehicle's altitude: a team flies in layers, the first at `altitude_m`."""
        return self.altitude_m + self.index * self.separation_m

    def chosen(self, name: str) -> bool:
        """Whether the user specified a field's value."""
        if self.given is not None:
            return name in self.given
        default = next(f.default for f in fields(self) if f.name == name)
        return getattr(self, name) != default

    def unless_chosen(self, **values: float | str) -> Self:
        """The same options, with new values for fields that were not specified; `given` then names the
        specified ones.
        """
        given = frozenset(f.name for f in fields(self) if f.name != "given" and self.chosen(f.name))
        changes: dict[str, Any] = {name: v for name, v in values.items() if name not in given}
        return replace(self, given=given, **changes)

    def unless_none(self, **values: float) -> Self:
        """The same options, with values for fields that are None."""
        changes: dict[str, Any] = {name: v for name, v in values.items() if getattr(self, name) is None}
        return replace(self, **changes)


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightOptions(MissionOptions):
    """One vehicle's flight of a pattern, in the units that missions compute with. Each mission uses the
    fields that apply to it.
    """

    altitude_m: float = other_default(10.0, varies=_WINGS.format(100))
    separation_m: float = other_default(4.0, varies=_WINGS.format(20))
    pattern: str = option(
        "L3", help="Lissajous pattern: L1 (circle), L2, L3, L4.", varies=_WINGS.format("L2")
    )
    width_m: float = option(
        100.0,
        name="size",
        metavar="SIDE|WIDTHxHEIGHT",
        separators="x,",
        lone="same",
        varies=_WINGS.format("1000 or more, as its turns need"),
        help="Size of the pattern, m, east x north.",
    )
    height_m: float = option(100.0, name="size", help="Size of the pattern, m, north.")
    ratio: tuple[float, float] | None = option(
        None,
        above=0.0,
        metavar="X:Y",
        separators=":/,",
        lone=1.0,
        replaces=("pattern",),
        help="Frequencies of a Lissajous pattern of your own, such as 3:4 or 1.4.",
    )
    phase_x_rad: float | None = option(
        None,
        least=-_MAX_PHASE_RAD,
        most=_MAX_PHASE_RAD,
        name="phase",
        metavar="X,Y",
        lone=0.0,
        help="Phases of x and y, degrees, or their difference.",
    )
    phase_y_rad: float | None = option(
        None, least=-_MAX_PHASE_RAD, most=_MAX_PHASE_RAD, name="phase", help="Phase of y."
    )
    spacing_m: float = option(
        10.0, above=0.0, help="Track spacing.", varies=_WINGS.format("what its turns need")
    )
    heading_rad: float = option(0.0, help="Direction of the first leg.")
    speed_m_s: float = option(
        5.0,
        least=0.1,
        most=150.0,
        varies=_WINGS.format("its own"),
        help="Ground speed; of an aircraft, airspeed.",
    )
    period_s: float | None = option(
        None,
        above=0.0,
        replaces=("speed",),
        help="Time of one lap in the pattern's own time law, in place of `speed_m_s`.",
    )
    periods: float = option(1.0, above=0.0, most=1000.0, help="Number of laps or passes.")
    search_time_s: float | None = option(
        None,
        above=0.0,
        most=MAX_SEARCH_TIME_S,
        replaces=("periods",),
        varies="with `search`: 1800",
        help="Time for which the pattern is repeated, in place of `periods`.",
    )
    via: Via = option(
        Via.WAYPOINTS,
        varies=_WINGS.format("setpoints, which follow the curve more closely"),
        help="Way of commanding: an uploaded mission, or streamed setpoints.",
    )
    acceptance_m: float = option(
        2.0,
        least=0.1,
        most=1000.0,
        varies=_WINGS.format("by its speed"),
        help="Radius within which a waypoint is reached, and of rounded corners.",
    )
    search: bool = option(
        False, help="Flight until the camera has detected a tag; `search_time_s` is the limit."
    )
    tag_id: int = option(
        0, least=0, most=254, help="Number of the tag (AprilTag 36h11) that `search` looks for."
    )

    def check_together(self) -> None:
        for name, side_m in (("width_m", self.width_m), ("height_m", self.height_m)):
            if 0.0 < side_m < _MIN_SIDE_M:
                raise PlanError(
                    f"`{name}` {side_m:g} m is too small to be flown; ask for {_MIN_SIDE_M:g} m or more"
                )
        if self.period_s is not None and self.via is not Via.SETPOINTS:
            raise PlanError("`period_s` needs `via=setpoints`: waypoints are flown at a speed, not at times")
