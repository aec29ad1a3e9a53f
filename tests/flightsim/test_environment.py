"""Parameters of the air, and the air as JSBSim delivers it: standard atmosphere, wind, gusts."""

import math

import numpy as np
import pytest

from flightsim import truth as t
from flightsim.environment import CosineGust, Environment, Turbulence
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.interface import MAX_ACTUATORS
from flightsim.vehicle import Vehicle

OFF = np.zeros(MAX_ACTUATORS)


def make(environment: Environment, home: Home | None = None, initial: InitialState | None = None) -> Vehicle:
    return Vehicle(
        home=home or Home(), environment=environment, seed_sequence=np.random.SeedSequence(1), initial=initial
    )


@pytest.mark.parametrize(
    ("from_deg", "expected"),
    [(0.0, (-7.0, 0.0)), (90.0, (0.0, -7.0)), (180.0, (7.0, 0.0)), (270.0, (0.0, 7.0))],
)
def test_wind_is_named_by_where_it_comes_from(from_deg: float, expected: tuple[float, float]) -> None:
    wind = Environment.from_wind(speed_m_s=7.0, from_deg=from_deg).wind_ned_m_s
    np.testing.assert_allclose(wind, (*expected, 0.0), atol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"wind_ned_m_s": (math.nan, 0.0, 0.0)}, "finite"),
        ({"wind_ned_m_s": (80.0, 0.0, 0.0)}, r"80.*60"),
        ({"turbulence": "mild"}, "none, light, moderate, severe"),
        ({"temperature_offset_k": 100.0}, r"-60\.\.60"),
        ({"decimal_year": 2020.0}, r"2020.*2025\.0 to 2030\.0"),
        (
            {
                "gusts": (
                    CosineGust(start_s=1.0, velocity_ned_m_s=(1.0, 0.0, 0.0)),
                    CosineGust(start_s=2.0, velocity_ned_m_s=(1.0, 0.0, 0.0)),
                )
            },
            "one after the other",
        ),
    ],
)
def test_bad_parameters_are_named(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Environment(**arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("arguments", [{"start_s": -1.0}, {"start_s": 0.0, "rise_s": 0.0}])
def test_bad_gusts_are_refused(arguments: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="gust"):
        CosineGust(velocity_ned_m_s=(1.0, 0.0, 0.0), **arguments)


def test_turbulence_by_name() -> None:
    assert Environment(turbulence="moderate").turbulence is Turbulence.MODERATE  # type: ignore[arg-type]
    assert Turbulence.MODERATE.wind_at_20_ft_m_s == pytest.approx(15.433, abs=1e-3)


@pytest.mark.parametrize("alt_m", [0.0, 488.0, 1500.0, 4000.0])
def test_standard_atmosphere(alt_m: float) -> None:
    """ISO 2533: T = 288.15 K - 6.5 K/km H, p = 101325 (T / 288.15)^5.25588, H the geopotential height."""
    truth = make(Environment(), Home(alt_m=alt_m)).truth
    height_m = truth[t.ALT_M]
    geopotential_m = 6356766.0 * height_m / (6356766.0 + height_m)
    temperature_k = 288.15 - 0.0065 * geopotential_m
    pressure_pa = 101325.0 * (temperature_k / 288.15) ** 5.255876
    assert height_m == pytest.approx(alt_m + 0.1, abs=0.01)
    assert truth[t.TEMPERATURE_K] == pytest.approx(temperature_k, abs=0.01)
    assert truth[t.PRESSURE_PA] == pytest.approx(pressure_pa, rel=5e-5)
    assert truth[t.DENSITY_KG_M3] == pytest.approx(pressure_pa / (287.053 * temperature_k), rel=2e-4)


def test_temperature_offset_thins_the_air() -> None:
    cold, hot = make(Environment()).truth, make(Environment(temperature_offset_k=20.0)).truth
    assert hot[t.TEMPERATURE_K] - cold[t.TEMPERATURE_K] == pytest.approx(20.0, abs=0.01)
    expected = hot[t.PRESSURE_PA] / (287.053 * hot[t.TEMPERATURE_K])
    assert hot[t.DENSITY_KG_M3] == pytest.approx(expected, rel=2e-4)


def test_steady_wind_reaches_truth_and_airspeed() -> None:
    vehicle = make(Environment(wind_ned_m_s=(3.0, -4.0, 0.5)))
    vehicle.step(OFF)
    np.testing.assert_allclose(vehicle.truth[t.WIND_NED_M_S], (3.0, -4.0, 0.5), atol=1e-9)
    assert vehicle.truth[t.AIRSPEED_TRUE_M_S] == pytest.approx(math.hypot(3.0, 4.0, 0.5), abs=1e-3)


def test_falling_body_takes_up_the_wind() -> None:
    """Level and without rotors: du/dt = k (w - u)^2 has the solution u = w - w / (1 + w k t)."""
    wind_m_s, seconds = 10.0, 4.0
    vehicle = make(Environment(wind_ned_m_s=(wind_m_s, 0.0, 0.0)), initial=InitialState(height_m=300.0))
    density = vehicle.truth[t.DENSITY_KG_M3]
    for _ in range(round(250 * seconds)):
        vehicle.step(OFF)
    k = 0.5 * 0.5 * (density + vehicle.truth[t.DENSITY_KG_M3]) * 0.025 / 1.5
    assert vehicle.truth[3] == pytest.approx(wind_m_s - wind_m_s / (1.0 + wind_m_s * k * seconds), rel=0.01)


def test_cosine_gust_has_its_profile() -> None:
    gust = CosineGust(start_s=0.5, velocity_ned_m_s=(3.0, 4.0, 0.0), rise_s=1.0, hold_s=0.5, fall_s=0.8)
    again = CosineGust(start_s=3.0, velocity_ned_m_s=(0.0, -2.0, 0.0), rise_s=0.2, hold_s=0.0, fall_s=0.2)
    vehicle = make(Environment(wind_ned_m_s=(0.0, 1.0, 0.0), gusts=(gust, again)))
    wind = []
    for _ in range(900):
        vehicle.step(OFF)
        wind.append(vehicle.truth[t.WIND_NED_M_S].copy())
    times_s = np.arange(900) * 0.004  # the gust of a step is that at its beginning
    np.testing.assert_allclose(
        wind,
        [
            profile(gust, s) * np.array(gust.velocity_ned_m_s)
            + profile(again, s) * np.array(again.velocity_ned_m_s)
            + (0.0, 1.0, 0.0)
            for s in times_s
        ],
        atol=0.03,
    )
    assert np.linalg.norm(wind[450] - np.array([0.0, 1.0, 0.0])) == pytest.approx(5.0, abs=1e-6)


def profile(gust: CosineGust, time_s: float) -> float:
    s = time_s - gust.start_s
    if 0.0 <= s < gust.rise_s:
        return 0.5 * (1.0 - math.cos(math.pi * s / gust.rise_s))
    s -= gust.rise_s
    if 0.0 <= s < gust.hold_s:
        return 1.0
    s -= gust.hold_s
    return 0.5 * (1.0 + math.cos(math.pi * s / gust.fall_s)) if 0.0 <= s < gust.fall_s else 0.0
