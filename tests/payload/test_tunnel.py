"""TUNNEL payloads: the tables in the docs are those of the declarations, and what a declaration can say."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import pytest

from autopilot_bridge.mavlink.camera_scan import CAMERA_SCAN
from autopilot_bridge.mavlink.handoff_messages import DECISION, DESIGNATION, TRACK, TRACK_REPORT
from autopilot_bridge.mavlink.moving_points import MOVING_POINTS
from autopilot_bridge.mavlink.search_likelihood import SEARCH_LIKELIHOOD
from autopilot_bridge.mavlink.target_scan import SCAN_END, TARGET_DETECTION
from autopilot_bridge.mavlink.tunnel import Many, Record, Tunnel, Wire, docs_table, flag
from autopilot_bridge.mavlink.vehicle_motion import VEHICLE_MOTION
from autopilot_bridge.mavlink.vehicle_range import VEHICLE_RANGE

PAGES = Path(__file__).parents[2] / "docs" / "mavlink"
PAYLOADS: dict[str, tuple[Tunnel[Any] | Record[Any], ...]] = {
    "camera_scan": (CAMERA_SCAN,),
    "handoff": (VEHICLE_MOTION, TRACK, TRACK_REPORT, DECISION, DESIGNATION),
    "moving_points": (MOVING_POINTS,),
    "search_likelihood": (SEARCH_LIKELIHOOD,),
    "target_scan": (TARGET_DETECTION, SCAN_END),
    "vehicle_range": (VEHICLE_RANGE,),
}


@pytest.mark.parametrize("page", PAYLOADS)
def test_the_docs_have_the_tables_of_the_declarations(page: str) -> None:
    text = (PAGES / f"{page}.md").read_text(encoding="utf-8")
    for payload in PAYLOADS[page]:
        assert docs_table(payload) in text, f"{page}.md must have this table:\n{docs_table(payload)}"
        assert not isinstance(payload, Tunnel) or f"0x{payload.payload_type:X}" in text


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    counter: Annotated[int, Wire("Hx", "a counter", modulo=True)]
    decided: Annotated[bool, flag("decided")]
    height_m: Annotated[float, Wire("f", "height", least=-1.0, most=1.0, nan=True)]
    places: Annotated[tuple[tuple[float, float], ...], Many(Wire("2f", "a place"), "places", capacity=2)]


REPORT = Tunnel(Report, 0xF000)


def sent(**changes: Any) -> bytearray:
    values = {"counter": 0x1_0203, "decided": True, "height_m": 0.5, "places": ((1.0, 2.0),)}
    return bytearray(REPORT.message(Report(**{**values, **changes})).payload)


def test_a_declaration_is_the_layout() -> None:
    payload = sent()
    assert bytes(payload[:6]) == bytes.fromhex("01 01 0302 00 01")  # version, count, counter, zero, flags
    assert REPORT.read(0xF000, 26, payload) == Report(
        counter=0x0203, decided=True, height_m=0.5, places=((1.0, 2.0),)
    )
    assert docs_table(REPORT).splitlines()[3:5] == [
        "| 1 | uint8 | count | places |",
        "| 2 | uint16 | counter | a counter |",
    ]
    assert REPORT.read(0xF000, 25, payload) is REPORT.read(0xF001, 26, payload) is None


@pytest.mark.parametrize("height_m", [1.1, -1.1, math.inf, -math.inf])
def test_numbers_out_of_bounds_are_not_read(height_m: float) -> None:
    assert REPORT.read(0xF000, 26, sent(height_m=height_m)) is None


def test_a_number_may_be_unknown_and_a_count_must_fit() -> None:
    found = REPORT.read(0xF000, 26, sent(height_m=math.nan, places=((1.0, 2.0),) * 3))
    assert found is not None and math.isnan(found.height_m) and len(found.places) == 2  # the rest is left out
    payload = sent()
    payload[1] = 3
    assert REPORT.read(0xF000, 26, payload) is None
    payload[0], payload[1] = 2, 1
    assert REPORT.read(0xF000, 26, payload) is None
