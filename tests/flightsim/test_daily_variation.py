"""The field's variation in time, and targets that drift."""

import numpy as np
import pytest

from flightsim.home import Home
from flightsim.payload import (
    DailyVariation,
    DailyVariationParameters,
    DipoleSignature,
    GaussianSignature,
    InducedDipole,
    MagneticField,
    MagneticMap,
    MagneticSpec,
    magnetic_field_of,
)

HOME = Home()


def variation(seed=1, **values):
    return DailyVariation(DailyVariationParameters(**values), np.random.SeedSequence(seed))


def test_the_field_dips_at_noon_and_comes_back():
    quiet = variation(dip_nt=30.0, boot_h=6.0, pulsation_nt=0.0)
    hours = np.arange(0.0, 24.0, 0.5)
    values = np.array([quiet.at_nt(3600.0 * h) for h in hours])
    assert values.min() == pytest.approx(-30.0)
    assert hours[int(np.argmin(values))] == 6.0
    assert quiet.at_nt(0.0) == pytest.approx(quiet.at_nt(86_400.0))
    assert values[30] > -1.0  # at night


def test_pulsations_have_their_size_and_minutes():
    sizes = []
    for seed in range(6):
        one = variation(seed, dip_nt=0.0, pulsation_nt=0.7)
        values = np.array([one.at_nt(t) for t in np.arange(0.0, 40_000.0, 10.0)])
        sizes.append(values.std())
        assert np.abs(np.diff(values)).max() < 10.0 * 2.0 * np.pi / 60.0 * 0.7 * 4.0
    assert np.mean(sizes) == pytest.approx(0.7, rel=0.05)


def plain(signatures=(), daily=None):
    lines = np.array([-5000.0, 5000.0])
    total = np.full((2, 2), 48_000.0)
    grid = MagneticMap(north_m=lines, east_m=lines, total_field_nt=total, height_m=80.0, home=HOME)
    return MagneticField(grid, signatures, daily=daily)


@pytest.mark.parametrize("kind", ["gaussian", "dipole"])
def test_a_target_that_drifts_is_where_it_has_drifted_to(kind):
    def target(north_m, east_m, velocity):
        if kind == "gaussian":
            return GaussianSignature(north_m=north_m, east_m=east_m, velocity_ne_m_s=velocity)
        return DipoleSignature(
            north_m=north_m, east_m=east_m, height_m=-5.0, moment_ned_a_m2=(1e4, 0.0, 5e4),
            velocity_ne_m_s=velocity,
        )  # fmt: skip

    drifting, still = plain([target(100.0, -50.0, (1.5, -0.5))]), plain([target(250.0, -100.0, (0.0, 0.0))])
    for place in ((250.0, -100.0), (200.0, 30.0), (100.0, -50.0)):
        assert drifting.total_nt(*place, 80.0, 100.0) == pytest.approx(still.total_nt(*place, 80.0))
    assert drifting.total_nt(100.0, -50.0, 80.0) > 48_001.0


def test_a_world_has_both_and_one_seed_makes_one_of_them():
    spec = MagneticSpec(
        exact_map=True,
        daily=DailyVariationParameters(),
        signatures=(
            InducedDipole(north_m=0.0, east_m=0.0, moment_a_m2=1e5, velocity_ne_m_s=(1.0, 0.0)),
        ),
    )  # fmt: skip
    (first, published), (again, _), (other, _) = (
        magnetic_field_of(spec, home=HOME, seed=seed, decimal_year=2026.0) for seed in (1, 1, 2)
    )
    assert first.total_nt(0.0, 0.0, 100.0, 60.0) == again.total_nt(0.0, 0.0, 100.0, 60.0)
    assert first.total_nt(0.0, 0.0, 100.0, 60.0) != other.total_nt(0.0, 0.0, 100.0, 60.0)
    # far from the target the map is the field but for the time of day
    off_nt = first.total_nt(800.0, 800.0, 100.0, 0.0) - published.total_at_nt(800.0, 800.0)
    assert -30.0 < off_nt < -5.0


def test_impossible_values_are_refused():
    with pytest.raises(ValueError, match="boot_h = 24"):
        DailyVariationParameters(boot_h=24.0)
    with pytest.raises(ValueError, match="velocity_ne_m_s"):
        GaussianSignature(north_m=0.0, east_m=0.0, velocity_ne_m_s=(30.0, 0.0))
