"""The mission `orbit`: the aircraft circles a target without GPS, by roll commands only."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from missions.base.mission import Debriefing, Mission, WorldDefaults, verdict_of_all
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.orbit.checks import check_vehicle
from missions.orbit.options import WANDERING_M, OrbitOptions
from missions.orbit.score import ORBIT
from missions.vehicle.limits import FixedWingLimits, Limits
from missions.vehicle.notes import FlightNotes
from missions.vehicle.sensors import CAMERA, GIMBAL, Sensor
from missions.vehicle.vehicle import Vehicle

RADIUS_SHARE: Final = 0.1
"""Bound of the mean radius's error and of its standard deviation, as a share of the radius."""
ALTITUDE_BOUND_M: Final = 20.0
_DURATION_SHARE: Final = 0.95


def orbit_verdict(notes: FlightNotes) -> str:
    """The reason why the orbit was not flown, by the mission's measurements in flight; "" if it was flown."""
    options, marks, phase = notes.options, notes.marks, notes.phase(ORBIT)
    if not isinstance(options, OrbitOptions):
        return ""
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
        for name in options.arguments:
            raise PlanError(f"`arguments` {name}: {self.name} takes none; they are for missions of your own")
        check_vehicle(options, limits)

    def estimator_settings(self, options: OrbitOptions) -> Mapping[str, float | str]:
        north_m, east_m = options.target_ne_m
        return {
            "target_north_m": north_m,
            "target_east_m": east_m,
            "target_speed_m_s": 0.0 if options.target_wanders else options.target_speed_m_s,
            "target_heading_rad": options.target_heading_rad,
            "target_ground_m": options.target_ground_m,
            **({"target_sigma_m": WANDERING_M} if options.target_wanders else {}),
        }

    def sensors(self, options: OrbitOptions) -> Sequence[Sensor]:
        return CAMERA, GIMBAL

    async def fly(self, vehicle: Vehicle, options: OrbitOptions) -> None:
        from missions.orbit.flight import OrbitFlight

        limits = await vehicle.limits(options.own_altitude_m)
        check_vehicle(options, limits)
        assert isinstance(limits, FixedWingLimits)
        await OrbitFlight(vehicle, options, limits).fly()

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        return verdict_of_all(debriefing, lambda notes, _score: orbit_verdict(notes))

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        from missions.orbit.score import orbit_figures

        return orbit_figures(debriefing)

    def report_lines(self, summary: Mapping[str, Any]) -> Sequence[str]:
        if summary.get("orbit_s") is None:
            return ()
        circle = f"orbit of {summary['radius_m']:g} m for {summary['orbit_s']:.0f} s"
        if summary.get("orbit_not_received_s"):
            circle += f" ({summary['orbit_not_received_s']:.0f} s of it not received)"
        if summary["radius_mean_error_percent"] is not None:
            return (
                f"{circle}: mean radius {summary['radius_mean_error_percent']:+.2f} %, standard deviation "
                f"{summary['radius_std_m']:.1f} m, altitude within {summary['altitude_error_m']:.1f} m",
            )
        return (
            f"{circle}, as the mission estimates: mean radius {summary['radius_estimate_mean_m']:.1f} m, "
            f"standard deviation {summary['radius_estimate_std_m']:.1f} m, altitude by pressure within "
            f"{summary['altitude_estimate_error_m']:.1f} m; target lost {summary['target_losses']} times, "
            f"{summary['detections_used']} detections used",
            "a vehicle outside the simulation does not report where aircraft and target truly were",
        )

    def title(self, options: OrbitOptions) -> str:
        way = "clockwise" if options.direction > 0 else "counter-clockwise"
        moving = f", target at {options.target_speed_m_s:g} m/s" if options.target_speed_m_s else ""
        return f"GPS-denied orbit, {options.radius_m:g} m {way}{moving}"

    def draw(self, path: Path, title: str, debriefing: Debriefing) -> None:
        from missions.orbit.picture import draw_orbit

        draw_orbit(path, title, debriefing)
