"""What users set of every run: the vehicles, the embedded world, and how the flight is made."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Literal

from flightsim.foundation.options import option, other_default
from missions.base.options import MAX_VEHICLES, PlanOptions, SeedOptions
from missions.errors import PlanError

SLOWEST: Final = 0.001
"""Smallest simulated time per wall time."""
_FASTEST: Final = 1e6
_LAST_INSTANCE: Final = 200


class FailureAction(StrEnum):
    """What a vehicle is commanded after a failure."""

    RETURN = "return"
    LAND = "land"
    HOLD = "hold"


@dataclass(frozen=True, slots=True, kw_only=True)
class TeamOptions(PlanOptions):
    """How many vehicles fly.

    Attributes:
        vehicles: size of the team; None: one, or one for each link.
    """

    vehicles: int | None = option(
        None, least=1, most=MAX_VEHICLES, varies="1, or one per `connect`", help="Team size."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldOptions(SeedOptions):
    """What users set of the simulated world. A field that is None is the mission's, or that of a file.

    Attributes:
        model: models of the vehicles, several with commas: one for all, or one for each.
        autopilot: firmware whose ways the autopilots have.
        launch: how aircraft are launched; None: as described with the model.
        home: "lat,lon,alt[,heading]"; None: the place of the firmware's own SITL.
        wind: "SPEED[@FROM]", m/s at 10 m above ground and degrees.
        wind_profile: wind over height.
        turbulence: intensity.
        gps: receiver of the vehicles.
    """

    model: tuple[str, ...] = option(
        (),
        metavar="NAME|PATH",
        varies="iris, or an aircraft where the mission needs one",
        help="Model of the vehicle; one for all of a team, or one for each (repeat, or A,B,C).",
    )
    autopilot: Literal["px4", "ardupilot"] | None = option(
        None, varies="px4, or what a mission file is for", help="Firmware whose ways the autopilot has."
    )
    launch: Literal["runway", "catapult", "hand"] | None = option(
        None, varies="as described with the model", help="Launch of aircraft."
    )
    home: str | None = option(
        None,
        metavar="LAT,LON,ALT[,HEADING]",
        varies="where the firmware's own SITL stands",
        help="Place of the home.",
    )
    wind: str | None = option(
        None,
        metavar="SPEED[@FROM]",
        varies="0; orbit: 4, handoff: 3 from north; occupancy: 5 from west",
        help="Wind of the day, m/s at 10 m above ground, and degrees it comes from; turns are planned for "
        "it, unless `forecast_wind_m_s` says otherwise.",
    )
    wind_profile: Literal["log", "power", "uniform"] = option(
        "log",
        help="Wind over height: logarithmic over open ground, power law of 1/7, or the same everywhere.",
    )
    turbulence: Literal["none", "light", "moderate", "severe"] | None = option(
        None, varies="none; orbit, occupancy, handoff: light", help="Turbulence of the air."
    )
    gps: Literal["differential", "standalone"] | None = option(
        None,
        varies="differential",
        help="Receiver: decimetres with corrections, or metres that wander without.",
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ServedWorldOptions(WorldOptions):
    """What users set of simulated vehicles for external clients, which fly no mission.

    Attributes:
        count: number of vehicles; None: as many as models, or as a file has.
        instance: instance of the first vehicle, as the firmware's own SITL counts them.
        speedup: simulated time per wall time; 0: as fast as possible.
        duration_s: vehicle time after which it stops; None: never.
        unsigned: links on which unsigned frames are accepted while there is a key.
    """

    model: tuple[str, ...] = other_default((), varies="iris")
    autopilot: Literal["px4", "ardupilot"] | None = other_default(None, varies="px4")
    wind: str | None = other_default(None, varies="0")
    turbulence: Literal["none", "light", "moderate", "severe"] | None = other_default(None, varies="none")
    count: int | None = option(None, least=1, most=MAX_VEHICLES, varies="1", help="Number of vehicles.")
    instance: int = option(
        0,
        least=0,
        most=_LAST_INSTANCE,
        help="Instance of the first vehicle, by which the firmware's own SITL numbers its ports, and PX4 the "
        "system ids.",
    )
    speedup: float = option(
        1.0,
        least=0.0,
        most=_FASTEST,
        metavar="X",
        help="Simulated seconds per wall second; 0: as fast as possible.",
    )
    duration_s: float | None = option(None, least=0.0, help="Vehicle time after which it stops.")
    unsigned: Literal["none", "serial", "local", "all"] = option(
        "serial",
        help="Links that take unsigned frames while there is a key: none, serial ones, this machine's too, "
        "all.",
    )

    def check_together(self) -> None:
        if 0.0 < self.speedup < SLOWEST:
            raise PlanError(
                f"`speedup` {self.speedup:g} is slower than {SLOWEST:g}; 0 is as fast as possible"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions(PlanOptions):
    """What users set of a run.

    Attributes:
        system_ids: system ids of the vehicles, one per connection; empty: the first vehicle received on each
            connection.
        speedup: simulated seconds per wall second at most in the embedded world; None: no limit.
        forecast_wind_m_s: forecast wind that turns are planned for; None: 5 m/s. The wind of an embedded SITL
            is not used: a mission plans in the same way for embedded and for other vehicles.
        on_failure: action that is commanded when the mission fails or is interrupted.
        max_error_m: the run counts as failed when the path error exceeds it; None: no check.
        regain_s: longest time for which a lost link may stay lost before the mission fails, in seconds of
            this machine's clock.
        endurance_min: how long the battery of each vehicle lasts in flight, by the user; None: as the vehicle
            reports, or by the model of an embedded multicopter.
    """

    system_ids: tuple[int, ...] = option(
        (),
        least=1,
        most=255,
        name="system-id",
        metavar="ID",
        varies="the first",
        help="System id, where several vehicles are on a link; one for each `connect`.",
    )
    speedup: float | None = option(
        None,
        least=SLOWEST,
        most=_FASTEST,
        metavar="X",
        varies="no limit",
        help="Simulated seconds per wall second at most.",
    )
    forecast_wind_m_s: float | None = option(
        None,
        least=0.0,
        name="expect-wind",
        varies="`wind` where it is given, as it is at 100 m or the mission's altitude, else 5",
        help="Forecast: wind to plan turns for, at the height of the flight.",
    )
    on_failure: FailureAction = option(
        FailureAction.RETURN, help="Command to the vehicle after a failure, or on Ctrl-C, SIGTERM, SIGHUP."
    )
    regain_s: float = option(60.0, least=0.0, most=86_400.0, help="Time in which a lost link may come back.")
    max_error_m: float | None = option(
        None, above=0.0, help="Path error anywhere in a pattern above which the flight fails."
    )
    endurance_min: float | None = option(
        None,
        above=0.0,
        most=6000.0,
        name="endurance",
        unit="min",
        varies="as the vehicle reports it",
        help="Time that the battery lasts in flight: a longer mission is named before the takeoff, and "
        "refused on a vehicle that may be real.",
    )
