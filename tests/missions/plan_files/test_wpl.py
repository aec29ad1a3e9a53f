"""QGC WPL 110: read with home in its first row, written, refused."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavwp
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import PlanError
from missions.plan_files.document import PlannedHome
from missions.plan_files.files import read_mission_file
from missions.plan_files.route import route_of
from missions.plan_files.wpl import format_wpl, read_wpl

HOME = GeodeticPosition(lat_deg=-35.3632613, lon_deg=149.1652373, alt_m=584.154)
ROWS = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t-35.3632613\t149.1652373\t584.154\t1
# up
1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t12\t1
2\t0\t3\t16\t3\t0\t0\t0\t-35.3628\t149.1652\t12\t1
3\t0\t3\t177\t2\t4\t0\t0\t0\t0\t0\t1
4\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""


def written(folder: Path, text: str, name: str = "a.waypoints") -> Path:
    path = folder / name
    path.write_text(text)
    return path


@pytest.mark.parametrize("name", ["a.waypoints", "a.txt"])
def test_the_first_row_is_home(name: str, tmp_path: Path) -> None:
    document = read_mission_file(written(tmp_path, ROWS, name))
    assert document.home == PlannedHome.of(HOME)
    assert [(item.command, item.frame) for item in document.items] == [(22, 6), (16, 6), (177, 6), (20, 6)]
    assert document.items[2].param1 == 1.0  # the row's number counts home, the item's index does not
    assert (document.kind, document.firmware) == (None, None)


def test_a_home_row_of_zeros_is_no_place(tmp_path: Path) -> None:
    home = "\t-35.3632613\t149.1652373\t584.154"
    assert home in ROWS
    document = read_mission_file(written(tmp_path, ROWS.replace(home, "\t0\t0\t0")))
    assert document.home is None
    assert [item.command for item in document.items] == [22, 16, 177, 20]
    assert document.items[2].param1 == 1.0


@pytest.mark.parametrize("command", [16, 17, 18, 19, 31])
def test_an_item_at_zero_stays_where_the_vehicle_is(command: int, tmp_path: Path) -> None:
    place = "3\t16\t3\t0\t0\t0\t-35.3628\t149.1652"
    jump, circle = "3\t177\t2\t4\t0\t0\t0\t0\t0", f"3\t{command}\t10\t0\t0\t0\t0\t0\t15"
    rows = ROWS.replace(jump, circle)
    assert place in rows
    document = read_mission_file(written(tmp_path, rows))
    route = route_of(document, HOME)
    before, stays = route.stops[-2:]
    assert stays.position_ned_m[:2] == pytest.approx(before.position_ned_m[:2])
    assert stays.position_ned_m[2] == -15.0


def test_a_file_without_home_begins_with_its_first_item(tmp_path: Path) -> None:
    rows = ROWS.splitlines()
    document = read_mission_file(written(tmp_path, "\n".join([rows[0], rows[3].replace("1\t", "0\t", 1)])))
    assert document.home is None
    assert [item.command for item in document.items] == [22]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "it is empty"),
        ("QGC WPL 120\n", "Unsupported waypoint format"),
        ("QGC WPL 110\n", "has no items"),
        (ROWS + "5\t0\t3\t16\n", "after 5 rows: invalid waypoint line with 4 values"),
        (ROWS.replace("149.1652\t12", "149.1652\tx"), "could not convert string to float: 'x'"),
        (ROWS.replace("-35.3628", "nan"), "item 2 (NAV_WAYPOINT): has no position"),
        (ROWS.replace("-35.3628", "inf"), "item 2 (NAV_WAYPOINT): position inf"),
        (ROWS.replace("\t12\t1\n2", "\tnan\t1\n2"), "item 1 (NAV_TAKEOFF): has no altitude"),
        (ROWS.replace("3\t177\t2", "3\t177\t9"), "item 3 (DO_JUMP): jumps to item 9, which is not in 1..4"),
        (ROWS.replace("2\t0\t3\t16", "2\t0\t999\t16"), "frame 999"),
    ],
)
def test_what_is_wrong_is_named(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(PlanError) as refused:
        read_mission_file(written(tmp_path, text))
    assert words in str(refused.value)


def test_a_file_that_is_not_there_is_reported(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=r"none\.waypoints can't be read: No such file"):
        read_wpl(tmp_path / "none.waypoints")


def test_pymavlink_reads_what_is_written(tmp_path: Path) -> None:
    items = [
        MissionItem(
            command=mavlink.MAV_CMD_NAV_TAKEOFF, x=HOME.lat_deg, y=HOME.lon_deg, z=12.0, param4=float("nan")
        ),
        MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=-35.3628, y=149.1652, z=12.5),
        MissionItem(command=mavlink.MAV_CMD_DO_JUMP, frame=2, param1=1.0, param2=3.0),
    ]
    loader = mavwp.MAVWPLoader()
    loader.load(str(written(tmp_path, format_wpl(items, HOME))))
    rows = [loader.wp(k) for k in range(loader.count())]
    assert [(row.seq, row.frame, row.command) for row in rows] == [
        (0, 0, 16),
        (1, 3, 22),
        (2, 3, 16),
        (3, 2, 177),
    ]
    assert (rows[0].x, rows[0].y, rows[0].z) == (HOME.lat_deg, HOME.lon_deg, HOME.alt_m)
    assert rows[1].param4 == 0.0  # the format has no "not set"
    assert rows[3].param1 == 2.0


NUMBERS = st.floats(-1000.0, 1000.0, width=32)


@given(
    st.lists(
        st.builds(
            MissionItem,
            command=st.sampled_from([16, 19, 82]),
            frame=st.sampled_from([5, 6, 11]),
            param1=NUMBERS,
            x=st.floats(-90.0, 90.0).filter(lambda v: abs(v) > 1e-3),
            y=st.floats(-180.0, 180.0),
            z=NUMBERS,
            autocontinue=st.booleans(),
        ),
        min_size=1,
        max_size=20,
    )
)
def test_items_survive_writing_and_reading(tmp_path_factory: pytest.TempPathFactory, items: list) -> None:
    path = written(tmp_path_factory.mktemp("wpl"), format_wpl(items, HOME))
    again = read_mission_file(path).items
    assert len(again) == len(items)
    for a, b in zip(again, items, strict=True):
        assert (a.command, a.frame, a.autocontinue) == (b.command, b.frame, b.autocontinue)
        assert (a.x, a.y) == (pytest.approx(b.x, abs=1e-8), pytest.approx(b.y, abs=1e-8))
        assert a.param1 == pytest.approx(b.param1, abs=1e-7)
