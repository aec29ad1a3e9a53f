"""The world from the command line: a file, the options that override it, or the options alone."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from autopilot_bridge.firmware_process.build import FirmwareBuild
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.payload import GaussianSignature, GroundTargetParameters, MagneticSpec
from flightsim.wind_profile import WindLaw, WindProfile
from flightsim.world_spec import VehicleSpec, WorldSpec, launched
from missions.base.given_text import parse_wind
from missions.base.mission import WorldDefaults
from missions.cli.declared_options import Given
from missions.worlds.motion_kind import MotionKind
from missions.worlds.motions import motion_of
from missions.worlds.payloads import CAMERA, MAGNETOMETER, carrying


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
    given: Given, chosen: frozenset[str], *, count: int | None, defaults: WorldDefaults
) -> WorldSpec:
    """The world of `fly` or `sitl`.

    Args:
        given: values of the options `world`, `model`, `autopilot`, `firmware`, `launch`, `gps`, `home`,
            `seed`, `wind`, `wind_profile`, `turbulence`.
        chosen: names of the options that the user specified.
        count: number of vehicles that the user specified; None: as many as models, or as the file has.
        defaults: values where neither an option nor a file gives one.

    Raises:
        ValueError: a value is not accepted.
    """
    build = firmware_of(given)
    if build is not None:
        if "autopilot" in chosen and given["autopilot"] != build.firmware:
            raise ValueError(
                f"--autopilot {given['autopilot']} and --firmware {build}: leave one of them out"
            )
        given, chosen = {**given, "autopilot": build.firmware}, chosen | {"autopilot"}
    models = models_of(given["model"])
    home = given["home"]
    file = None if given["world"] is None else WorldSpec.load(given["world"])
    if file is None:
        chosen = chosen | {"seed", "wind", "wind_profile", "turbulence"}
    if file is None or file.home is None:
        home = home or defaults.home
    fields: dict[str, Any] = {}
    if home is not None:
        fields["home"] = Home.parse(home)
    if "seed" in chosen:
        fields["seed"] = given["seed"]
    if chosen & {"wind", "wind_profile", "turbulence"}:
        fields["air"] = _air(given, chosen, file, defaults)
    if file is None or file.vehicles == (VehicleSpec(),):  # the file lists no vehicles
        models = models or [defaults.model]
        team = WorldSpec.of_team(
            count,
            model=models[0] if len(models) == 1 else models,
            autopilot=given["autopilot"] or defaults.autopilot or "px4",
            launch=given["launch"],
            gps=given["gps"] or "differential",
            home=fields.get("home", None if file is None else file.home),
        )
        return replace(file or team, vehicles=team.vehicles, **fields)
    world = replace(file, **fields)
    if count is not None and count != len(world.vehicles):
        raise ValueError(
            f"{given['world']} has {len(world.vehicles)} vehicles; accepted with it: {len(world.vehicles)}"
        )
    return replace(world, vehicles=_overridden(world.vehicles, given, chosen, models))


def _air(given: Given, chosen: frozenset[str], file: WorldSpec | None, defaults: WorldDefaults) -> Any:
    """The air with the options' values; what no option gives is the file's."""
    before = Environment() if file is None else file.air
    speed_m_s, from_deg = before.wind_speed_m_s, before.wind_from_deg
    if "wind" in chosen:
        speed_m_s, from_deg = parse_wind(given["wind"] if given["wind"] is not None else defaults.wind)
    law = WindLaw(given["wind_profile"])
    stated = file is not None and "wind_profile" not in chosen
    return Environment.from_wind(
        speed_m_s=speed_m_s,
        from_deg=from_deg,
        profile=before.profile if stated else WindProfile(law=law),
        turbulence=(given["turbulence"] or defaults.turbulence)
        if "turbulence" in chosen
        else before.turbulence,
        gusts=before.gusts,
        temperature_offset_k=before.temperature_offset_k,
        decimal_year=before.decimal_year,
    )


def _overridden(
    vehicles: Sequence[VehicleSpec], given: Given, chosen: frozenset[str], models: Sequence[str]
) -> tuple[VehicleSpec, ...]:
    """The vehicles of a file with the values of options."""
    if models:
        count = len(vehicles)
        if len(models) not in (1, count):
            raise ValueError(f"{len(models)} models for {count} vehicles; accepted: one for all, or {count}")
        each = [models[0]] * count if len(models) == 1 else models
        vehicles = [replace(v, model=model) for v, model in zip(vehicles, each, strict=True)]
    for name in ("autopilot", "gps"):
        if name in chosen:
            vehicles = [replace(vehicle, **{name: given[name]}) for vehicle in vehicles]
    return launched(vehicles, given["launch"]) if "launch" in chosen else tuple(vehicles)


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
