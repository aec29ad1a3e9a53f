"""Our Aerosonde in JSBSim against the book's equations (`benchmarks/beard_mclain.py`, without JSBSim)."""

import importlib.util
import math
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from flightsim.flight_envelope import flight_envelope
from flightsim.interface import ELEVATOR, MAX_ACTUATORS, THROTTLE
from flightsim.linear_modes import LinearModel, Mode, linearise
from flightsim.trim_flight import trim_in_tunnel
from flightsim.wind_tunnel import FlightState, WindTunnel

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def load(name: str) -> ModuleType:
    specification = importlib.util.spec_from_file_location(name, BENCHMARKS / f"{name}.py")
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    return module


book_model = load("beard_mclain")


@pytest.fixture(scope="module")
def tunnel() -> WindTunnel:
    return WindTunnel("aerosonde")


@pytest.fixture(scope="module")
def book(tunnel: WindTunnel):  # type: ignore[no-untyped-def]
    return book_model.Book(tunnel.density_kg_m3)


@pytest.mark.parametrize("speed_m_s", [18.0, 21.0, 25.0, 30.0])
@pytest.mark.parametrize("radius_m", [math.inf, 200.0, -90.0])
def test_trims(tunnel: WindTunnel, book, speed_m_s: float, radius_m: float) -> None:  # type: ignore[no-untyped-def]
    theirs = book.trim(speed_m_s, radius=radius_m)
    ours = trim_in_tunnel(
        tunnel, airspeed_m_s=speed_m_s, turn_radius_m=None if math.isinf(radius_m) else radius_m
    )
    assert ours.angle_of_attack_rad == pytest.approx(theirs.alpha, rel=0.01)
    assert ours.elevator * book_model.ELEVATOR_TRAVEL_RAD == pytest.approx(-theirs.de, rel=0.01)
    assert ours.throttle == pytest.approx(theirs.dt, rel=0.005)
    assert ours.roll_rad == pytest.approx(theirs.phi, abs=1e-3)  # the book's Earth does not turn
    assert ours.aileron * math.radians(30.0) == pytest.approx(theirs.da, abs=3e-4)
    assert ours.rudder * math.radians(25.0) == pytest.approx(-theirs.dr, abs=3e-4)


@pytest.fixture(scope="module")
def model(tunnel: WindTunnel) -> LinearModel:
    return linearise(tunnel, trim_in_tunnel(tunnel, airspeed_m_s=25.0))


def test_modes(model: LinearModel, book) -> None:  # type: ignore[no-untyped-def]
    roots = book.modes(25.0)
    ours: dict[str, Mode] = {
        "short period": model.short_period,
        "phugoid": model.phugoid,
        "Dutch roll": model.dutch_roll,
        "roll": model.roll,
        "spiral": model.spiral,
    }
    for name, mode in ours.items():
        root = roots[name]
        assert mode.time_constant_s == pytest.approx(-1.0 / root.real, rel=0.01), name
        if root.imag:
            assert mode.frequency_rad_s == pytest.approx(abs(root), rel=0.01), name


def test_stall_speed_and_glide(tunnel: WindTunnel, book) -> None:  # type: ignore[no-untyped-def]
    envelope = flight_envelope("aerosonde")
    to_true = tunnel.true_airspeed_m_s(1.0)
    assert envelope.stall_speed_m_s * to_true == pytest.approx(book.stall_speed(), rel=0.015)
    speed, ratio = book.best_glide(envelope.airspeed_min_m_s * to_true)
    assert envelope.glide_ratio == pytest.approx(ratio, rel=0.01)
    assert envelope.best_glide_speed_m_s * to_true == pytest.approx(speed, rel=0.05)


@pytest.mark.parametrize(
    "alpha_deg", [-60.0, -27.0, -10.0, 5.0, 11.0, 12.0, 20.0, 25.0, 27.0, 30.0, 45.0, 70.0]
)
def test_lift_and_drag_through_the_stall(tunnel: WindTunnel, book, alpha_deg: float) -> None:  # type: ignore[no-untyped-def]
    """The book's lift at any angle of attack, its drag up to the stall, the flat plate's beyond."""
    alpha, speed = math.radians(alpha_deg), 20.0
    tunnel.measure(FlightState(vel_frd_m_s=(speed * math.cos(alpha), 0.0, speed * math.sin(alpha))))
    force_lb = 0.5 * tunnel.density_kg_m3 * speed**2 * tunnel.wing_area_m2 / 4.4482216
    lift, drag = tunnel.value("aero/lift-lbs") / force_lb, tunnel.value("aero/drag-lbs") / force_lb
    assert lift == pytest.approx(book.lift(alpha), abs=2e-3)
    if abs(alpha_deg) <= 20.0:
        assert drag == pytest.approx(book.drag(alpha), rel=2e-3)
    elif abs(alpha_deg) >= 45.0:
        assert drag == pytest.approx(0.043 + 2.0 * abs(math.sin(alpha)) ** 3, rel=2e-3)


def test_lift_peaks_at_the_stall(tunnel: WindTunnel, book) -> None:  # type: ignore[no-untyped-def]
    """C_L rises to 2.5 at 24 degrees and has halved by 30."""
    lifts = {deg: book.lift(math.radians(deg)) for deg in range(0, 46)}
    peak = max(lifts, key=lambda deg: lifts[deg])
    assert 22 <= peak <= 26
    assert lifts[30] < 0.5 * lifts[peak]


@pytest.mark.parametrize("throttle", [0.2, 0.6, 1.0])
@pytest.mark.parametrize("speed_m_s", [1.0, 15.0, 30.0])
def test_propeller(tunnel: WindTunnel, book, throttle: float, speed_m_s: float) -> None:  # type: ignore[no-untyped-def]
    """Thrust of the settled motor, braking included."""
    commands = [0.0] * MAX_ACTUATORS
    commands[THROTTLE] = throttle
    tunnel.measure(FlightState(vel_frd_m_s=(speed_m_s, 0.0, 0.0), actuators=tuple(commands)))
    thrust, torque = book.propeller(speed_m_s, throttle)
    assert tunnel.value("rotor/thrust-N") == pytest.approx(thrust, rel=2e-3, abs=0.02)
    assert tunnel.value("motor/torque-Nm") == pytest.approx(torque, rel=2e-3, abs=2e-3)


def test_a_stronger_elevator_makes_a_lower_stall_speed(tunnel: WindTunnel) -> None:
    """It is the elevator that sets it, at 45 degrees, before the wing stalls."""
    slowest = trim_in_tunnel(tunnel, airspeed_m_s=14.2, throttle=0.0)
    assert 0.9 < slowest.actuators[ELEVATOR] <= 1.0
    assert slowest.angle_of_attack_rad < 0.4
    assert np.isfinite(slowest.current_a)


def test_the_command_prints_the_table(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["aerosonde_book.py"])
    assert load("aerosonde_book").main() == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "78 figures, 0 off"
    assert sum("straight" in line for line in lines) == 18
    for mode in ("short period", "phugoid", "Dutch roll", "roll, 25", "spiral"):
        assert any(mode in line for line in lines)
