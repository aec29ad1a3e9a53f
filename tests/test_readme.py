"""What the README shows works as it stands: its commands parse, its mission flies, its files are there."""

import re
import shlex
from pathlib import Path

import click
import pytest

from missions.cli import command_line
from tests.clients.forked_process import flightstack_done

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"^    (flightstack .*?)(?:  +#.*)?$", README, re.MULTILINE)
SQUARE, HEADINGS, CLIMB = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


def parse(line: str) -> None:
    """Parse a command line with the program's own parser, without running it."""
    words = shlex.split(line)[1:]
    with click.Context(command_line, info_name="flightstack") as parent:
        command = command_line.get_command(parent, words[0])
        assert command is not None, f"no command {words[0]}"
        command.make_context(words[0], words[1:], parent=parent)


@pytest.mark.parametrize("line", COMMANDS)
def test_commands_parse(line: str) -> None:
    parse(line)


def test_there_are_commands() -> None:
    assert len(COMMANDS) > 8
    with pytest.raises(click.UsageError):
        parse("flightstack fly lissajous --no-such-option")


def test_the_two_lines_set_up_what_they_use() -> None:
    flight, tests = re.findall(r"^python3\.11 -m venv .*$", README, re.MULTILINE)
    assert flight.endswith("flightstack fly lissajous")
    assert "-e '.[test]'" in tests
    assert tests.endswith("-m pytest")


def fly(mission: str, folder: Path, *arguments: str) -> str:
    """Fly a mission of the README from a file; what it printed."""
    (folder / "mission.py").write_text(mission, encoding="utf-8")
    done = flightstack_done("fly", str(folder / "mission.py"), *arguments, "--out", str(folder / "run"))
    assert done.returncode == 0, done.stderr
    assert (folder / "run" / "track.png").stat().st_size > 10_000
    return done.stdout


def test_the_mission_flies_and_the_estimator_with_it(tmp_path: Path) -> None:
    (tmp_path / "climb.py").write_text(CLIMB, encoding="utf-8")
    said = fly(SQUARE, tmp_path, "--altitude", "15", "--estimator", str(tmp_path / "climb.py"))
    assert said.count("battery") == 4
    assert re.search(r"climb, vehicle 1: \d+ estimates: alt [01]\.\d+ m RMS off autopilot", said)


@pytest.mark.parametrize("autopilot", [pytest.param("px4", marks=pytest.mark.slow), "ardupilot"])
def test_the_mission_of_aircraft_flies(tmp_path: Path, autopilot: str) -> None:
    fly(HEADINGS, tmp_path, "--model", "aerosonde", "--autopilot", autopilot)


@pytest.mark.parametrize("link", re.findall(r"\]\(([^)h][^)]*)\)", README))
def test_linked_files_and_sections_exist(link: str) -> None:
    file, _, section = link.partition("#")
    assert (ROOT / file).exists(), link
    if section:
        headings = re.findall(r"^#+ (.+)$", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)
        assert section in {re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in headings}
