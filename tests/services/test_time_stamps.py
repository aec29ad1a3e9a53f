"""Time stamps of other computers: taken within half a second, else the time of arrival counts."""

import pytest

from autopilot_bridge.services.inputs.timesync import in_vehicle_time

NOW_US = 60_000_000


@pytest.mark.parametrize(
    ("age_us", "taken"),
    [
        (0, True),
        (499_999, True),
        (500_000, True),
        (500_001, False),
        (-20_000, True),
        (-20_001, False),
        (NOW_US, False),
        (-1_000_000_000_000, False),
    ],
)
def test_a_stamp_of_another_clock_is_not_taken(age_us: int, taken: bool) -> None:
    stamp_us = NOW_US - age_us
    assert in_vehicle_time(stamp_us, NOW_US) == (stamp_us if taken else NOW_US)
