"""Errors name fields, and the command line the options that set them."""

import ast
import re
import sys
from pathlib import Path

import click
import pytest

from missions.cli.bodies.status_line import StatusLine
from missions.cli.fly_command import _COMMANDS
from missions.cli.main import command_line
from missions.cli.options import in_options

ROOT = Path(__file__).parents[2]
FIELD = re.compile(r"`[a-z]\w*(?:, [a-z]\w*)*(?:=[\w:]+)?`")


@pytest.mark.parametrize(
    ("message", "shown"),
    [
        ("`speed_m_s` 0 is not possible", "--speed 0 is not possible"),
        ("a smaller `width_m, height_m`, or", "a smaller --size, or"),
        ("needs `via=setpoints`: or", "needs --via setpoints: or"),
        ("fly with `gps_fault=False` to", "fly with --no-gps-fault to"),
        ("as in `ratio=3:4`", "as in --ratio 3:4"),
        ("`target_ne_m` and `moment_a_m2`", "--target and --moment"),
        ("neither `async def fly(vehicle, options)` nor", "neither `async def fly(vehicle, options)` nor"),
    ],
)
def test_fields_become_options(message, shown):
    assert in_options(message) == shown


def all_options():
    found = set()
    waiting = [command_line.get_command(None, name) for name in command_line.list_commands(None)]
    waiting += _COMMANDS.values()
    while waiting:
        command = waiting.pop()
        parameters = command.params if isinstance(command, click.Command) else command.options  # type: ignore[attr-defined]
        for parameter in parameters:
            found.update(getattr(parameter, "opts", ()))
        if isinstance(command, click.Group):
            context = click.Context(command)
            waiting += [command.get_command(context, name) for name in command.list_commands(context)]
    return found


def test_every_field_that_an_error_names_has_an_option():
    options, missing, count = all_options(), [], 0
    for package in ("autopilot_bridge", "estimators", "missions"):
        for path in sorted(set((ROOT / package).rglob("*.py")) - set((ROOT / "missions/cli").iterdir())):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            documentation = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
            for node in ast.walk(tree):
                if not (isinstance(node, ast.Constant) and isinstance(node.value, str)):
                    continue
                for field in FIELD.findall(node.value) if id(node) not in documentation else ():
                    shown = re.findall(r"--[a-z-]+", in_options(field))
                    count += 1
                    if not shown or not options.issuperset(shown):
                        missing.append((path.name, field, shown))
    assert count > 50
    assert missing == []


@pytest.mark.parametrize("terminal", [False, True])
def test_what_others_print_stands_on_lines_of_its_own(capsys, monkeypatch, terminal):
    for stream in (sys.stdout, sys.stderr):
        monkeypatch.setattr(stream, "isatty", lambda: terminal)
    line, streams = StatusLine(), (sys.stdout, sys.stderr)
    with line.shared():
        line.show("42 %")
        print("own word", file=sys.stderr)  # noqa: T201
        line.show("43 %")
        print("begun", end="", file=sys.stderr)  # noqa: T201
        line.show("44 %")  # not behind a line that is not ended
        print(" and ended", file=sys.stderr)  # noqa: T201
        line.show("45 %")
        print("result")  # noqa: T201
    line.end()
    assert (sys.stdout, sys.stderr) == streams
    captured = capsys.readouterr()
    assert captured.out == "result\n"
    on_terminal = "\r42 %\r    \rown word\n\r43 %\r    \rbegun and ended\n\r45 %\r    \r"
    assert captured.err == (on_terminal if terminal else "own word\nbegun and ended\n")


@pytest.mark.parametrize("terminal", [False, True])
def test_a_status_line_is_for_terminals_only(capsys, monkeypatch, terminal):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal)
    line = StatusLine()
    line.show("longer")
    line.show("short")
    line.erase()
    line.end()  # nothing is shown any more
    line.show("last")
    line.end()
    expected = "\rlonger\rshort \r" + " " * 5 + "\r\rlast\n"
    assert capsys.readouterr().err == (expected if terminal else "")
