"""The mission `orbit`: the aircraft circles a target without GPS, by roll commands only."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from estimators.scene_items import Item
from missions.base.flight import MissionFlight
from missions.base.mission import Mission, WorldDefaults
from missions.base.report import Debriefing, Report, verdict_of_all
from missions.kind import VehicleKind
from missions.orbit.checks import check_vehicle
from missions.orbit.flight import OrbitFlight
from missions.orbit.options import WANDERING_M, OrbitOptions
from missions.orbit.picture import draw_orbit
from missions.orbit.score import ORBIT, orbit_figures
from missions.vehicle.limits import FixedWingLimits, Limits
from missions.vehicle.notes import FlightNotes
from missions.vehicle.sensors import CAMERA, GIMBAL, Sensor
from missions.vehicle.vehicle import Vehicle

RADIUS_SHARE: Final = 0.1
"""Bound of the mean radius's error and of its standard deviation, as a share of the radius."""
ALTITUDE_BOUND_M: Final = 20.0
_DURATION_SHARE: Final = 0.95


def orbit_verdict(notes: FlightNotes, options: OrbitOptions) -> str:
    """The reason why the orbit was not flown, by the mission's measurements in flight; "" if it was flown."""
    marks, phase = notes.marks, notes.phase(ORBIT)
    if phase is None or "radius_estimate_mean_m" not in marks:
        return "the target was not orbited: the circle was never reached"
    flown_s = (phase.end_us - phase.start_us) * 1e-6
    if flown_s < _DURATION_SHARE * options.duration_s:
        return f"the target was orbited for {flown_s:.0f} s of {options.duration_s:g} s"
    mean_m, std_m = marks["radius_estimate_mean_m"], marks["radius_estimate_std_m"]
    bound_m = RADIUS_SHARE * options.radius_m
    if abs(mean_m - options.radius_m) > bound_m or std_m > bound_m:
        return (
            f"the target was not orbited at {options.radius_m:g} m: by the camera the radius was "
            f"{mean_m:.0f} m with a standard deviation of {std_m:.1f} m; accepted: {bound_m:g} m of each"
        )
    height_m = marks["altitude_estimate_error_m"]
    if height_m > ALTITUDE_BOUND_M:
        return (
            f"the orbit was up to {height_m:.1f} m from its altitude by pressure; accepted: "
            f"{ALTITUDE_BOUND_M:g} m"
        )
    return ""


class OrbitMission(Mission[OrbitOptions]):
    """`flightstack fly orbit`: Tolman et al. 2021, section IV."""

    name = "orbit"
    kinds = (VehicleKind.FIXED_WING,)
    world_defaults = WorldDefaults(model="aerosonde", wind="4", turbulence="light")

    def check(self, options: OrbitOptions, limits: Limits) -> None:
        self.refuse_arguments(options)
        check_vehicle(options, limits)

    def estimator_settings(self, options: OrbitOptions) -> Mapping[str, float | str]:
        north_m, east_m = options.target_ne_m
        return {
            "target_north_m": north_m,
            "target_east_m": east_m,
            "target_speed_m_s": 0.0 if options.target_wanders else options.estimator.target_speed_m_s,
            "target_heading_rad": options.estimator.target_heading_rad,
            "target_ground_m": options.estimator.target_ground_m,
            **({"target_sigma_m": WANDERING_M} if options.target_wanders else {}),
        }

    def sensors(self, options: OrbitOptions) -> Sequence[Sensor]:
        return CAMERA, GIMBAL

    def flight(self, vehicles: Sequence[Vehicle], options: Sequence[OrbitOptions]) -> "OrbitMissionFlight":
        return OrbitMissionFlight(vehicles, options)


class OrbitMissionFlight(MissionFlight[OrbitOptions]):
    """Orbits, one by each vehicle."""

    def __init__(self, vehicles: Sequence[Vehicle], options: Sequence[OrbitOptions]) -> None:
        super().__init__(vehicles, options)
        self._flights: dict[int, OrbitFlight] = {}

    def shown(self) -> Mapping[str, Item]:
        found: dict[str, Item] = {}
        for system_id, flight in self._flights.items():
            before = f"vehicle_{system_id}/" if len(self.vehicles) > 1 else ""
            found |= {before + name: item for name, item in flight.shown().items()}
        return found

    async def fly_one(self, index: int) -> None:
        vehicle, options = self.vehicles[index], self.options[index]
        limits = await vehicle.limits(options.own_altitude_m)
        check_vehicle(options, limits)
        assert isinstance(limits, FixedWingLimits)
        flight = self._flights[vehicle.system_id] = OrbitFlight(vehicle, options, limits)
        await flight.fly()

    def report(self, debriefing: Debriefing) -> Report:
        own = {
            vehicle.system_id: options for vehicle, options in zip(self.vehicles, self.options, strict=True)
        }
        figures = orbit_figures(debriefing, self.options[0])

        def draw(path: Path, title: str) -> None:

            draw_orbit(path, title, debriefing, self.options[0])

        return Report.of(
            debriefing,
            verdict=lambda: verdict_of_all(
                debriefing, lambda notes, _score: orbit_verdict(notes, own[notes.system_id])
            ),
            figures=figures,
            lines=lambda: orbit_lines(figures),
            title=_title(self.options[0]),
            draw=draw,
        )


def _title(options: OrbitOptions) -> str:
    way = "clockwise" if options.direction > 0 else "counter-clockwise"
    moving = (
        f", target at {options.estimator.target_speed_m_s:g} m/s"
        if options.estimator.target_speed_m_s
        else ""
    )
    return f"GPS-denied orbit, {options.radius_m:g} m {way}{moving}"


def orbit_lines(figures: Mapping[str, Any]) -> Sequence[str]:
    """Lines for the terminal."""
    if figures["orbit_s"] is None:
        return ()
    circle = f"orbit of {figures['radius_m']:g} m for {figures['orbit_s']:.0f} s"
    if figures["orbit_not_received_s"]:
        circle += f" ({figures['orbit_not_received_s']:.0f} s of it not received)"
    if figures["radius_mean_error_percent"] is not None:
        return (
            f"{circle}: mean radius {figures['radius_mean_error_percent']:+.2f} %, standard deviation "
            f"{figures['radius_std_m']:.1f} m, altitude within {figures['altitude_error_m']:.1f} m",
        )
    return (
        f"{circle}, as the mission estimates: mean radius {figures['radius_estimate_mean_m']:.1f} m, "
        f"standard deviation {figures['radius_estimate_std_m']:.1f} m, altitude by pressure within "
        f"{figures['altitude_estimate_error_m']:.1f} m; target lost {figures['target_losses']} times, "
        f"{figures['detections_used']} detections used",
        "a vehicle outside the simulation does not report where aircraft and target truly were",
    )
