"""Options of a flight."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from enum import StrEnum
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Self

from autopilot_bridge.parameter_files import read_untyped_parameter_file
from autopilot_bridge.parameters import ParameterError
from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import PlanError
from missions.planning.sizing import WINGS_SIDE_M, spacing_for_turns_m
from missions.vehicle.limits import Limits, MulticopterLimits

MAX_PERIODS: Final = 1000.0
MAX_SEARCH_TIME_S: Final = 24 * 3600.0
MIN_SPEED_M_S: Final = 0.1
MAX_SPEED_M_S: Final = 150.0
MIN_ACCEPTANCE_M: Final = 0.1
MAX_ACCEPTANCE_M: Final = 1000.0
MIN_SIDE_M: Final = 1.0
_SEPARATION_M: Final = 20.0  # of fixed wings
_LOWEST_LAYER_M: Final = 40.0
MAX_PHASE_RAD: Final = math.radians(3600.0) + 1e-9


class Via(StrEnum):
    """The way in which a pattern is commanded."""

    WAYPOINTS = "waypoints"
    SETPOINTS = "setpoints"


def check_positive(**options: float | None) -> None:
    """Refuse specified options that are not above 0; their names are those of the fields."""
    for name, value in options.items():
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise PlanError(f"`{name}` {value:g} is not possible; ask for more than 0")


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionOptions:
    """Options that every mission has, such as the number of vehicles and the altitude. Each mission derives
    its own class.

    Attributes:
        altitude_m: height above home.
        vehicles, index: size of the team, and the number of this vehicle in it from 0.
        separation_m: vertical distance between the vehicles of a team.
        centre: centre of the mission; None: the vehicle's home.
        rate_hz: setpoints per vehicle second.
        arguments: further arguments that the user gave to their own mission, by name.
        allow_below_home: heights below home may be commanded: where the ground is lower.
        given: names of the fields that the user specified; None: the fields that differ from their default. A
            mission may give the other fields values that suit the vehicle (`for_vehicle`).
    """

    altitude_m: float = 10.0
    vehicles: int = 1
    index: int = 0
    separation_m: float = 4.0
    centre: GeodeticPosition | None = None
    rate_hz: float = 25.0
    arguments: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    allow_below_home: bool = False
    given: frozenset[str] | None = None

    def __post_init__(self) -> None:
        check_positive(separation_m=self.separation_m)
        if not 2.5 <= self.rate_hz <= 100.0:
            raise PlanError(
                f"`rate_hz` {self.rate_hz:g} Hz is not in 2.5..100 Hz, what keeps a vehicle guided"
            )
        if not 1 <= self.vehicles <= 250:
            raise PlanError(f"`vehicles` {self.vehicles} is not in 1..250")

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

    def for_vehicle(self, limits: Limits) -> Self:
        """The same options as one vehicle flies them: options not specified get values that suit its kind."""
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightOptions(MissionOptions):
    """One vehicle's flight of a pattern, in the units that missions compute with. Each mission uses the
    fields that apply to it.

    Attributes:
        pattern: named Lissajous pattern, "L1".."L4"; not used when `ratio` is specified.
        width_m, height_m: size of the pattern, east and north.
        ratio: frequencies x:y of a Lissajous pattern.
        phase_x_rad, phase_y_rad: its phases; None: the phases of the named pattern, or pi/2 and 0 for a
            ratio.
        spacing_m: track spacing of sweeps and squares.
        heading_rad: direction of the first leg of the IAMSAR patterns.
        speed_m_s: ground speed; for a fixed wing: airspeed.
        period_s: time of one lap in a Lissajous pattern's own time law; it replaces the speed.
        periods: number of laps or passes.
        search_time_s: end the pattern after this time; it is repeated until then.
        via: uploaded waypoints or streamed setpoints.
        acceptance_m: radius within which a waypoint counts as reached; corners are rounded by the same
            distance.
        search: end the pattern when the camera has detected the tag `tag_id`; `search_time_s` is the limit of
            the search, counted from its altitude.
        tag_id: number of the tag, of the family 36h11.
    """

    pattern: str = "L3"
    width_m: float = 100.0
    height_m: float = 100.0
    ratio: tuple[float, float] | None = None
    phase_x_rad: float | None = None
    phase_y_rad: float | None = None
    spacing_m: float = 10.0
    heading_rad: float = 0.0
    speed_m_s: float = 5.0
    period_s: float | None = None
    periods: float = 1.0
    search_time_s: float | None = None
    via: Via = Via.WAYPOINTS
    acceptance_m: float = 2.0
    search: bool = False
    tag_id: int = 0

    def __post_init__(self) -> None:
        super(FlightOptions, self).__post_init__()
        check_positive(
            speed_m_s=self.speed_m_s,
            periods=self.periods,
            acceptance_m=self.acceptance_m,
            spacing_m=self.spacing_m,
            search_time_s=self.search_time_s,
            period_s=self.period_s,
        )
        for name, bounded, lowest, highest, unit in (
            ("periods", self.periods, 0.0, MAX_PERIODS, ""),
            ("search_time_s", self.search_time_s, 0.0, MAX_SEARCH_TIME_S, " s"),
            ("speed_m_s", self.speed_m_s, MIN_SPEED_M_S, MAX_SPEED_M_S, " m/s"),
            ("acceptance_m", self.acceptance_m, MIN_ACCEPTANCE_M, MAX_ACCEPTANCE_M, " m"),
        ):
            if bounded is not None and not lowest <= bounded <= highest:
                raise PlanError(f"`{name}` {bounded:g}{unit} is not in {lowest:g}..{highest:g}{unit}")
        for name, side_m in (("width_m", self.width_m), ("height_m", self.height_m)):
            if 0.0 < side_m < MIN_SIDE_M:
                raise PlanError(
                    f"`{name}` {side_m:g} m is too small to be flown; ask for {MIN_SIDE_M:g} m or more"
                )
        if self.ratio is not None and not min(self.ratio) > 0.0:
            raise PlanError(f"`ratio` {self.ratio[0]:g}:{self.ratio[1]:g} is not above 0, as in `ratio=3:4`")
        for name, phase_rad in (("phase_x_rad", self.phase_x_rad), ("phase_y_rad", self.phase_y_rad)):
            if phase_rad is not None and not abs(phase_rad) <= MAX_PHASE_RAD:
                raise PlanError(f"`{name}` {math.degrees(phase_rad):g} degrees is not in -3600..3600 degrees")
        if not math.isfinite(self.heading_rad):
            raise PlanError(f"`heading_rad` {self.heading_rad} is not a direction; give a finite angle")
        if not 0 <= self.tag_id <= 254:
            raise PlanError(f"`tag_id` {self.tag_id} is not in 0..254, what LANDING_TARGET can report")
        if self.period_s is not None and self.via is not Via.SETPOINTS:
            raise PlanError("`period_s` needs `via=setpoints`: waypoints are flown at a speed, not at times")

    def for_vehicle(self, limits: Limits) -> "FlightOptions":
        """Options that were not specified get larger, higher and faster values for a fixed wing than for a
        multicopter.
        """
        if isinstance(limits, MulticopterLimits):
            return self
        speed_m_s = self.speed_m_s if self.chosen("speed_m_s") else limits.airspeed_trim_m_s
        gaps = self.vehicles - 1
        room_m = limits.altitude_max_m - _LOWEST_LAYER_M
        separation_m = self.separation_m
        if not self.chosen("separation_m"):
            separation_m = min(_SEPARATION_M, room_m / max(1, gaps))
        return self.unless_chosen(
            pattern="L2" if self.ratio is None else self.pattern,
            via=Via.SETPOINTS,
            width_m=WINGS_SIDE_M,
            height_m=WINGS_SIDE_M,
            speed_m_s=speed_m_s,
            altitude_m=max(_LOWEST_LAYER_M, min(100.0, limits.altitude_max_m - gaps * separation_m)),
            spacing_m=spacing_for_turns_m(speed_m_s, limits),
            acceptance_m=min(30.0, max(10.0, speed_m_s)),
            separation_m=separation_m,
        )


def parse_wind(text: str) -> tuple[float, float]:
    """Wind from "SPEED" or "SPEED@FROM_DEG", for example "5@270": (m/s, degrees it comes from).

    Raises:
        PlanError: the text is not of this form, or the speed is out of 0..40 m/s.
    """
    speed_text, _, from_text = text.partition("@")
    try:
        speed_m_s, from_deg = float(speed_text), float(from_text or 0.0)
    except ValueError:
        raise PlanError(f"wind {text!r} is not SPEED or SPEED@FROM_DEG, for example 5@270") from None
    if not (0.0 <= speed_m_s <= 40.0 and math.isfinite(from_deg)):
        raise PlanError(f"wind {text!r}: the speed must be in 0..40 m/s, the direction a number of degrees")
    return speed_m_s, from_deg % 360.0


def parameters_from_file(path: str | Path) -> dict[str, float]:
    """Parameters from a file (`autopilot_bridge.parameter_files`); the vehicle checks names and ranges.

    Raises:
        PlanError: the file can't be read or parsed; the message names the line.
    """
    try:
        return read_untyped_parameter_file(Path(path))
    except ParameterError as error:
        raise PlanError(str(error)) from error
