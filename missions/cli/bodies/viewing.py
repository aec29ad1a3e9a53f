"""The viewer of a command that runs something."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import click

from missions.cli.options import in_options
from missions.errors import PlanError
from missions.process.ending import wait_for_interrupt
from missions.view.opening import open_viewer
from missions.view.target import SERVED, parse_view
from missions.view.viewer import Viewer

__all__ = ["viewing"]


@contextmanager
def viewing(text: str | None) -> Iterator[Viewer | None]:
    """Context with the viewer that `--view` names; None: none is named.

    On a terminal, what is served is served until Ctrl-C, so that the run can be looked at when it is over.

    Raises:
        click.UsageError: it names no viewer.
        ViewError: the viewer can't be opened.
    """
    if text is None:
        yield None
        return
    try:
        target = parse_view(text)
    except PlanError as error:
        raise click.UsageError(in_options(error)) from error
    viewer = open_viewer(target)
    try:
        if viewer.live:
            click.echo(f"view: {viewer.where}", err=True)
        yield viewer
        if not viewer.live:
            click.echo(f"view: {viewer.where}")
        if target.kind in SERVED and sys.stderr.isatty():
            click.echo(f"the viewer stays at {viewer.where} until Ctrl-C", err=True)
            wait_for_interrupt()
    finally:
        viewer.close()
