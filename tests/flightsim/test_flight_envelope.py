"""Flight envelopes: figures against closed forms, foreign aircraft, and refusals in plain words."""

import math
import os
import shutil
from pathlib import Path

import jsbsim
import pytest

import flightsim
from flightsim.airframe import AirframeError, load_airframe
from flightsim.environment import Environment
from flightsim.flight_envelope import FlightEnvelope, flight_envelope
from flightsim.home import Home
from flightsim.linear_modes import linear_modes
from flightsim.model_files import content_digest, model_files
from flightsim.trim_flight import TrimError, trim_flight

# Of the book's Aerosonde, appendix E (newer edition), see aerosonde.xml.
MASS_KG, S_M2, B_M, C_M, JX, JY, JZ, JXZ = 11.0, 0.55, 2.8956, 0.18994, 0.8244, 1.135, 1.759, 0.1204
G_M_S2 = 9.807


@pytest.fixture(scope="module")
def aerosonde() -> FlightEnvelope:
    return flight_envelope("aerosonde")


def test_sizes_and_limits(aerosonde: FlightEnvelope) -> None:
    assert aerosonde.name == "aerosonde"
    assert aerosonde.mass_kg == pytest.approx(MASS_KG, rel=1e-6)
    assert aerosonde.wing_area_m2 == pytest.approx(S_M2, rel=1e-6)
    assert aerosonde.wing_span_m == pytest.approx(B_M, rel=1e-6)
    assert aerosonde.chord_m == pytest.approx(C_M, rel=1e-6)
    assert (aerosonde.airspeed_min_m_s, aerosonde.airspeed_trim_m_s, aerosonde.airspeed_max_m_s) == (
        18,
        25,
        30,
    )
    assert aerosonde.powered
    assert math.degrees(aerosonde.bank_max_rad) == pytest.approx(45.0)


def test_control_response_against_the_coefficients(aerosonde: FlightEnvelope) -> None:
    """Roll and yaw with the product of inertia; full travel is 30, 45 and 25 degrees."""
    pressure_pa = 0.5 * 1.225 * aerosonde.airspeed_trim_m_s**2
    speed = aerosonde.airspeed_trim_m_s * math.sqrt(1.225 / aerosonde.density_kg_m3)
    determinant = JX * JZ - JXZ**2
    qsb = pressure_pa * S_M2 * B_M
    rudder = math.radians(25.0)
    yaw = qsb * rudder * (JXZ * -0.0024 + JX * 0.069) / determinant
    assert aerosonde.yaw_acceleration_per_rudder_rad_s2 == pytest.approx(yaw, rel=0.01)
    pitch = pressure_pa * S_M2 * C_M * 0.99 * math.radians(45.0) / JY
    assert aerosonde.pitch_acceleration_per_elevator_rad_s2 == pytest.approx(pitch, rel=0.01)
    damping = JZ * -0.51 + JXZ * 0.069
    ailerons = (JZ * 0.17 + JXZ * -0.011) * math.radians(30.0)
    roll_rate = -ailerons / damping * 2.0 * speed / B_M
    assert aerosonde.roll_rate_per_aileron_rad_s == pytest.approx(roll_rate, rel=0.01)
    assert aerosonde.lift_slope_per_rad == pytest.approx(5.61 + 0.06, rel=0.02)  # and the drag's share


def test_performance_against_energy(aerosonde: FlightEnvelope) -> None:
    """Sink is drag times speed over weight; the load factor of a pull-up is V q / g."""
    speed = aerosonde.airspeed_trim_m_s * math.sqrt(1.225 / aerosonde.density_kg_m3)
    assert aerosonde.sink_min_m_s == pytest.approx(aerosonde.drag_n * speed / (MASS_KG * G_M_S2), rel=0.01)
    assert aerosonde.load_factor_per_elevator == pytest.approx(
        aerosonde.pitch_rate_per_elevator_rad_s * speed / G_M_S2, rel=0.01
    )
    assert 12.5 < aerosonde.stall_speed_m_s < 15.0
    assert 4.5 < aerosonde.climb_max_m_s < 7.5
    assert aerosonde.sink_max_m_s > aerosonde.sink_min_m_s > 0.0
    assert (
        aerosonde.trim_throttle_min_speed < aerosonde.trim_throttle < aerosonde.trim_throttle_max_speed <= 1.0
    )
    assert aerosonde.thrust_per_throttle_n > 30.0


def test_higher_and_hotter_climbs_less(aerosonde: FlightEnvelope) -> None:
    thin = flight_envelope(
        "aerosonde", home=Home(alt_m=2500.0), environment=Environment(temperature_offset_k=15.0)
    )
    assert thin.density_kg_m3 < 0.85 * aerosonde.density_kg_m3
    assert thin.climb_max_m_s < aerosonde.climb_max_m_s
    assert thin.stall_speed_m_s == pytest.approx(aerosonde.stall_speed_m_s, rel=0.03)  # equivalent airspeed


def test_computed_once_it_is_remembered(aerosonde: FlightEnvelope) -> None:
    assert flight_envelope("aerosonde") is aerosonde


@pytest.mark.parametrize("model", ["c172x", "j3cub", "t37", "sgs126"])
@pytest.mark.slow
def test_package_aircraft_trim(model: str) -> None:
    envelope = flight_envelope(model)
    assert envelope.stall_speed_m_s < envelope.airspeed_min_m_s
    assert envelope.roll_rate_per_aileron_rad_s > 0.1
    assert envelope.pitch_acceleration_per_elevator_rad_s2 > 0.2
    assert envelope.yaw_acceleration_per_rudder_rad_s2 > 0.1
    assert 5.0 < envelope.glide_ratio < 40.0
    assert envelope.powered == (model != "sgs126")
    if envelope.powered:
        assert envelope.climb_max_m_s > 1.5
        assert 0.2 < envelope.trim_throttle < 0.95
        assert envelope.trim_throttle_max_speed < 1.0
    else:
        assert envelope.climb_max_m_s == -envelope.sink_min_m_s
        assert envelope.trim_throttle == envelope.thrust_per_throttle_n == 0.0


def test_an_aircraft_without_any_description() -> None:
    envelope = flight_envelope("T38")
    assert 1.15 * envelope.stall_speed_m_s < envelope.airspeed_min_m_s < envelope.airspeed_trim_m_s
    assert envelope.airspeed_max_m_s > envelope.airspeed_trim_m_s


def described(tmp_path: Path, more: str) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text('[vehicle]\nname = "mine"\nkind = "fixed_wing"\njsbsim = "sgs126"\n' + more)
    return path


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (
            "[actuators]\nelevator = {scale = 1}\n",
            r"positive elevator pitches the nose down.*\[actuators\] round",
        ),
        ("[actuators]\naileron = {scale = -1}\n", "positive aileron rolls left"),
        ("[actuators]\nrudder = {scale = 1}\n", "positive rudder turns the nose left"),
        ("[actuators]\naileron = 'fcs/flap-cmd-norm'\n", "aileron does nothing at cruise"),
        ("[actuators]\naileron = false\n", "has no aileron"),
        (
            "[limits]\nairspeed_min_m_s = 5\nairspeed_trim_m_s = 23\n",
            r"airspeed_min_m_s 5\.0 is below its stall",
        ),
        ("[limits]\nairspeed_trim_m_s = 4\n", r"cannot hold steady flight.*power off \(4\.0 m/s"),
    ],
)
@pytest.mark.sampled(3)
def test_what_cannot_fly_is_reported_in_plain_words(tmp_path: Path, more: str, message: str) -> None:
    with pytest.raises(AirframeError, match=message):
        flight_envelope(described(tmp_path, more))


def test_too_fast_a_cruise_says_how_much_throttle_it_needs(tmp_path: Path) -> None:
    path = tmp_path / "fast.toml"
    path.write_text(
        '[vehicle]\nname = "fast"\nkind = "fixed_wing"\njsbsim = "T37"\n[limits]\nairspeed_trim_m_s = 140\n'
    )
    with pytest.raises(AirframeError, match=r"'fast' cannot hold.*it needs 1\.\d+ of full throttle \(140\.0"):
        flight_envelope(path)


def test_a_quadrotor_has_none() -> None:
    with pytest.raises(AirframeError, match=r"iris.*multicopter"):
        flight_envelope("iris")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"airspeed_m_s": 0.1}, r"0\.1 m/s is not in 1\.\.500"),
        ({"airspeed_m_s": 25.0, "turn_radius_m": 100.0, "bank_rad": 0.1}, "not both"),
        ({"airspeed_m_s": 25.0, "turn_radius_m": 0.0}, "radius 0"),
        ({"airspeed_m_s": 25.0, "bank_rad": 1.5}, r"bank 1\.5"),
    ],
)
def test_bad_trims_are_named(arguments: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        trim_flight("aerosonde", **arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("airspeed_m_s", "message"), [(12.0, "full elevator is not enough"), (45.0, r"it needs 1\.\d\d of full")]
)
def test_no_trim_says_why(airspeed_m_s: float, message: str) -> None:
    with pytest.raises(TrimError, match=message):
        trim_flight("aerosonde", airspeed_m_s=airspeed_m_s)


def test_a_climb_needs_the_power_of_its_height() -> None:
    level = trim_flight("aerosonde", airspeed_m_s=25.0)
    climbing = trim_flight("aerosonde", airspeed_m_s=25.0, climb_angle_rad=0.1)
    assert climbing.climb_m_s == pytest.approx(2.5, rel=0.01)
    assert climbing.pitch_rad == pytest.approx(climbing.angle_of_attack_rad + 0.1, abs=1e-3)
    assert climbing.throttle > level.throttle
    full = trim_flight("aerosonde", airspeed_m_s=25.0, throttle=climbing.throttle)
    assert full.climb_angle_rad == pytest.approx(0.1, abs=1e-3)


def test_modes_of_a_foreign_aircraft_are_those_of_its_kind() -> None:
    """A light single: short period of some rad/s and well damped, slow phugoid, Dutch roll of 2 rad/s."""
    model = linear_modes("c172p", airspeed_m_s=50.0)
    assert 3.0 < model.short_period.frequency_rad_s < 9.0
    assert 0.4 < model.short_period.damping < 1.1
    assert 0.1 < model.phugoid.frequency_rad_s < 0.4
    assert 1.5 < model.dutch_roll.frequency_rad_s < 3.5
    assert 0.05 < model.roll.time_constant_s < 0.4
    assert abs(model.spiral.time_constant_s) > 10.0


def rewrite(path: Path, old: str, new: str) -> None:
    """Change a file, and leave its time as it was."""
    stamp = path.stat()
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))


def test_an_envelope_is_worked_out_anew_when_description_or_model_has_changed(tmp_path: Path) -> None:
    """By content, whatever the times of the files say."""
    folder = shutil.copytree(Path(flightsim.__file__).parent / "models" / "aerosonde", tmp_path / "aerosonde")
    first = flight_envelope(folder)
    assert flight_envelope(folder) is first
    rewrite(folder / "vehicle.toml", "airspeed_max_m_s = 30", "airspeed_max_m_s = 29")
    slower = flight_envelope(folder)
    assert slower.airspeed_max_m_s == 29.0
    rewrite(folder / "aerosonde.xml", "<description>", "<description> ")
    assert flight_envelope(folder) is not slower


@pytest.mark.parametrize("name", ["c172x.xml", "eng_io320.xml", "prop_75in2f.xml"])
def test_a_model_has_changed_when_its_engine_or_propeller_has(name: str, tmp_path: Path) -> None:
    """Own files of the names that the model gives come before those of the package."""
    package = Path(jsbsim.get_default_root_dir())
    folder = shutil.copytree(package / "aircraft" / "c172x", tmp_path / "c172x")
    engines = folder / "Engines"
    engines.mkdir()
    for own in ("eng_io320.xml", "prop_75in2f.xml"):
        shutil.copy(package / "engine" / own, engines)
    airframe = load_airframe(folder / "c172x.xml")
    before = content_digest(airframe)
    assert content_digest(airframe) == before
    rewrite(next(folder.rglob(name)), "</", " </")
    assert content_digest(airframe) != before


def test_the_files_of_a_packaged_aircraft_are_found() -> None:
    names = {file.path.name for file in model_files(load_airframe("c172x"))}
    assert names >= {"c172x.xml", "eng_io320.xml", "prop_75in2f.xml"}
