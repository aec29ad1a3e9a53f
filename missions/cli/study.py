"""`flightstack study`: Monte Carlo experiments of the papers, without vehicles."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from missions.cli.options import in_options, report

if TYPE_CHECKING:
    from missions.studies.lissajous_setting import Equations

_FAILED: Final = 1
_INTERRUPTED: Final = 130
_BAR_STEPS: Final = 1000


class _Studies(click.Group):
    """The group of studies. An unknown name is reported with a list of the known ones."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in self.commands and not args[0].startswith("-"):
            raise click.UsageError(f"no study {args[0]!r}; there are {', '.join(self.commands)}")
        return super().resolve_command(ctx, args)


@click.group(cls=_Studies)
def study() -> None:
    """Monte Carlo: the papers' experiments that need no vehicle."""


@study.command("lissajous-localization", context_settings={"show_default": True})
@click.option("--runs", type=click.IntRange(1, 1_000_000), default=1000, help="Per cell; there are 20.")
@click.option("--seed", type=click.IntRange(min=0), default=0, help="One seed makes one table.")
@click.option("--workers", type=click.IntRange(1, 256), help="Processes. [default: one per processor]")
@click.option(
    "--equations",
    type=click.Choice(["corrected", "printed", "both"]),
    default="both",
    help="The paper's as they must be, as they are printed, or both.",
)
@click.option("--out", type=click.Path(path_type=Path), help="Run folder. [default: runs/STUDY-N]")
@click.option("--no-picture", is_flag=True, help="Don't draw figures 6 and 7.")
def lissajous_localization(
    runs: int, seed: int, workers: int | None, equations: str, out: Path | None, no_picture: bool
) -> int:
    """Two drones on Lissajous paths localise a target: Tables II to V of Steckenrider et al. 2020.

    No filter (N), Kalman filter (K), the paper's (P), and one with the frequencies as states (F), beside the
    paper's Table IV. The run folder gets summary.json, table.txt, figure_6.png and figure_7.png.
    """
    from missions.errors import PlanError
    from missions.runs.run_folder import create_run_folder
    from missions.studies.pool import processors

    if workers is None:
        workers = processors()
    try:
        folder = create_run_folder(out, "lissajous-localization")
    except PlanError as error:
        raise click.UsageError(in_options(error)) from error
    return _lissajous_localization(runs, seed, workers, _readings(equations), folder, not no_picture)


def _readings(equations: str) -> "tuple[Equations, ...]":
    from missions.studies.lissajous_setting import Equations

    printed = (Equations.SIGN_AS_PRINTED, Equations.AS_PRINTED)
    return {"corrected": (Equations.CORRECTED,), "printed": printed}.get(
        equations, (Equations.CORRECTED, *printed)
    )


def _lissajous_localization(
    runs: int,
    seed: int,
    workers: int,
    equations: "tuple[Equations, ...]",
    folder: Path,
    picture: bool,
) -> int:
    from autopilot_bridge.clock.pacing import wall_time_s
    from missions.runs.run_folder import versions, whole, write_summary
    from missions.studies.lissajous_localization import StudyRequest, compile_study, run_study, sample_run
    from missions.studies.lissajous_table import summary_of, table_of

    started_s = wall_time_s()
    terminal = sys.stderr.isatty()
    if terminal:
        click.echo("starting (the first start compiles the estimators, some ten seconds)", err=True)
    try:
        compile_study()
    except KeyboardInterrupt:
        folder.rmdir()  # no file is in it yet
        raise
    request = StudyRequest(runs=runs, seed=seed, workers=workers, equations=equations)
    with click.progressbar(length=_BAR_STEPS, file=sys.stderr, hidden=not terminal) as bar:
        result = run_study(request, lambda share: bar.update(round(_BAR_STEPS * share) - bar.pos))
    summary = summary_of(result, wall_time_s() - started_s)
    table = table_of(summary["cells"], equations)
    for line in table:
        click.echo(line)
    try:
        text = folder / "table.txt"
        with whole(text), text.open("x", encoding="utf-8") as file:
            file.write("\n".join(table) + "\n")
        command = " ".join(["flightstack", *sys.argv[1:]])
        write_summary(folder, summary | {"versions": versions(), "command": command})
        if picture:
            from missions.studies.lissajous_figures import draw_paths, draw_target

            sample = sample_run(seed)
            for name, draw in (("figure_6.png", draw_paths), ("figure_7.png", draw_target)):
                with whole(folder / name):
                    draw(folder / name, sample)
    except OSError as error:
        raise click.ClickException(
            f"can't write all of {folder}: {error.strerror or error}; check the disk"
        ) from error
    click.echo(f"run: {folder}")
    if not result.complete:
        report(f"{result.failure or 'interrupted'}; what was done is in {folder}")
        return _FAILED if result.failure else _INTERRUPTED
    return 0
