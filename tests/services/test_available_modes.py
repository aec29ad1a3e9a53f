"""AVAILABLE_MODES: one mode by its number, or all of them (standard modes protocol)."""

import pytest

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.services.commands.available_modes import AvailableModes, ListedMode
from tests.services.command_rig import Channel

MODES = (
    ListedMode(65_536, "Manual", 0, dialect.MAV_MODE_PROPERTY_ADVANCED),
    ListedMode(
        84_148_224, "", dialect.MAV_STANDARD_MODE_SAFE_RECOVERY, dialect.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE
    ),
    ListedMode(50_593_792, "Hold", 0, 0),
)


def requested(index: float) -> list[tuple[int, int, int, int, int, str]]:
    channel = Channel()
    AvailableModes(MODES).on_demand[dialect.MAVLINK_MSG_ID_AVAILABLE_MODES](channel, index)
    return [
        (
            sent.number_modes,
            sent.mode_index,
            sent.standard_mode,
            sent.custom_mode,
            sent.properties,
            sent.mode_name,
        )
        for sent in channel.sent
    ]


ALL = [
    (3, 1, 0, 65_536, dialect.MAV_MODE_PROPERTY_ADVANCED, "Manual"),
    (
        3,
        2,
        dialect.MAV_STANDARD_MODE_SAFE_RECOVERY,
        84_148_224,
        dialect.MAV_MODE_PROPERTY_NOT_USER_SELECTABLE,
        "",
    ),
    (3, 3, 0, 50_593_792, 0, "Hold"),
]


@pytest.mark.parametrize(
    ("index", "sent"), [(0, ALL), (1, ALL[:1]), (2, ALL[1:2]), (3, ALL[2:]), (4, []), (-1, []), (1.5, [])]
)
def test_modes_are_numbered_from_one(index: float, sent: list[tuple[int, ...]]) -> None:
    assert requested(index) == sent
