"""The request of a run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from autopilot_bridge.mavlink import SigningKey
from autopilot_bridge.mavlink.components import GROUND_STATION
from missions.base.options import FlightOptions, MissionOptions
from missions.base.run_options import RunOptions
from missions.errors import PlanError
from missions.vehicle.limits import FORECAST_WIND_M_S
from missions.view.viewer import Viewer

if TYPE_CHECKING:
    from autopilot_bridge.firmware_process.build import FirmwareBuild
    from flightsim.world_spec import WorldSpec
    from missions.preflight.before_flight import Confirm


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRequest(RunOptions):
    """All settings of a run except the mission itself.

    Attributes:
        options: options of the mission.
        connect: connection strings, one per vehicle; empty: the vehicles are embedded (SITL).
        world: the embedded world; None: quadrotors with PX4 in still air, one per vehicle of the options.
            Missions and estimators can't reach it. With `connect` only its magnetic target is used, as the
            place that a result is compared with.
        firmware: the real firmware that flies the vehicles of the embedded world, which name it as their
            autopilot; None: the emulated autopilots.
        parameters: autopilot parameters to set before the flight.
        strict_parameters: a parameter that a vehicle at `connect` does not have ends the run; otherwise it is
            left out. An embedded vehicle must have all of them.
        left_out_parameters: names that were left out of `parameters` already, for the summary.
        out: run folder; None: the next `runs/<mission>-<n>`.
        picture: whether to draw `track.png`.
        identity: MAVLink system and component id that the mission sends with.
        estimator: estimator that runs during the flight: its name, or the path of a user's file; None: no
            estimator.
        estimator_settings: its parameters as NAME=VALUE.
        confirm: coroutine function that receives the findings about the vehicles before they fly and returns
            whether to continue; None: the vehicles are not checked.
        confirm_simulations: whether vehicles that prove to be simulations are checked and confirmed, too.
        on_open: called once the links or the world are open.
        on_remark: receives what a user should know before the flight, one sentence each.
        command: the command line, for the summary.
        view: an open viewer (`missions.view.opening.open_viewer`) that shows the flight, while it is flown
            or, for a file, when it is over; the caller closes it. None: no viewer.
        signing_key: signing key, shared with vehicles that are not embedded; None: no signing.
    """

    options: MissionOptions = field(default_factory=FlightOptions)
    connect: Sequence[str] = ()
    world: "WorldSpec | None" = None
    firmware: "FirmwareBuild | None" = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    strict_parameters: bool = True
    left_out_parameters: Sequence[str] = ()
    out: Path | None = None
    picture: bool = True
    identity: tuple[int, int] = GROUND_STATION
    estimator: str | None = None
    estimator_settings: Sequence[str] = ()
    confirm: "Confirm | None" = None
    confirm_simulations: bool = True
    on_open: Callable[[], object] = lambda: None
    on_remark: Callable[[str], object] = lambda _text: None
    command: str = ""
    view: Viewer | None = None
    signing_key: SigningKey | None = None

    @property
    def embedded_world(self) -> "WorldSpec":
        """The embedded world, its autopilots with the parameters to set.

        Raises:
            PlanError: it has another number of vehicles than the options.
        """
        from flightsim.world_spec import WorldSpec  # a connected flight does without

        world = WorldSpec.of_team(self.options.vehicles) if self.world is None else self.world
        count = len(world.vehicles)
        if count != self.options.vehicles:
            raise PlanError(f"the world has {count} vehicles, and `vehicles` is {self.options.vehicles}")
        if not self.parameters:
            return world
        vehicles = tuple(
            replace(vehicle, parameters={**vehicle.parameters, **self.parameters})
            for vehicle in world.vehicles
        )
        return replace(world, vehicles=vehicles)

    @property
    def planning_wind_m_s(self) -> float:
        """Wind that turns are planned for."""
        return FORECAST_WIND_M_S if self.forecast_wind_m_s is None else self.forecast_wind_m_s
