"""A part of the campaign that `benchmarks/fuzz_services.py` runs at length."""

import pytest

from tests.fuzz.campaign import LONGEST_S, Campaign
from tests.slow import slow


@pytest.mark.parametrize(
    ("flavour", "model"),
    [("px4", "aerosonde"), ("ardupilot", "iris"), slow("px4", "iris"), slow("ardupilot", "aerosonde")],
)
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_what_is_no_order_moves_nothing(flavour: str, model: str) -> None:
    figures = Campaign(flavour, model, 1).one_round(800, orders=False)
    assert figures.complaints == []
    assert figures.messages >= 800
    assert figures.answers_bytes > 2_000
    assert figures.longest_s < LONGEST_S


@pytest.mark.parametrize(
    ("flavour", "model"),
    [("px4", "iris"), ("ardupilot", "aerosonde"), slow("px4", "aerosonde"), slow("ardupilot", "iris")],
)
@pytest.mark.sampled(1)
def test_absurd_orders_are_borne(flavour: str, model: str) -> None:
    figures = Campaign(flavour, model, 2).one_round(250, orders=True)
    assert figures.complaints == []
    assert figures.messages >= 250


@pytest.mark.slow
def test_the_same_seed_fires_the_same() -> None:
    first, second = (Campaign("px4", "iris", 3).one_round(300, orders=True) for _ in range(2))
    assert (first.messages, first.answers_bytes) == (second.messages, second.answers_bytes)
