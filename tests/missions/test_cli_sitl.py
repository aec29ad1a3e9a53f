"""`flightstack sitl`: what its vehicles carry."""

from collections import Counter

import pytest
from click.testing import CliRunner

from autopilot_bridge.errors import TlogError
from autopilot_bridge.mavlink import DEFINITIONS
from autopilot_bridge.sitl import SitlServer
from autopilot_bridge.tlog import TlogReader, TlogWriter
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import SyntheticMapParameters, synthetic_map
from missions.cli.sitl import sitl as command

LINK = ("--link", "udpin:127.0.0.1:0")


def sitl(*arguments: str):
    return CliRunner().invoke(command, ["--speedup", "0", "--duration", "3", *arguments])


@pytest.fixture
def survey_map(tmp_path):
    home = Home(lat_deg=47.39774, lon_deg=8.54559, alt_m=489.4)
    path = tmp_path / "map.npz"
    seed = RandomStreams(1).child("magnetic_map")
    synthetic_map(SyntheticMapParameters(), home=home, seed=seed).save(path)
    return path


def test_payload_speaks_on_the_vehicles_links_and_targets_are_in_the_log(tmp_path, survey_map):
    log = tmp_path / "carried.tlog"
    result = sitl(
        *LINK, "--camera", "--video", "off", "--target", "40,0", "--target", "0,60,2,90",
        "--map", str(survey_map), "--map-target", "100,-50", "--log", str(log),
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    received = Counter(
        (f.system_id, f.component_id, DEFINITIONS[f.message_id].name) for _, f in TlogReader(log)
    )
    for component in (100, 154, 158):
        assert received[1, component, "HEARTBEAT"] == 3
    assert received[1, 158, "NAMED_VALUE_FLOAT"] == 30
    for target, frames in ((1, 30), (2, 150)):  # at rest 10 Hz, moving 50 Hz
        assert received[251, target, "HIL_STATE_QUATERNION"] == frames


@pytest.mark.parametrize(
    ("arguments", "reported"),
    [
        (("--target", "5,5"), "add --camera"),
        (("--camera", "--target", "5"), "--target '5' is not 2 or 4 numbers"),
        (("--camera", "--target", "1,2,nan,4"), "--target '1,2,nan,4' is not"),
        (("--camera", "--target", "1e9,0"), "not within 50000 m of home"),
        (("--camera", "--target", "0,0,-3,90"), "target speed -3 m/s"),
        (("--map-target", "1,2"), "--map-target needs a --map"),
        (("--map", "nowhere.npz"), "nowhere.npz can't be read"),
    ],
)
def test_payload_that_can_not_be_is_refused_by_name(arguments, reported):
    result = sitl(*LINK, *arguments)
    assert result.exit_code == 2
    assert reported in result.output
    assert "starting" not in result.output  # what is wrong is said at once


def test_signature_off_the_map_is_refused_by_name(survey_map):
    result = sitl(*LINK, "--map", str(survey_map), "--map-target", "9000,0")
    assert result.exit_code == 2
    assert "target 1 at north 9000 m, east 0 m is outside the magnetic map" in result.output


def test_a_full_disk_ends_the_log_and_not_the_flight(tmp_path, monkeypatch):
    flush = TlogWriter.flush

    def filling(log):
        if log.records > 500:
            raise TlogError(f"can't write {log.path}: No space left on device; check the disk")
        flush(log)

    monkeypatch.setattr(TlogWriter, "flush", filling)
    log = tmp_path / "said.tlog"
    words = ["--speedup", "0", *LINK, "--duration", "6", "--log", str(log)]
    result = CliRunner().invoke(command, words, standalone_mode=False)
    assert result.return_value == 1
    assert result.output.count("check the disk; the log ends here, the vehicles fly on") == 1
    assert "stopped at 6.0 s" in result.output
    assert len(list(TlogReader(log))) > 500


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.sampled(1)
@pytest.mark.slow
def test_the_log_has_what_every_vehicle_says(tmp_path, autopilot):
    log = tmp_path / "said.tlog"
    result = sitl("--autopilot", autopilot, "--no-wait", "--count", "2", "--duration", "6", "--log", str(log))
    assert result.exit_code == 0, result.output
    received = Counter((f.system_id, DEFINITIONS[f.message_id].name) for _, f in TlogReader(log))
    for system_id in (1, 2):
        assert received[system_id, "ATTITUDE"] >= 15
        assert received[system_id, "HIL_STATE_QUATERNION"] > 250


@pytest.mark.parametrize(
    ("autopilot", "lines"),
    [
        (
            "px4",
            (
                "vehicle 8 (px4 iris): udppeer:127.0.0.1:14587,127.0.0.1:14547 onboard",
                "vehicle 8 (px4 iris): udppeer:127.0.0.1:18577,127.0.0.1:14550 gcs",
            ),
        ),
        (
            "ardupilot",
            tuple(f"vehicle 1 (ardupilot iris): tcpin:127.0.0.1:{port} gcs" for port in (5830, 5832, 5833)),
        ),
    ],
)
def test_an_instance_has_the_firmwares_ports_and_a_ready_file_lists_them(
    autopilot, lines, tmp_path, monkeypatch
):
    """The wait for a client and the steps are left out: the file is there while the server runs."""
    ready, seen = tmp_path / "up", []
    monkeypatch.setattr(SitlServer, "run", lambda *_, **__: seen.append(ready.read_text().splitlines()))
    result = sitl("--autopilot", autopilot, "--instance", "7", "--no-wait", "--ready-file", str(ready))
    assert result.exit_code == 0, result.output
    assert seen == [list(lines)]
    assert not list(tmp_path.iterdir())


def test_a_ready_file_that_can_not_be_made_is_refused(tmp_path):
    result = sitl(*LINK, "--ready-file", str(tmp_path / "no folder" / "up"))
    assert result.exit_code == 2 and "--ready-file" in result.output and "No such file" in result.output
