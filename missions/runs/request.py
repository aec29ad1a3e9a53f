"""The request of a run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from autopilot_bridge.mavlink import SigningKey
from missions.vehicle.connection import GROUND_STATION
from missions.options import FlightOptions, MissionOptions
from missions.planning.limits import FORECAST_WIND_M_S
from missions.vehicle.adapter import Mode

if TYPE_CHECKING:
    from missions.preflight.before_flight import Confirm

REGAIN_S: Final = 60.0
"""Longest time for which a lost link may stay lost, s."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRequest:
    """All settings of a run except the mission itself.

    Attributes:
        options: options of the mission.
        connect: connection strings, one per vehicle; empty: the vehicles are embedded (SITL).
        system_ids: system ids of the vehicles, one per connection; empty: the first vehicle received on each
            connection.
        autopilot, seed, speedup, wind_speed_m_s, wind_from_deg, wind_profile, turbulence, gps, home: settings
            of the embedded SITL.
        model: its vehicle model: one for all vehicles of a team, or one for each.
        launch: launch method of its aircraft: "runway", "catapult", "hand"; None: the method in the
            aircraft's description.
        expected_wind_m_s: forecast wind that turns are planned for; None: 5 m/s. The wind of an embedded SITL
            is not used: a mission plans in the same way for embedded and for other vehicles.
        parameters: autopilot parameters to set before the flight.
        out: run folder; None: the next `runs/<mission>-<n>`.
        picture: whether to draw `track.png`.
        identity: MAVLink system and component id that the mission sends with.
        on_failure: action that is commanded when the mission fails or is interrupted.
        max_error_m: the run counts as failed when the path error exceeds it; None: no check.
        estimator: estimator that runs during the flight: its name, or the path of a user's file; None: no
            estimator.
        estimator_settings: its parameters as NAME=VALUE.
        confirm: coroutine function that receives the findings about the vehicles before they fly and returns
            whether to continue; None: the vehicles are not checked.
        on_open: called once the links or the world are open.
        regain_s: longest time for which a lost link may stay lost before the mission fails, in seconds of
            this machine's clock.
        command: the command line, for the summary.
        signing_key: signing key, shared with vehicles that are not embedded; None: no signing.
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
