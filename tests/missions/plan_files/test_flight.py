"""Mission files flown on embedded SITLs, and patterns that went through a file."""

from dataclasses import replace
from pathlib import Path

import pytest

from flightsim.home import Home
from flightsim.world_spec import WorldSpec
from missions.base.options import FlightOptions
from missions.errors import PlanError
from missions.library import find_mission
from missions.plan_files.files import read_mission_file
from missions.plan_files.options import FileOptions, Then
from missions.runs.plan_export import export_plan
from missions.runs.session import RunRequest, fly
from missions.vehicle.limits import WIDEST_LIMITS
from tests.missions.plan_files.plans import LANDING, LAT, LON, changed, simple, waypoint, write

both = pytest.mark.parametrize("flavour", ["px4", "ardupilot"])


def request(path: Path, flavour: str = "px4", **more) -> RunRequest:
    defaults = find_mission(str(path)).world_defaults
    home = more.pop("home", defaults.home)
    requested = RunRequest(
        options=FileOptions(),
        world=WorldSpec.of_team(
            model=more.pop("model", defaults.model),
            autopilot=flavour,
            home=None if home is None else Home.parse(home),
        ),
        picture=False,
        out=path.parent / "run",
    )
    return replace(requested, **more)


@both
@pytest.mark.sampled(1)
def test_a_plan_is_flown_with_its_fence_rally_points_and_jumps(flavour: str, tmp_path: Path) -> None:
    path = write(tmp_path)
    result = fly(find_mission(str(path)), request(path, flavour, picture=True))
    assert (result.outcome, result.reason) == ("completed", "")
    block = result.summary["mission_file"]
    assert (block["fence_items"], block["rally_points"]) == (4, 1)
    flown = [entry["item"] for entry in block["reached"] if entry["command"] == 16]
    assert flown == [2, 3, 4, 6, 3, 4, 6]
    assert len(block["legs"]) == 7
    assert block["cross_track_rms_m"] < 0.5
    assert result.summary["path_max_error_m"] < 2.0
    assert result.summary["vehicles"][0]["waypoints"]["passed"] == 8
    assert result.summary["vehicles"][0]["home"]["lat_deg"] == pytest.approx(LAT, abs=1e-4)
    names = {path.name for path in result.folder.iterdir()}
    assert names == {"flight.scene", "flight.tlog", "summary.json", "track.png"}


@both
def test_what_the_autopilot_does_not_take_is_named(flavour: str, tmp_path: Path) -> None:
    strange = 82 if flavour == "px4" else 5001  # a spline; a fence's corner
    items = [simple(1, 22, [0, 0, 0, None, LAT, LON, 15]), simple(2, strange, [0, 0, 0, 0, LAT, LON, 15])]
    path = write(tmp_path, changed("mission", "items", to=items))
    result = fly(find_mission(str(path)), request(path, flavour))
    assert result.outcome == "failed"
    assert "the vehicle refused the mission at item 2" in result.reason
    assert result.summary["distance_m"] < 1.0


@pytest.mark.slow
def test_a_mission_that_does_not_land_returns(tmp_path: Path) -> None:
    items = [simple(1, 22, [0, 0, 0, None, LAT, LON, 15]), waypoint(2, 3e-4, 0.0, 15)]
    path = write(tmp_path, changed("mission", "items", to=items))
    result = fly(find_mission(str(path)), request(path))
    assert (result.outcome, result.reason) == ("completed", "")
    landed = fly(
        find_mission(str(path)), request(path, out=tmp_path / "there", options=FileOptions(then=Then.LAND))
    )
    assert landed.outcome == "completed"
    assert landed.summary["distance_m"] < result.summary["distance_m"] - 20.0  # it lands where it is


def test_what_can_not_be_flown_is_refused_before_anything_starts(tmp_path: Path) -> None:
    path = write(tmp_path)
    with pytest.raises(PlanError, match="is for a multicopter, and the vehicle is a fixed_wing"):
        fly(find_mission(str(path)), request(path, model="aerosonde"))
    with pytest.raises(PlanError, match=r"is flown \d+ km from where the vehicle stands"):
        fly(find_mission(str(path)), request(path, home="47.0,8.0,400"))
    forever = changed("mission", "items", 4, "params", 1, to=-1)
    endless = write(tmp_path, forever, "b.plan")
    with pytest.raises(PlanError, match="jumps back for ever; say when it ends with `time_limit_s`"):
        fly(find_mission(str(endless)), request(endless, out=tmp_path / "endless"))
    aircraft = changed("mission", "vehicleType", to=1)
    aircraft["mission"]["items"] = aircraft["mission"]["items"][:3]
    wings = write(tmp_path, aircraft, "c.plan")
    with pytest.raises(PlanError, match=r"does not land; .* what comes after it: `then=land`"):
        fly(find_mission(str(wings)), request(wings, out=tmp_path / "wings"))
    assert not (tmp_path / "run").exists()


def test_items_below_home_are_refused_before_anything_starts(tmp_path: Path) -> None:
    """By the home of the file, by that of the embedded world where the file has none or another, in every
    frame; not where the user allows it.
    """
    amsl = tmp_path / "amsl.waypoints"
    amsl.write_text(
        "QGC WPL 110\n"
        "0 1 0 16 0 0 0 0 -35.363261 149.16523 584.0 1\n"
        "1 0 0 22 0 0 0 0 -35.363261 149.16523 100 1\n"
        "2 0 0 16 0 0 0 0 -35.362861 149.16523 100 1\n".replace(" ", "\t").replace("QGC\tWPL\t", "QGC WPL ")
    )
    with pytest.raises(
        PlanError, match=r"item 1 \(NAV_TAKEOFF\).* 484 m below home .* item 2 \(NAV_WAYPOINT"
    ):
        fly(find_mission(str(amsl)), request(amsl))
    high = request(amsl, home="-35.363261,149.16523,900")
    allowed = replace(high, options=FileOptions(allow_below_home=True))
    find_mission(str(amsl)).check(allowed.options, WIDEST_LIMITS)
    relative = write(tmp_path, changed("mission", "items", 1, to=waypoint(2, 5e-4, 0.0, -5)))
    with pytest.raises(PlanError, match=r"item 2 \(NAV_WAYPOINT\): altitude -5 m is 5 m below home; where"):
        fly(find_mission(str(relative)), request(relative))
    low_amsl = simple(2, 16, [0, 0, 0, None, LAT, LON, 300], 0)
    homeless = changed("mission", "items", 1, to=low_amsl)
    homeless["mission"]["plannedHomePosition"] = None
    unknown = write(tmp_path, homeless, "b.plan")
    with pytest.raises(PlanError, match=r"item 2 .* is 189 m below home \(489 m"):
        fly(find_mission(str(unknown)), request(unknown, home=f"{LAT},{LON},489.4"))
    rally = write(tmp_path, changed("rallyPoints", "points", to=[[LAT, LON, -20]]), "c.plan")
    with pytest.raises(PlanError, match="rally point 1: altitude -20 m is 20 m below home"):
        fly(find_mission(str(rally)), request(rally))
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
@both
def test_an_aircraft_flies_its_plan_and_lands(flavour: str, tmp_path: Path) -> None:
    plan = changed("mission", "vehicleType", to=1)
    plan["geoFence"] = {"version": 2, "circles": [], "polygons": []}
    plan["mission"]["items"] = [
        simple(1, 22, [12, 0, 0, None, LAT + 0.003, LON, 60]),
        waypoint(2, 0.006, 0.0, 80),
        waypoint(3, 0.006, 0.008, 80),
        waypoint(4, 0.0, 0.008, 80),
        LANDING,
    ]
    path = write(tmp_path, plan)
    parameters = {"RTL_AUTOLAND": 2.0} if flavour == "ardupilot" else {}
    result = fly(find_mission(str(path)), request(path, flavour, parameters=parameters))
    assert (result.outcome, result.reason) == ("completed", "")
    assert {e["item"] for e in result.summary["mission_file"]["reached"]} >= {2, 3, 4}


@pytest.mark.parametrize(("flavour", "suffix"), [("px4", ".plan"), ("ardupilot", ".waypoints")])
@pytest.mark.slow
def test_a_pattern_is_written_and_flown_from_its_file(flavour: str, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"l2{suffix}"
    requested = RunRequest(
        options=FlightOptions(pattern="L2", width_m=40.0, height_m=40.0),
        world=WorldSpec.of_team(autopilot=flavour),
    )
    count = export_plan(find_mission("lissajous"), requested, path)
    document = read_mission_file(path)
    assert len(document.items) == count > 10
    assert document.lands
    result = fly(find_mission(str(path)), request(path, flavour))
    assert (result.outcome, result.reason) == ("completed", "")
    assert result.summary["path_max_error_m"] < 2.0


def test_a_mission_without_waypoints_has_no_file(tmp_path: Path) -> None:
    path = tmp_path / "own.py"
    path.write_text("async def fly(vehicle, options):\n    pass\n")
    with pytest.raises(PlanError, match="own is not flown by uploaded waypoints"):
        export_plan(find_mission(str(path)), RunRequest(), tmp_path / "a.plan")
    with pytest.raises(PlanError, match="there is no folder"):
        export_plan(find_mission("lissajous"), RunRequest(), tmp_path / "none" / "a.plan")
    assert not (tmp_path / "a.plan").exists()


@pytest.mark.parametrize("returns", [True, False])
@pytest.mark.sampled(1)
def test_a_return_of_arduplane_ends_in_the_air_and_that_is_said_before(returns: bool, tmp_path: Path) -> None:
    plan = changed("mission", "vehicleType", to=1)
    plan["geoFence"] = {"version": 2, "circles": [], "polygons": []}
    plan["mission"]["items"] = [
        simple(1, 22, [12, 0, 0, None, LAT + 0.003, LON, 60]),
        waypoint(2, 0.006, 0.0, 80),
        *([simple(3, 20, [0] * 7, 2)] if returns else []),
    ]
    path = write(tmp_path, plan)
    remarks: list[str] = []
    options = FileOptions() if returns else FileOptions(then=Then.RETURN)
    result = fly(
        find_mission(str(path)), request(path, "ardupilot", options=options, on_remark=remarks.append)
    )
    assert (result.outcome, result.reason) == ("completed", "")
    assert "ends in the air: after its return it circles over home (RTL_AUTOLAND 0)" in remarks[0]
    warning = result.summary["vehicles"][0]["warnings"][-1]
    assert "its return has ended in the air: it circles over home in mode RTL" in warning
    assert result.summary["sim_time_s"] < 300.0


@pytest.mark.parametrize(("flavour", "words"), [("px4", "Landing waypoint"), ("ardupilot", "item: RTL")])
def test_what_lands_a_return_is_not_advised_for_a_plan_that_is_refused(
    flavour: str, words: str, tmp_path: Path
) -> None:
    plan = changed("mission", "vehicleType", to=1)
    plan["geoFence"] = {"version": 2, "circles": [], "polygons": []}
    takeoff = simple(1, 22, [12, 0, 0, None, LAT + 0.003, LON, 60])
    plan["mission"]["items"] = [takeoff, waypoint(2, 0.006, 0.0, 80)]
    remarks: list[str] = []
    result = fly(
        find_mission(str(write(tmp_path, plan))),
        request(
            tmp_path / "a.plan",
            flavour,
            options=FileOptions(then=Then.RETURN),
            parameters={} if flavour == "px4" else {"ARMING_MIS_ITEMS": 64},
            on_remark=remarks.append,
        ),
    )
    assert result.outcome == "failed"
    assert words in result.reason
    assert remarks == []
