"""Rotary gusts against the spectra of MIL-F-8785C, and as a model's aerodynamics feel them."""

import math

import numpy as np
import pytest
from scipy.signal import welch

from flightsim import truth as t
from flightsim.airframe import load_airframe
from flightsim.environment import Environment, Turbulence
from flightsim.foundation.rotations import quaternion_from_euler
from flightsim.home import Home
from flightsim.initial_state import InitialState, initialise
from flightsim.interface import MAX_ACTUATORS
from flightsim.jsbsim_model import ROTARY_GUSTS, load_fdm
from flightsim.rotary_gusts import RotaryGusts, advance_rotary, roll_gust_sigma_rad_s
from flightsim.turbulence import BLOCK_STEPS, DrydenTurbulence, advance_turbulence
from flightsim.vehicle import Vehicle

SPAN_M, AIRSPEED_M_S, HEIGHT_M = 2.9, 20.0, 40.0


def advance(
    rotary: RotaryGusts, normal: float, scales: np.ndarray, gust: np.ndarray, q: np.ndarray, out: np.ndarray
) -> None:
    """A step at the airspeed of these tests."""
    constants, state, work = rotary.constants, rotary.state, rotary.work
    advance_rotary(constants, state, normal, AIRSPEED_M_S, scales, gust, q, work, out)


def fly(
    steps: int, dt_s: float, seed: int, roll_rad: float = 0.0, yaw_rad: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(velocities NED, rates FRD, scales) of an aircraft in wind from the south."""
    source = np.random.SeedSequence(seed)
    air = DrydenTurbulence(
        wind_at_20_ft_m_s=15.0, wind_ned_m_s=(1.0, 0.0, 0.0), dt_s=dt_s, seed_sequence=source
    )
    rotary = RotaryGusts(span_m=SPAN_M, dt_s=dt_s, seed_sequence=source)
    q = np.empty(4)
    quaternion_from_euler(roll_rad, 0.0, yaw_rad, q)
    velocities, rates = np.empty((steps, 3)), np.empty((steps, 3))
    for i in range(steps):
        row = i % BLOCK_STEPS
        if row == 0:
            air.draw()
            rotary.draw()
        noise, gust = air.normals[row], velocities[i]
        advance_turbulence(air.constants, air.state, noise, HEIGHT_M, AIRSPEED_M_S, air.scales, gust)
        advance(rotary, rotary.normals[row], air.scales, gust, q, rates[i])
    return velocities, rates, air.scales


def test_spectra() -> None:
    """One-sided spectra over f (Hz): 2 pi / V of those over the spatial frequency W = 2 pi f / V.

    p_g is by the formula of the standard; q_g and r_g have W^2 / (1 + (4 b W / pi)^2) and
    W^2 / (1 + (3 b W / pi)^2) of the spectra of the velocities that were flown through.
    """
    dt_s = 0.01
    velocities, rates, scales = fly(120_000, dt_s, seed=4)
    f, measured = welch(rates, fs=1.0 / dt_s, nperseg=2048, axis=0)
    _, velocity = welch(velocities, fs=1.0 / dt_s, nperseg=2048, axis=0)
    spatial = 2.0 * math.pi * f / AIRSPEED_M_S
    length_w_m, sigma_w_m_s = scales[1], scales[3]
    flat = 0.8 * sigma_w_m_s**2 / length_w_m * (math.pi * length_w_m / (4.0 * SPAN_M)) ** (1.0 / 3.0)
    expected = (
        2.0 * math.pi / AIRSPEED_M_S * flat / (1.0 + (4.0 * SPAN_M * spatial / math.pi) ** 2),
        velocity[:, 2] * spatial**2 / (1.0 + (4.0 * SPAN_M * spatial / math.pi) ** 2),
        velocity[:, 1] * spatial**2 / (1.0 + (3.0 * SPAN_M * spatial / math.pi) ** 2),
    )
    band = np.flatnonzero((f > 0.1) & (f < 5.0))
    for axis, spectrum in enumerate(expected):
        for part in np.array_split(band, 5):
            ratio = np.mean(measured[part, axis]) / np.mean(spectrum[part])
            assert ratio == pytest.approx(1.0, abs=0.12), ("pqr"[axis], f[part[0]])
    sigma = roll_gust_sigma_rad_s(sigma_w_m_s, length_w_m, SPAN_M)
    assert rates[:, 0].std() == pytest.approx(sigma, rel=0.05)
    assert 0.1 < sigma < 0.3


def test_air_that_sinks_more_ahead_turns_nose_down_and_air_to_the_right_ahead_turns_right() -> None:
    """q_g = -dw/dx, r_g = dv/dx: a rigid rotation (p, q, r) moves the air at x ahead by (0, r x, -q x)."""
    slope_1_s, dt_s, q_level = 0.1, 0.004, np.array([1.0, 0.0, 0.0, 0.0])
    rotary = RotaryGusts(span_m=SPAN_M, dt_s=dt_s, seed_sequence=np.random.SeedSequence(1))
    calm, rates = np.array([100.0, 30.0, 0.0, 0.0]), np.zeros(3)
    for i in range(1000):
        x_m = AIRSPEED_M_S * dt_s * i
        gust = np.array([0.0, slope_1_s * x_m, slope_1_s * x_m])
        advance(rotary, 0.0, calm, gust, q_level, rates)
    np.testing.assert_allclose(rates, [0.0, -slope_1_s, slope_1_s], rtol=0.02, atol=1e-12)


def test_the_field_of_air_turns_with_heading_and_bank_of_the_vehicle_not_with_itself() -> None:
    _, level, _ = fly(300, 0.004, seed=5)
    _, banked, _ = fly(300, 0.004, seed=5, roll_rad=0.7)
    np.testing.assert_allclose(banked[:, 0], level[:, 0], atol=1e-12)
    c, s = math.cos(0.7), math.sin(0.7)
    np.testing.assert_allclose(banked[:, 1], c * level[:, 1] + s * level[:, 2], atol=1e-12)
    np.testing.assert_allclose(banked[:, 2], -s * level[:, 1] + c * level[:, 2], atol=1e-12)


@pytest.mark.parametrize("model", ["aerosonde", "c172x", "j3cub", "t37", "sgs126"])
def test_air_that_turns_acts_as_a_vehicle_that_turns_the_other_way(model: str) -> None:
    airframe = load_airframe(model)
    fdm, warnings = load_fdm(airframe, 250)
    assert not warnings

    def moments(rate_rad_s: np.ndarray, gust_rad_s: np.ndarray) -> np.ndarray:
        start = InitialState(
            height_m=100.0,
            vel_ned_m_s=(airframe.limits.airspeed_trim_m_s, 0.0, 1.0),
            yaw_rad=0.0,
            rates_frd_rad_s=tuple(rate_rad_s),
        )
        for name, value in zip(ROTARY_GUSTS, gust_rad_s, strict=True):
            fdm.set_property_value(name, value)
        initialise(fdm, airframe, Home(), Environment(), start)
        fdm.suspend_integration()
        fdm.run()
        fdm.resume_integration()
        return np.array([fdm.get_property_value(f"moments/{axis}-aero-lbsft") for axis in "lmn"])

    still = moments(np.zeros(3), np.zeros(3))
    for axis in range(3):
        rate = np.zeros(3)
        rate[axis] = 0.2
        turning = moments(rate, np.zeros(3)) - still
        gusty = moments(np.zeros(3), -rate) - still
        if (
            axis == 1 and model != "aerosonde"
        ):  # pitching in place has an angle-of-attack rate, which damps too
            assert 0.3 < gusty[1] / turning[1] < 1.0
        else:
            assert abs(turning[axis]) > 0.0
            np.testing.assert_allclose(gusty, turning, rtol=0.02, atol=0.02 * np.abs(turning).max())


def test_turbulence_turns_the_air_around_an_aircraft() -> None:
    spread = {}
    for turbulence in ("moderate", "none"):
        vehicle = Vehicle(
            "aerosonde",
            home=Home(),
            environment=Environment(turbulence=turbulence),  # type: ignore[arg-type]
            seed_sequence=np.random.SeedSequence(4),
            initial=InitialState(height_m=100.0, vel_ned_m_s=(25.0, 0.0, 0.0), yaw_rad=0.0),
        )
        rates = np.empty((500, 3))
        for i in range(500):
            vehicle.step(np.zeros(MAX_ACTUATORS))
            rates[i] = [vehicle._fdm.get_property_value(name) for name in ROTARY_GUSTS]
        spread[turbulence] = rates.std(axis=0)
    assert np.all(spread["moderate"] > 0.03), spread
    assert not np.any(spread["none"])
    rolling = Vehicle(
        "iris",
        home=Home(),
        environment=Environment(turbulence="moderate"),  # type: ignore[arg-type]
        seed_sequence=np.random.SeedSequence(4),
    )
    assert rolling._air._rotary.constants[0] == 0.0  # a rotor span is small against every scale length


def test_gusts_that_begin_around_an_aircraft_at_rest_in_calm_air() -> None:
    """It has no airspeed to divide the rates by."""
    vehicle = Vehicle(
        "aerosonde",
        home=Home(),
        environment=Environment(turbulence=Turbulence.SEVERE),
        seed_sequence=np.random.SeedSequence(1),
    )
    for _ in range(100):
        vehicle.step(np.zeros(MAX_ACTUATORS))
    assert np.linalg.norm(vehicle.truth[t.RATES_FRD_RAD_S]) < 1.0
