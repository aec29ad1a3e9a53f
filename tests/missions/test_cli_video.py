"""Options about the cameras' pictures: what is refused, and how it is said."""

import pytest
from click.testing import CliRunner

from missions.cli.sitl import sitl

QUICK = ("--speedup", "0", "--duration", "0.5", "--no-wait", "--link", "udpin:127.0.0.1:0")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--video", "off"), "--video is for cameras; add --camera"),
        (("--pictures", "somewhere"), "--pictures is for cameras; add --camera"),
        (("--camera", "--video", "tv"), "--video 'tv' is not accepted: PORT, HOST:PORT or off is"),
        (("--camera", "--video", "99999"), "video port 99999 is not in 0..65535"),
        (("--camera", "--video", "0.0.0.0:0"), "no address that players connect to"),
    ],
)
def test_what_can_not_be_is_said(options, said):
    result = CliRunner().invoke(sitl, [*QUICK, *options])
    assert result.exit_code == 2
    assert said in result.output


def test_nothing_is_overwritten(tmp_path):
    (tmp_path / "mine.jpg").touch()
    result = CliRunner().invoke(sitl, [*QUICK, "--camera", "--video", "off", "--pictures", str(tmp_path)])
    assert result.exit_code == 2
    assert "pictures go to a new or empty folder" in result.output


def test_where_the_video_is(tmp_path):
    result = CliRunner().invoke(sitl, [*QUICK, "--camera", "--video", "0", "--count", "2"])
    assert result.exit_code == 0, result.output
    shown = [line for line in result.output.splitlines() if line.startswith("video: rtsp://127.0.0.1:")]
    assert [line.rpartition("/")[2] for line in shown] == ["camera1", "camera2"]


def test_video_may_be_off():
    result = CliRunner().invoke(sitl, [*QUICK, "--camera", "--video", "off"])
    assert result.exit_code == 0, result.output
    assert "rtsp" not in result.output
