"""`--world FILE`, and the options that override it."""

from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from autopilot_bridge.firmware_process.build import FirmwareBuild
from flightsim.environment import CosineGust, Environment
from flightsim.home import Home
from flightsim.payload import GroundTargetParameters, MagneticSpec, Static
from flightsim.wind_profile import WindLaw, WindProfile
from flightsim.world_spec import HOMES, VehicleSpec, WorldSpec, team
from missions.base.mission import WorldDefaults
from missions.base.run_options import WorldOptions
from missions.cli.bodies.world import world_of
from missions.cli.fly import fly
from missions.cli.sitl import sitl
from missions.occupancy.options import OccupancyOptions
from missions.occupancy.world import occupancy_world
from missions.orbit.options import OrbitOptions
from missions.orbit.world import orbit_world

FILE = """
seed = 7
home = {lat_deg = 47.0, lon_deg = 8.0, alt_m = 400, heading_deg = 90}
vehicles = [{model = "iris", gps = "standalone"}, {model = "aerosonde", autopilot = "ardupilot"}]

[air]
speed_m_s = 5
from_deg = 270
profile = "power"
turbulence = "light"
gusts = [{start_s = 9, velocity_ned_m_s = [1, 0, 0]}]
"""
GUSTS = (CosineGust(start_s=9.0, velocity_ned_m_s=(1.0, 0.0, 0.0)),)
AIR = Environment.from_wind(
    speed_m_s=5.0, from_deg=270.0, profile=WindProfile(law=WindLaw.POWER), turbulence="light", gusts=GUSTS
)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "world.toml").write_text(FILE)
    return tmp_path / "world.toml"


def made(count: int | None = None, defaults: WorldDefaults | None = None, **given: object) -> WorldSpec:
    file, firmware = given.pop("world", None), given.pop("firmware", None)
    return world_of(
        WorldOptions(**given),
        frozenset(given),
        file=file,
        firmware=None if firmware is None else FirmwareBuild.parse(firmware),
        count=count,
        defaults=defaults or WorldDefaults(),
    )


def test_without_a_file_the_options_and_the_defaults_of_the_mission_are_the_world() -> None:
    still = Environment.from_wind(speed_m_s=0.0, from_deg=0.0)
    assert made() == WorldSpec(vehicles=team(1, model="iris"), air=still)
    defaults = WorldDefaults(
        model="aerosonde", wind="4@90", turbulence="light", autopilot="ardupilot", home="1,2,3"
    )
    air = Environment.from_wind(speed_m_s=4.0, from_deg=90.0, turbulence="light")
    vehicles = team(2, model="aerosonde", autopilot="ardupilot")
    home = Home(lat_deg=1.0, lon_deg=2.0, alt_m=3.0)
    assert made(2, defaults) == WorldSpec(vehicles=vehicles, air=air, home=home)
    other = made(model=("iris,aerosonde",), autopilot="ardupilot", gps="standalone", seed=3, wind="2@45")
    heading_deg = HOMES["ardupilot"].heading_deg
    assert other == WorldSpec(
        vehicles=team(
            2, model=["iris", "aerosonde"], autopilot="ardupilot", gps="standalone", heading_deg=heading_deg
        ),
        seed=3,
        air=Environment.from_wind(speed_m_s=2.0, from_deg=45.0),
    )


def test_a_file_is_the_world_and_the_defaults_of_the_mission_do_not_change_it(file: Path) -> None:
    defaults = WorldDefaults(model="aerosonde", wind="4", turbulence="light", home="1,2,3")
    world = made(world=file, defaults=defaults)
    assert world == WorldSpec.load(file)
    assert world.air == AIR
    assert world.seed == 7


def test_an_explicit_option_overrides_its_field_and_no_other(file: Path) -> None:
    world = WorldSpec.load(file)
    assert made(world=file, seed=8) == replace(world, seed=8)
    windy = made(world=file, wind="3@180")
    assert windy == replace(world, air=windy.air)
    assert (windy.air.wind_speed_m_s, windy.air.wind_from_deg) == (3.0, 180.0)
    assert (windy.air.profile, windy.air.turbulence, windy.air.gusts) == (AIR.profile, AIR.turbulence, GUSTS)
    calm = made(world=file, turbulence="none", wind_profile="uniform").air
    assert (calm.wind_speed_m_s, calm.wind_from_deg, calm.gusts) == (5.0, 270.0, GUSTS)
    assert (calm.profile.law, calm.turbulence) == (WindLaw.UNIFORM, "none")
    assert made(world=file, home="1,2,3").home == Home(lat_deg=1.0, lon_deg=2.0, alt_m=3.0)
    px4 = made(world=file, autopilot="px4")
    assert [vehicle.autopilot for vehicle in px4.vehicles] == ["px4", "px4"]
    assert px4.vehicles[0] == world.vehicles[0]
    models = made(world=file, model=("aerosonde",), launch="hand").vehicles
    assert [(vehicle.model, vehicle.launch) for vehicle in models] == [("aerosonde", "hand")] * 2
    assert [vehicle.gps for vehicle in models] == ["standalone", "differential"]
    assert made(2, world=file) == world


@pytest.mark.parametrize(
    ("given", "count", "words"),
    [
        ({"model": ("iris,iris,iris",)}, None, "3 models for 2 vehicles; accepted: one for all, or 2"),
        ({"model": ("iris,",)}, None, "has a place without a name"),
        ({"model": ("iris",), "launch": "hand"}, None, "launch 'hand' is for aircraft"),
        ({}, 3, "has 2 vehicles; accepted with it: 2"),
        ({"wind": "fast"}, None, "wind 'fast' is not SPEED"),
        ({"home": "here"}, None, "home 'here' is not 'lat,lon,alt"),
    ],
)
def test_options_that_do_not_go_with_the_file_are_refused(
    file: Path, given: dict[str, object], count: int | None, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        made(count, world=file, **given)


def test_vehicles_that_a_file_leaves_out_are_those_of_the_options(tmp_path: Path) -> None:
    (tmp_path / "air.toml").write_text("air = {speed_m_s = 5, from_deg = 270}")
    world = made(2, world=tmp_path / "air.toml", defaults=WorldDefaults(model="aerosonde"))
    assert world.vehicles == team(2, model="aerosonde")
    assert world.air.wind_speed_m_s == 5.0


def test_missions_add_only_what_the_world_does_not_have() -> None:
    target = GroundTargetParameters(motion=Static(north_m=1.0, east_m=2.0))
    own = WorldSpec(vehicles=(VehicleSpec(model="aerosonde"),), targets=(target,))
    world = orbit_world(own, OrbitOptions())
    assert world.targets == (target,)
    assert world.vehicles[0].payload.camera is not None
    assert world.vehicles[0].payload.gimbal is not None
    field = MagneticSpec(width_m=5000.0)
    searched = occupancy_world(replace(own, magnetic_field=field), OccupancyOptions())
    assert searched.magnetic_field == field
    assert searched.vehicles[0].payload.magnetometer is not None


@pytest.mark.parametrize(
    ("command", "arguments"), [(fly, ["lissajous"]), (sitl, ["--duration", "1"])], ids=["fly", "sitl"]
)
def test_a_bad_file_is_a_usage_error_that_names_it(tmp_path: Path, command, arguments) -> None:
    (tmp_path / "bad.toml").write_text("seeds = 3")
    result = CliRunner().invoke(command, [*arguments, "--world", str(tmp_path / "bad.toml")])
    assert result.exit_code == 2
    assert "bad.toml: seeds is unknown; accepted are air, faults, home" in " ".join(result.output.split())


def test_fly_refuses_a_world_for_a_vehicle_elsewhere(file: Path) -> None:
    result = CliRunner().invoke(fly, ["sector", "--connect", "udpin:127.0.0.1:1", "--world", str(file)])
    assert result.exit_code == 2
    assert "--world: of the embedded SITL only" in " ".join(result.output.split())


def test_a_real_firmware_is_the_autopilot_of_all_vehicles(file: Path) -> None:
    world = made(world=file, firmware="ardupilot=arducopter")
    assert [vehicle.autopilot for vehicle in world.vehicles] == ["ardupilot", "ardupilot"]
    assert made(firmware="ardupilot").place == made(autopilot="ardupilot").place
    with pytest.raises(ValueError, match="--autopilot px4 and --firmware ardupilot: leave one of them out"):
        made(firmware="ardupilot", autopilot="px4")
    with pytest.raises(ValueError, match="firmware 'x' is not accepted"):
        made(firmware="x")
