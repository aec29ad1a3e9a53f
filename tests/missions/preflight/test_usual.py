"""How well measurements fit is judged by several of them."""

from missions.preflight.snapshot import usual


def test_one_bad_measurement_does_not_count() -> None:
    reported = [{"flags": k, "compass_variance": value} for k, value in enumerate((0.2, 0.3, 0.9))]
    assert usual(reported) == {"flags": 2, "compass_variance": 0.3}


def test_what_stays_bad_does() -> None:
    reported = [{"mag_ratio": value} for value in (0.9, 0.1, 1.2, 1.1)]
    assert usual(reported)["mag_ratio"] == 1.1
