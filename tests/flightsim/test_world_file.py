"""Worlds from TOML files: every kind of value, and errors that name file, key, value and what is accepted."""

import math
from dataclasses import replace

import pytest

from flightsim.environment import CosineGust, Environment
from flightsim.home import Home
from flightsim.payload import (
    CameraParameters,
    Circle,
    GaussianSignature,
    GroundTargetParameters,
    InducedDipole,
    MagneticSpec,
    PayloadParameters,
    RandomWalk,
)
from flightsim.sensors import GpsParameters, SensorSuiteParameters
from flightsim.sensors.fault_kinds import FaultType
from flightsim.wind_profile import WindLaw, WindProfile
from flightsim.world_file import WorldFileError
from flightsim.world_spec import HOMES, FaultSpec, FaultUnit, VehicleSpec, WorldSpec, team


def load(folder, text):
    (folder / "world.toml").write_text(text)
    return WorldSpec.load(folder / "world.toml")


def test_an_empty_file_is_the_default_world(tmp_path):
    assert load(tmp_path, "") == WorldSpec()


def test_every_table_becomes_its_parameter_class(tmp_path):
    world = load(
        tmp_path,
        """
        seed = 7
        physics_rate_hz = 400
        home = {lat_deg = 47.4, lon_deg = 8.5, alt_m = 480, heading_deg = 90}

        [air]
        speed_m_s = 5
        from_deg = 270
        profile = "power"
        turbulence = "light"
        gusts = [{start_s = 30, velocity_ned_m_s = [0, 4, 0], hold_s = 2}]

        [[vehicles]]
        model = "aerosonde"
        launch = "hand"
        offset_ne_m = [1, 2]
        payload = {camera = {rate_hz = 5}}
        parameters = {FW_AIRSPD_TRIM = 26}

        [[vehicles]]
        autopilot = "ardupilot"
        gps = "standalone"
        battery_ah = 12.0
        sensors = {rangefinder = false, gps = {rate_hz = 10}}

        [[targets]]
        tag_id = 0
        motion = {kind = "circle", north_m = 1, east_m = 2.5, radius_m = 100, speed_m_s = 2, bearing_deg = 90}

        [[targets]]
        motion = {kind = "random-walk", south_m = -9, west_m = -9, north_m = 9, east_m = 9, speed_m_s = 1}

        [magnetic_field]
        map_file = "maps/here.npz"
        signatures = [
            {kind = "gaussian", north_m = 10, east_m = 20, amplitude_nt = -40, heading_deg = 180},
            {kind = "induced", north_m = 3, east_m = 4, moment_a_m2 = 1e4},
        ]

        [[faults]]
        unit = "gps"
        failure = "wrong"
        no_fix = true
        start_s = 20
        duration_s = 5
        vehicle = 2
        """,
    )
    assert world == WorldSpec(
        seed=7,
        physics_rate_hz=400,
        home=Home(lat_deg=47.4, lon_deg=8.5, alt_m=480.0, heading_deg=90.0),
        air=Environment.from_wind(
            speed_m_s=5.0,
            from_deg=270.0,
            profile=WindProfile(law=WindLaw.POWER),
            turbulence="light",
            gusts=(CosineGust(start_s=30.0, velocity_ned_m_s=(0.0, 4.0, 0.0), hold_s=2.0),),
        ),
        vehicles=(
            VehicleSpec(
                model="aerosonde",
                launch="hand",
                offset_ne_m=(1.0, 2.0),
                payload=PayloadParameters(camera=CameraParameters(rate_hz=5)),
                parameters={"FW_AIRSPD_TRIM": 26.0},
            ),
            VehicleSpec(
                system_id=2,
                autopilot="ardupilot",
                gps="standalone",
                battery_ah=12.0,
                sensors=SensorSuiteParameters(rangefinder=None, gps=GpsParameters(rate_hz=10)),
            ),
        ),
        targets=(
            GroundTargetParameters(
                tag_id=0,
                motion=Circle(
                    north_m=1.0, east_m=2.5, radius_m=100.0, speed_m_s=2.0, bearing_rad=math.radians(90.0)
                ),
            ),
            GroundTargetParameters(
                motion=RandomWalk(south_m=-9.0, west_m=-9.0, north_m=9.0, east_m=9.0, speed_m_s=1.0)
            ),
        ),
        magnetic_field=MagneticSpec(
            map_file=tmp_path / "maps/here.npz",
            signatures=(
                GaussianSignature(north_m=10.0, east_m=20.0, amplitude_nt=-40.0, heading_rad=math.pi),
                InducedDipole(north_m=3.0, east_m=4.0, moment_a_m2=1e4),
            ),
        ),
        faults=(
            FaultSpec(
                unit=FaultUnit.GPS,
                failure=FaultType.WRONG,
                no_fix=True,
                start_s=20.0,
                duration_s=5.0,
                vehicle=2,
            ),
        ),
    )


def test_vehicles_without_places_are_a_team(tmp_path):
    world = load(tmp_path, 'vehicles = [{model = "iris"}, {model = "aerosonde"}, {}]')
    assert world.vehicles == team(3, model=["iris", "aerosonde", "iris"])
    turned = load(tmp_path, 'vehicles = [{autopilot = "ardupilot"}, {autopilot = "ardupilot"}]')
    heading_deg = HOMES["ardupilot"].heading_deg
    assert turned.vehicles == team(2, model="iris", autopilot="ardupilot", heading_deg=heading_deg)


def test_a_model_beside_the_file_is_found_and_a_name_stays_a_name(tmp_path):
    (tmp_path / "mine").mkdir()
    text = 'vehicles = [{model = "./mine", offset_ne_m = [0, 0]}, {model = "iris", offset_ne_m = [5, 0]}]'
    world = load(tmp_path, text)
    assert [vehicle.model for vehicle in world.vehicles] == [tmp_path / "mine", "iris"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("seed = ", "it is not TOML"),
        ("sed = 1", "sed is unknown; accepted are air, faults, home"),
        ("seed = 1.5", "seed is 1.5; accepted: a whole number"),
        ("seed = true", "seed is True; accepted: a whole number"),
        ("seed = -1", "seed"),
        ("physics_rate_hz = 333", "physics rate 333 Hz is not usable; accepted are 100 to 2000 Hz"),
        ("home = {lat_deg = 1, lon_deg = 2}", "home.alt_m is missing"),
        ("home = {lat_deg = 91, lon_deg = 2, alt_m = 3}", "home: home latitude 91.0 deg is not in"),
        ("air = {speed_m_s = 'x', from_deg = 1}", "air.speed_m_s is 'x'; accepted: a number"),
        ("air = {speed_m_s = 1, from_deg = 1, turbulence = 'wild'}", "air.turbulence is 'wild'; accepted:"),
        ("air = {speed_m_s = 1, from_deg = 1, profile = 'x'}", "profile.law is 'x'; accepted: uniform, log"),
        ("vehicles = 3", "vehicles is 3; accepted: a list"),
        ("vehicles = []", "needs at least one vehicle"),
        ("vehicles = [{model = 'boeing'}]", "vehicles: vehicle model 'boeing' is unknown"),
        ("vehicles = [{}, {gps = 'best'}]", "vehicles[2]: "),
        ("vehicles = [{battery_ah = -1}]", "vehicles[1]: battery_ah -1.0 Ah is not in 0.1..1000 Ah"),
        ("vehicles = [{system_id = 2}, {}]", "system ids [2, 2] are not all different"),
        ("vehicles = [{offset_ne_m = [1]}]", "vehicles[1].offset_ne_m is [1]; accepted: a list of 2"),
        ("vehicles = [{parameters = {A = 'x'}}]", "vehicles[1].parameters.A is 'x'; accepted: a number"),
        ("targets = [{motion = {kind = 'jump'}}]", "targets[1].motion.kind is 'jump'; accepted: static"),
        ("targets = [{size_m = 1}]", "targets[1].motion is missing"),
        ("faults = [{unit = 'gps'}]", "faults[1].start_s is missing"),
        ("faults = [{unit = 'wing', start_s = 1}]", "faults[1].unit is 'wing'; accepted: gyro, accel"),
        ("faults = [{unit = 'gps', start_s = -1}]", "faults[1]: start_s -1.0 is no vehicle time"),
        ("faults = [{unit = 'gps', start_s = 1, duration_s = 0}]", "duration_s 0.0 is not accepted"),
        ("faults = [{unit = 'gps', start_s = 1, failure = 'ok'}]", "failure OK is no fault"),
        ("faults = [{unit = 'gps', start_s = 1, vehicle = 4}]", "for vehicle 4; accepted are system ids [1]"),
    ],
)  # fmt: skip
def test_errors_name_file_key_value_and_what_is_accepted(tmp_path, text, words):
    with pytest.raises(WorldFileError) as refused:
        load(tmp_path, text)
    assert str(refused.value).removeprefix("world file ").startswith(f"{tmp_path / 'world.toml'}")
    assert words in str(refused.value)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(WorldFileError, match=r"world file .*none\.toml can't be read: No such file"):
        WorldSpec.load(tmp_path / "none.toml")


def test_a_world_is_a_value():
    assert replace(WorldSpec(), seed=3) == WorldSpec(seed=3)
