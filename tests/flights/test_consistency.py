"""The navigation filter's covariance describes its errors, over the whole stack and many seeds."""

import numpy as np
import pytest
from scipy.stats import chi2

from tests.flights.consistency import PARTS, Case, fly_consistency
from tests.flights.flight import FLAVOURS
from tests.slow import slow

DEFAULTS = [
    ("px4", Case(), 2),
    ("ardupilot", Case(gps="standalone"), 2),
    *(
        slow(flavour, Case(gps=gps, spoiled=spoiled), 20)
        for flavour in FLAVOURS
        for gps in ("differential", "standalone")
        for spoiled in (False, True)
    ),
]


@pytest.mark.parametrize(("flavour", "case", "seeds"), DEFAULTS)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_the_firmwares_defaults_cover_the_errors(flavour: str, case: Case, seeds: int) -> None:
    """NEES may lie below its 95 % band, because the defaults are wide, but not above it; with a receiver that
    is as exact as in the firmwares' simulators, the errors are decimetres."""
    runs = [fly_consistency(seed, flavour=flavour, case=case) for seed in range(seeds)]
    high = chi2.ppf(0.975, 3 * seeds) / seeds
    assert (np.mean([run.nees.mean(axis=0) for run in runs], axis=0) < high).all()
    rms = np.sqrt([(run.errors**2).mean(axis=0) for run in runs])
    attitude_deg = np.degrees(np.linalg.norm(rms[:, PARTS["attitude"]], axis=1))
    velocity_m_s = np.linalg.norm(rms[:, PARTS["velocity"]], axis=1)
    assert attitude_deg.max() < 3.5 and velocity_m_s.max() < 0.3
    if case == Case():
        position_m = np.linalg.norm(rms[:, PARTS["position"]], axis=1)
        assert position_m.max() < 1.5
        assert np.sqrt((position_m**2).mean()) < 0.5  # required: 1.5 m
        assert np.sqrt((attitude_deg**2).mean()) < 1.0  # required: 1.5 deg
