"""Each command is declared in a module that imports little, and has a body that takes its options."""

import inspect
import subprocess
import sys
from collections.abc import Iterator

import click

from missions.cli.later import named
from missions.cli.main import command_line

HELP_OF_ALL = """
import sys
import click
from missions.cli.main import command_line

def show(command, parent, name):
    context = click.Context(command, parent=parent, info_name=name)
    command.get_help(context)
    for inner in command.list_commands(context) if isinstance(command, click.Group) else ():
        show(command.get_command(context, inner), context, inner)

show(command_line, None, "flightstack")
heavy = {"av", "cv2", "jsbsim", "matplotlib", "mavsdk", "numba", "numpy", "pyarrow", "pymavlink", "scipy"}
sys.exit(f"imported {heavy & set(sys.modules)}" if heavy & set(sys.modules) else 0)
"""


def commands(command: click.Command, path: str = "flightstack") -> Iterator[tuple[str, click.Command]]:
    if not isinstance(command, click.Group):
        yield path, command
        return
    with click.Context(command) as context:
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            assert found is not None
            yield from commands(found, f"{path} {name}")


def test_help_imports_nothing_heavy() -> None:
    done = subprocess.run([sys.executable, "-c", HELP_OF_ALL], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def test_each_command_has_a_body_that_takes_its_options() -> None:
    count = 0
    for path, command in commands(command_line):
        declaration = getattr(command.callback, "__wrapped__", None)
        if declaration is None:  # a study: its options are those that it declares
            assert path.startswith("flightstack study")
            continue
        body = named((declaration.__globals__["_BODIES"], declaration.__name__))
        inspect.signature(body).bind(**{option.name: None for option in command.params if option.name})
        count += 1
    assert count > 25
