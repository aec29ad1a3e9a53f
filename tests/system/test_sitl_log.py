"""`flightstack sitl --log`: a log of what the vehicles say, with the truth."""

from collections import Counter
from pathlib import Path

from click.testing import CliRunner

from autopilot_bridge.tlog import TlogReader
from missions.cli.sitl import sitl

ARGUMENTS = ["--link", "udpin:127.0.0.1:0", "--speedup", "0", "--duration", "6", "--log"]


def test_log_has_telemetry_and_truth_and_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "sitl.tlog"
    assert CliRunner().invoke(sitl, [*ARGUMENTS, str(path)]).exit_code == 0
    names = Counter(frame.definition.name for _, frame in TlogReader(path))
    assert names["HIL_STATE_QUATERNION"] == 300
    assert names["ATTITUDE"] > 400
    size = path.stat().st_size
    again = CliRunner().invoke(sitl, [*ARGUMENTS, str(path)])
    assert again.exit_code == 2
    assert "is not overwritten" in again.output
    assert path.stat().st_size == size
