"""Dryden turbulence against the spectra and scales of MIL-F-8785C."""

import math

import numpy as np
import pytest
from scipy.signal import welch

from flightsim import truth as t
from flightsim.environment import Environment
from flightsim.interface import MAX_ACTUATORS
from flightsim.turbulence import BLOCK_STEPS, DrydenTurbulence, advance_turbulence, low_altitude_scales
from flightsim.world import World, WorldParameters

FT = 0.3048
OFF = np.zeros(MAX_ACTUATORS)


def turbulence(
    seed: int, dt_s: float = 0.1, wind: tuple[float, float, float] = (1.0, 0.0, 0.0)
) -> DrydenTurbulence:
    return DrydenTurbulence(
        wind_at_20_ft_m_s=15.0, wind_ned_m_s=wind, dt_s=dt_s, seed_sequence=np.random.SeedSequence(seed)
    )


def record(source: DrydenTurbulence, steps: int, height_m: float, airspeed_m_s: float) -> np.ndarray:
    samples = np.empty((steps, 3))
    for i in range(steps):
        row = i % BLOCK_STEPS
        if row == 0:
            source.draw()
        noise, scales = source.normals[row], source.scales
        advance_turbulence(source.constants, source.state, noise, height_m, airspeed_m_s, scales, samples[i])
    return samples


@pytest.mark.parametrize("height_ft", [20.0, 100.0, 500.0, 1000.0])
def test_low_altitude_scales(height_ft: float) -> None:
    """MIL-F-8785C, figures 10 and 11; at 1000 ft all scales are 1000 ft and all intensities 0.1 W20."""
    out = np.zeros(4)
    low_altitude_scales(height_ft * FT, 15.0, out)
    base = 0.177 + 0.000823 * height_ft
    assert out[0] == pytest.approx(height_ft / base**1.2 * FT)
    assert out[1] == pytest.approx(height_ft * FT)
    assert out[3] == pytest.approx(1.5)
    assert out[2] == pytest.approx(1.5 / base**0.4)
    if height_ft == 1000.0:
        np.testing.assert_allclose(out, [1000.0 * FT, 1000.0 * FT, 1.5, 1.5], rtol=1e-9)


def test_variance_and_spectrum() -> None:
    """One-sided spectra over frequency f (Hz), T = L/V, w = 2 pi f:

    u: 4 sigma^2 T / (1 + (T w)^2); v, w: 2 sigma^2 T (1 + 3 (T w)^2) / (1 + (T w)^2)^2.
    """
    height_m, airspeed_m_s, dt_s = 30.0, 10.0, 0.2
    samples = record(turbulence(4, dt_s), 150_000, height_m, airspeed_m_s)
    scales = np.zeros(4)
    low_altitude_scales(height_m, 15.0, scales)
    time_u, time_w = scales[0] / airspeed_m_s, scales[1] / airspeed_m_s
    np.testing.assert_allclose(samples.std(axis=0), [scales[2], scales[2], scales[3]], rtol=0.06)
    assert np.all(np.abs(samples.mean(axis=0)) < 0.25 * scales[2])
    cross = np.corrcoef(samples.T)
    assert np.max(np.abs(cross - np.eye(3))) < 0.06

    def along(f: np.ndarray, sigma: float, time: float) -> np.ndarray:
        return 4.0 * sigma**2 * time / (1.0 + (2.0 * math.pi * f * time) ** 2)

    def across(f: np.ndarray, sigma: float, time: float) -> np.ndarray:
        x = (2.0 * math.pi * f * time) ** 2
        return 2.0 * sigma**2 * time * (1.0 + 3.0 * x) / (1.0 + x) ** 2

    expected = (
        lambda f: along(f, scales[2], time_u),
        lambda f: across(f, scales[2], time_u),
        lambda f: across(f, scales[3], time_w),
    )
    for axis, spectrum in enumerate(expected):
        f, measured = welch(samples[:, axis], fs=1.0 / dt_s, nperseg=2048)
        band = (f > 0.005) & (f < 0.5)  # away from the window's leakage and from aliasing
        for part in np.array_split(np.flatnonzero(band), 8):
            ratio = np.mean(measured[part]) / np.mean(spectrum(f[part]))
            assert ratio == pytest.approx(1.0, abs=0.15), (axis, f[part[0]])


def test_statistics_do_not_depend_on_the_step() -> None:
    """The filters are discretised exactly, so a step 100 times finer has the same correlation over 0.2 s."""
    fine = record(turbulence(5, 0.002), 150_000, 5.0, 20.0)
    scales = np.zeros(4)
    low_altitude_scales(5.0, 15.0, scales)
    lag = 100
    u = fine[:, 0]
    measured = np.mean(u[lag:] * u[:-lag]) / np.mean(u * u)
    assert measured == pytest.approx(math.exp(-lag * 0.002 * 20.0 / scales[0]), abs=0.03)
    assert fine[:, 2].std() == pytest.approx(scales[3], rel=0.1)


def test_longitudinal_axis_follows_the_wind() -> None:
    north = record(turbulence(6, wind=(3.0, 0.0, 0.0)), 100, 30.0, 5.0)
    east = record(turbulence(6, wind=(0.0, 3.0, 0.0)), 100, 30.0, 5.0)
    np.testing.assert_allclose(east[:, 1], north[:, 0], atol=1e-12)
    np.testing.assert_allclose(east[:, 0], -north[:, 1], atol=1e-12)


def turbulent_world(seed: int) -> World:
    return World(
        WorldParameters(
            seed=seed, environment=Environment(wind_ned_m_s=(5.0, 0.0, 0.0), turbulence="moderate")
        )  # type: ignore[arg-type]
    )


def winds(world: World, index: int, steps: int) -> np.ndarray:
    out = np.empty((steps, 3))
    for i in range(steps):
        for vehicle in world.vehicles:
            vehicle.step(OFF)
        out[i] = world.vehicles[index].truth[t.WIND_NED_M_S]
    return out


def test_seed_makes_the_turbulence_and_vehicles_have_their_own() -> None:
    worlds = [turbulent_world(seed) for seed in (3, 3, 4)]
    for world in worlds:
        world.add_vehicle()
    alone, same, other = (winds(world, 0, 300) for world in worlds)
    pair = turbulent_world(3)
    pair.add_vehicle()
    pair.add_vehicle(offset_ne_m=(0.0, 5.0))
    first = winds(pair, 0, 300)
    assert alone.tobytes() == same.tobytes() == first.tobytes()
    assert not np.allclose(alone, other)
    assert not np.allclose(alone[-1], pair.vehicles[1].truth[t.WIND_NED_M_S])
    assert alone.std(axis=0).min() > 0.05
