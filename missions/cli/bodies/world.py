"""The world from the command line: a file, the options that override it, or the options alone."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from autopilot_bridge.firmware_process.build import FirmwareBuild
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.payload import GaussianSignature, GroundTargetParameters, MagneticSpec
from flightsim.wind_profile import WindLaw, WindProfile
from flightsim.world_spec import VehicleSpec, WorldSpec, launched
from missions.base.given_text import parse_wind
from missions.base.mission import WorldDefaults
from missions.base.run_options import WorldOptions
from missions.cli.declared_options import Given
from missions.worlds.motion_kind import MotionKind
from missions.worlds.motions import motion_of
from missions.worlds.payloads import CAMERA, MAGNETOMETER, carrying

_USUAL: Final = VehicleSpec()


def models_of(given: tuple[str, ...]) -> list[str]:
    """Models from options that are repeated or have commas.

    Raises:
        ValueError: a place between commas is empty.
    """
    models = [name.strip() for text in given for name in text.split(",")]
    if not all(models):
        raise ValueError(
            f"--model {','.join(given)!r} has a place without a name; give NAME, or NAME,NAME,... for a team"
        )
    return models


def firmware_of(given: Given) -> FirmwareBuild | None:
    """The real firmware that the option `firmware` names; None: the emulated autopilots.

    Raises:
        ValueError: it names none.
    """
    if given["firmware"] is None:
        return None
    return FirmwareBuild.parse(given["firmware"])


def world_of(
    options: WorldOptions,
    chosen: frozenset[str],
    *,
    file: Path | None,
    firmware: FirmwareBuild | None,
    count: int | None,
    defaults: WorldDefaults,
) -> WorldSpec:
    """The world of `fly` or `sitl`.

    Args:
        options: the options.
        chosen: names of those that the user specified.
        file: description of the world, which they override; None: none.
        firmware: real firmware that flies the vehicles; None: the emulated autopilots.
        count: number of vehicles that the user specified; None: as many as models, or as the file has.
        defaults: values where neither an option nor a file gives one.

    Raises:
        ValueError: a value is not accepted.
    """
    autopilot: str | None = options.autopilot
    if firmware is not None:
        if autopilot is not None and autopilot != firmware.firmware:
            raise ValueError(f"--autopilot {autopilot} and --firmware {firmware}: leave one of them out")
        autopilot = firmware.firmware
    models = models_of(options.model)
    home = options.home
    described = None if file is None else WorldSpec.load(file)
    if described is None:
        chosen = chosen | {"seed", "wind", "wind_profile", "turbulence"}
    if described is None or described.home is None:
        home = home or defaults.home
    fields: dict[str, Any] = {}
    if home is not None:
        fields["home"] = Home.parse(home)
    if "seed" in chosen:
        fields["seed"] = options.seed
    if chosen & {"wind", "wind_profile", "turbulence"}:
        fields["air"] = _air(options, chosen, described, defaults)
    if described is None or described.vehicles == (VehicleSpec(),):  # the file lists no vehicles
        models = models or [defaults.model]
        team = WorldSpec.of_team(
            count,
            model=models[0] if len(models) == 1 else models,
            autopilot=autopilot or defaults.autopilot or _USUAL.autopilot,
            launch=options.launch,
            gps=options.gps or _USUAL.gps,
            home=fields.get("home", None if described is None else described.home),
        )
        return replace(described or team, vehicles=team.vehicles, **fields)
    world = replace(described, **fields)
    if count is not None and count != len(world.vehicles):
        raise ValueError(
            f"{file} has {len(world.vehicles)} vehicles; accepted with it: {len(world.vehicles)}"
        )
    given = {name: value for name, value in (("autopilot", autopilot), ("gps", options.gps)) if value}
    return replace(world, vehicles=_overridden(world.vehicles, given, options.launch, models))


def _air(
    options: WorldOptions, chosen: frozenset[str], file: WorldSpec | None, defaults: WorldDefaults
) -> Any:
    """The air with the options' values; what no option gives is the file's."""
    before = Environment() if file is None else file.air
    speed_m_s, from_deg = before.wind_speed_m_s, before.wind_from_deg
    if "wind" in chosen:
        speed_m_s, from_deg = parse_wind(defaults.wind if options.wind is None else options.wind)
    law = WindLaw(options.wind_profile)
    stated = file is not None and "wind_profile" not in chosen
    return Environment.from_wind(
        speed_m_s=speed_m_s,
        from_deg=from_deg,
        profile=before.profile if stated else WindProfile(law=law),
        turbulence=(options.turbulence or defaults.turbulence)
        if "turbulence" in chosen
        else before.turbulence,
        gusts=before.gusts,
        temperature_offset_k=before.temperature_offset_k,
        decimal_year=before.decimal_year,
    )


def _overridden(
    vehicles: Sequence[VehicleSpec], given: Mapping[str, Any], launch: str | None, models: Sequence[str]
) -> tuple[VehicleSpec, ...]:
    """The vehicles of a file with the values of options."""
    if models:
        count = len(vehicles)
        if len(models) not in (1, count):
            raise ValueError(f"{len(models)} models for {count} vehicles; accepted: one for all, or {count}")
        each = [models[0]] * count if len(models) == 1 else models
        vehicles = [replace(v, model=model) for v, model in zip(vehicles, each, strict=True)]
    vehicles = [replace(vehicle, **given) for vehicle in vehicles]
    return tuple(vehicles) if launch is None else launched(vehicles, launch)


def equipped(
    world: WorldSpec, camera: bool, targets: tuple[str, ...], map_file: str | None, map_target: str | None
) -> WorldSpec:
    """The world of `sitl` with the payload and the targets of its options.

    Raises:
        ValueError: a target is impossible, or the vehicles carry nothing that can detect it.
    """
    if camera:
        world = carrying(world, CAMERA)
    if targets and not any(vehicle.payload.camera for vehicle in world.vehicles):
        raise ValueError("--target is seen by cameras only; add --camera")
    if map_target is not None and map_file is None:
        raise ValueError("--map-target needs a --map to be in")
    if targets:
        world = replace(world, targets=tuple(_target(text, tag) for tag, text in enumerate(targets)))
    if map_file is None:
        return world
    signatures: tuple[GaussianSignature, ...] = ()
    if map_target is not None:
        north_m, east_m = _numbers(map_target, "--map-target", (2,))
        signatures = (
            GaussianSignature(north_m=north_m, east_m=east_m, sigma_along_m=80.0, sigma_across_m=60.0),
        )
    field: MagneticSpec = MagneticSpec(map_file=Path(map_file), signatures=signatures)
    return replace(carrying(world, MAGNETOMETER), magnetic_field=field)


def _target(text: str, tag: int) -> GroundTargetParameters:
    numbers = _numbers(text, "--target", (2, 4))
    speed_m_s, heading_deg = numbers[2:] or (0.0, 0.0)
    motion = motion_of(
        MotionKind.STRAIGHT if speed_m_s else MotionKind.STATIC,
        place_ne_m=(numbers[0], numbers[1]),
        speed_m_s=speed_m_s,
        course_rad=math.radians(heading_deg),
    )
    return GroundTargetParameters(motion=motion, tag_id=tag)


def _numbers(text: str, option: str, counts: tuple[int, ...]) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts or not all(math.isfinite(number) for number in numbers):
        accepted = " or ".join(str(count) for count in counts)
        raise ValueError(f"{option} {text!r} is not {accepted} numbers with commas, for example 500,300")
    return numbers
