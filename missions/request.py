"""What a run is asked for."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from autopilot_bridge.mavlink import SigningKey
from missions.connection import GROUND_STATION
from missions.options import FlightOptions, MissionOptions
from missions.planning.limits import FORECAST_WIND_M_S
from missions.vehicle.adapter import Mode

if TYPE_CHECKING:
    from missions.preflight.before_flight import Confirm

REGAIN_S: Final = 60.0
"""How long a lost link may take to come back."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRequest:
    """Everything about a run but the mission itself.

    Attributes:
        options: what the mission is to do.
        connect: connection strings, one per vehicle; empty: an embedded SITL.
        system_ids: of the vehicles, one per connection; empty: the first heard on each.
        autopilot, seed, speedup, wind_speed_m_s, wind_from_deg, wind_profile, turbulence, gps, home: of the
            embedded SITL.
        model: its vehicle: of all of a team, or one for each.
        launch: how its aircraft get into the air: "runway", "catapult", "hand"; None: as described with them.
        expected_wind_m_s: forecast, to plan turns for; None: 5 m/s. What blows in an embedded SITL is not
            looked at: a mission plans the same for vehicles there and elsewhere.
        parameters: autopilot parameters to set before the flight.
        out: run folder; None: the next `runs/<mission>-<n>`.
        picture: whether to draw `track.png`.
        identity: MAVLink system and component id of the mission.
        on_failure: what the vehicle is told when the mission fails or is interrupted.
        max_error_m: a check: the run has failed when the path error exceeds it; None: no check.
        estimator: one to run beside the flight: its name, or the path of a user's file; None: none.
        estimator_settings: its parameters as NAME=VALUE.
        confirm: shown what was found of the vehicles before they fly, says whether to go on (a coroutine
            function); None: they are not looked at.
        on_open: called once the links are open, or the world is.
        regain_s: how long a lost link may take to come back before the mission is given up, in seconds of
            this machine's clock.
        command: the command line, for the summary.
        signing_key: shared with vehicles elsewhere; None: unsigned.
    """

    options: MissionOptions = field(default_factory=FlightOptions)
    connect: Sequence[str] = ()
    system_ids: Sequence[int] = ()
    autopilot: str = "px4"
    model: str | Sequence[str] = "iris"
    launch: str | None = None
    seed: int = 0
    speedup: float | None = None
    wind_speed_m_s: float = 0.0
    wind_from_deg: float = 0.0
    wind_profile: str = "log"
    turbulence: str = "none"
    gps: str = "differential"
    expected_wind_m_s: float | None = None
    home: str | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    out: Path | None = None
    picture: bool = True
    identity: tuple[int, int] = GROUND_STATION
    on_failure: Mode = Mode.RETURN
    max_error_m: float | None = None
    estimator: str | None = None
    estimator_settings: Sequence[str] = ()
    confirm: "Confirm | None" = None
    on_open: Callable[[], object] = lambda: None
    regain_s: float = REGAIN_S
    command: str = ""
    signing_key: SigningKey | None = None

    @property
    def models(self) -> list[str]:
        """The model of each vehicle of the team."""
        if isinstance(self.model, str):
            return [self.model] * self.options.vehicles
        return list(self.model)

    @property
    def planning_wind_m_s(self) -> float:
        """Wind that turns are planned for."""
        return FORECAST_WIND_M_S if self.expected_wind_m_s is None else self.expected_wind_m_s
