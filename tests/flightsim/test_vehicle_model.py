"""Loading, silence, errors and determinism of `Vehicle`."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import flightsim
from flightsim import truth as t
from flightsim import vehicle_air
from flightsim.airframe import AirframeError, known_models, load_airframe
from flightsim.environment import CosineGust, Environment, Turbulence
from flightsim.foundation.kernels import bound
from flightsim.foundation.magnetics import magnetic_field_ned_gauss
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.interface import MAX_ACTUATORS
from flightsim.vehicle import Vehicle, VehicleDivergedError
from flightsim.world import World, WorldParameters

MODELS = Path(flightsim.__file__).parent / "models"


def make(**arguments: object) -> Vehicle:
    values: dict[str, object] = {
        "home": Home(),
        "environment": Environment(),
        "seed_sequence": np.random.SeedSequence(0),
        **arguments,
    }
    return Vehicle(**values)  # type: ignore[arg-type]


def fly(vehicle: Vehicle, steps: int, phase: float = 0.0) -> bytes:
    actuators = np.zeros(MAX_ACTUATORS)
    record = np.empty((steps, t.TRUTH_SIZE))
    for i in range(steps):
        actuators[:4] = 0.6 + 0.02 * np.sin(0.05 * i + phase + np.arange(4))
        vehicle.step(actuators)
        record[i] = vehicle.truth
    return record.tobytes()


def test_loads_without_warnings() -> None:
    assert "iris" in known_models()
    assert make().load_warnings == ()


def test_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    fly(make(), 50)
    assert capfd.readouterr() == ("", "")


def test_prints_nothing_in_a_fresh_process() -> None:
    program = (
        "import numpy as np\n"
        "from flightsim.world import World\n"
        "world = World()\n"
        "vehicle = world.add_vehicle()\n"
        "vehicle.step(np.zeros(8))\n"
        "vehicle.reset()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        cwd=MODELS.parent.parent,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


WINDY = Environment(
    wind_ned_m_s=(3.0, 2.0, 0.0),
    turbulence=Turbulence.LIGHT,
    gusts=(CosineGust(start_s=0.2, velocity_ned_m_s=(0.0, 3.0, 0.0)),),
)


def test_same_seed_same_bytes() -> None:
    first, second = make(environment=WINDY), make(environment=WINDY)
    record = fly(first, 600)
    assert record == fly(second, 600)
    first.reset()
    assert record == fly(first, 600)
    assert record != fly(make(environment=WINDY, seed_sequence=np.random.SeedSequence(1)), 600)


def test_a_gust_to_come_costs_nothing_until_it_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernel's arguments are handed over once, and once more when the gust begins."""
    handed: list[object] = []

    def counted(*arguments: object, **named: object) -> object:
        handed.append(arguments)
        return bound(*arguments, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(vehicle_air, "bound", counted)
    fly(make(environment=WINDY), 400)
    assert len(handed) <= 3


def test_interleaved_vehicles_fly_as_alone() -> None:
    def world(count: int) -> World:
        world = World(WorldParameters(seed=5, environment=WINDY))
        for i in range(count):
            world.add_vehicle(offset_ne_m=(0.0, 5.0 * i))
        return world

    alone = world(1).vehicles[0]
    pair = world(2).vehicles
    actuators = [np.zeros(MAX_ACTUATORS) for _ in range(2)]
    for i in range(500):
        actuators[0][:4] = 0.6 + 0.01 * np.sin(0.02 * i)
        actuators[1][:4] = 0.65
        alone.step(actuators[0])
        for vehicle, commands in zip(pair, actuators, strict=True):
            vehicle.step(commands)
        assert pair[0].truth.tobytes() == alone.truth.tobytes()


def test_truth_after_reset() -> None:
    vehicle = make(home=Home(heading_deg=90.0))
    truth = vehicle.truth
    np.testing.assert_allclose(truth[t.SPECIFIC_FORCE_FRD_M_S2], [0.0, 0.0, -9.807], atol=1e-3)
    np.testing.assert_allclose(np.abs(truth[t.Q_NED_FROM_FRD]), [0.5**0.5, 0.0, 0.0, 0.5**0.5], atol=1e-6)
    np.testing.assert_allclose(
        truth[t.MAG_NED_GAUSS], magnetic_field_ned_gauss(47.397742, 8.545594, 488.1, 2026.0), atol=1e-7
    )
    assert truth[t.BATTERY_USED_AH] == 0.0
    assert vehicle.steps == 0


@pytest.mark.parametrize("rate_hz", [125, 500, 1000])
def test_other_physics_rates_fly_the_same(rate_hz: int) -> None:
    def height(rate: int) -> float:
        vehicle = make(physics_rate_hz=rate)
        actuators = np.zeros(MAX_ACTUATORS)
        actuators[:4] = 0.65
        for _ in range(2 * rate):
            vehicle.step(actuators)
        return float(vehicle.truth[t.HEIGHT_ABOVE_GROUND_M])

    assert height(rate_hz) == pytest.approx(height(250), rel=0.03)


@pytest.mark.parametrize("rate_hz", [10, 300, 5000])
def test_bad_rates_are_refused(rate_hz: int) -> None:
    with pytest.raises(ValueError, match=str(rate_hz)):
        make(physics_rate_hz=rate_hz)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"height_m": -1.0}, "-1.0"),
        ({"battery_remaining": 1.2}, "1.2"),
        ({"battery_ah": 0.0}, "battery_ah 0.0 Ah"),
        ({"roll_rad": 0.3}, "give height_m"),
        ({"vel_ned_m_s": (1.0, 0.0, 0.0)}, "give height_m"),
    ],
)
def test_bad_initial_states_are_named(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        InitialState(**arguments)  # type: ignore[arg-type]


def test_wrong_number_of_rotor_speeds() -> None:
    with pytest.raises(ValueError, match="3 rotor speeds"):
        make(initial=InitialState(height_m=10.0, rotor_rad_s=(1.0, 2.0, 3.0)))


def test_divergence_is_an_error_not_a_flight() -> None:
    vehicle = make()
    with pytest.raises(VehicleDivergedError, match="iris"):
        for _ in range(5):
            vehicle.step(np.full(MAX_ACTUATORS, np.nan))


def test_unknown_model_names_the_known_ones() -> None:
    with pytest.raises(AirframeError, match=r"'dirigible' is unknown.*iris"):
        make(model="dirigible")


def test_a_model_by_path_flies_like_the_packaged_one(tmp_path: Path) -> None:
    shutil.copytree(MODELS / "iris", tmp_path / "mine")
    assert fly(make(model=tmp_path / "mine"), 50) == fly(make(model=str(tmp_path / "mine/vehicle.toml")), 50)
    assert fly(make(model=tmp_path / "mine"), 50) == fly(make(), 50)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('kind = "multicopter"', 'kind = "rocket"', "kind 'rocket'.*multicopter"),
        ('jsbsim = "iris"', 'jsbsim = "nothing"', "nothing.xml"),
        ("[actuators]", "[motors]", r"\[actuators\]"),
        ("BATTERY_USED_AH", "BATTERY_MOOD", "BATTERY_MOOD"),
        ("battery/voltage-V", "battery/voltage-mV", "battery/voltage-mV"),
        ("fcs/motor-1/command", "fcs/motor-9/command", "fcs/motor-9/command"),
        ('name = "iris"', "name = 5", "name is 5"),
        ("[vehicle]", "[vehicle", "not TOML"),
        ('"fcs/motor-1/effectiveness", ', "", "3 effectiveness"),
        ("cg_height_at_rest_m = 0.0985", 'cg_height_at_rest_m = "low"', "cg_height_at_rest_m is 'low'"),
    ],
)
def test_bad_descriptions_are_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    shutil.copytree(MODELS / "iris", tmp_path / "bad")
    description = tmp_path / "bad" / "vehicle.toml"
    text = description.read_text()
    assert old in text
    description.write_text(text.replace(old, new, 1))
    with pytest.raises(AirframeError, match=message):
        make(model=tmp_path / "bad")


@pytest.mark.parametrize(
    ("old", "new"), [("</fdm_config>", ""), ("<product>", "<produkt>"), ("<mass_balance>", "<mass_ballast>")]
)
def test_bad_jsbsim_files_are_refused_quietly(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], old: str, new: str
) -> None:
    shutil.copytree(MODELS / "iris", tmp_path / "bad")
    xml = tmp_path / "bad" / "iris.xml"
    xml.write_text(xml.read_text().replace(old, new, 1))
    with pytest.raises(AirframeError, match=r"JSBSim cannot load .*iris\.xml"):
        make(model=tmp_path / "bad")
    assert capfd.readouterr() == ("", "")


def test_airframe_maps_properties() -> None:
    airframe = load_airframe("iris")
    assert airframe.xml_path.is_file()
    assert len(airframe.actuators) == len(airframe.effectiveness) == 4
    assert dict(airframe.truth)[t.BATTERY_CURRENT_A] == "battery/current-A"
