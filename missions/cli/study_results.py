"""`flightstack study show` and `compare`: the results of studies that were run."""

import json
from typing import TYPE_CHECKING, Any

import click

from missions.cli.options import in_options, report
from missions.cli.study_library import STUDIES
from missions.errors import PlanError

if TYPE_CHECKING:
    from missions.studies.folder import StudyFolder
    from missions.studies.results import Results
    from missions.studies.study import Study


@click.command(context_settings={"show_default": True})
@click.argument("folder", metavar="DIR|URI")
@click.option("--failed", is_flag=True, help="List the trials without success, with the command of each.")
@click.option("--json", "as_json", is_flag=True, help="Summary as JSON.")
def show(folder: str, failed: bool, as_json: bool) -> int:
    """Print the table of a study, complete or not.

    Figures, intervals and notes are computed again from its rows. The studies of this program print their own
    tables; one of a Python file prints the table of every study.
    """
    from missions.studies.folder import StudyFolder
    from missions.studies.running import read_results
    from missions.studies.summary import failures_of, study_table, summary_of

    try:
        place = StudyFolder.opened(folder)
        results = read_results(place)
    except PlanError as error:
        raise click.UsageError(in_options(error)) from error
    if failed:
        found = failures_of(results)
        for trial in found:
            click.echo(f"trial {trial['trial']}: {trial['error']}\n    {trial['command']}")
        report(f"{len(found)} of {results.table.num_rows} trials without success")
        return 0
    study = _study_of(place, results)
    summary = summary_of(study, results)
    if as_json:
        from missions.flown.run_folder import finite

        click.echo(json.dumps(finite(summary), indent=2))
        return 0
    for line in study_table(study, results, summary):
        click.echo(line)
    return 0


def _study_of(place: "StudyFolder", results: "Results") -> "Study[Any, Any] | None":
    """The study of this program that the results are of; None: they are of a file or of another version."""
    from missions.studies.rows import RowSchema

    declared = STUDIES.get(results.name)
    if declared is None:
        return None
    try:
        study = declared.build(place.identity()["arguments"])
    except (PlanError, KeyError, ValueError, click.UsageError):  # an argument that this version doesn't have
        return None
    return study if RowSchema.of(study.row).names == set(results.fields) else None


@click.command()
@click.argument("first", metavar="DIR|URI")
@click.argument("second", metavar="DIR|URI")
@click.option("--json", "as_json", is_flag=True, help="Differences as JSON.")
def compare(**given: Any) -> int:
    """Compare two studies: the differences second - first in cells with the same parameters.

    Trials with equal seeds and parameters are compared in pairs. Where the studies have none, their means are
    compared without pairs.
    """
    from missions.studies.comparison import compared, lines_of
    from missions.studies.running import read_results

    try:
        differences = compared(read_results(given["first"]), read_results(given["second"]))
        differences |= {name: given[name] for name in ("first", "second")}
    except PlanError as error:
        raise click.UsageError(in_options(error)) from error
    if given["as_json"]:
        from missions.flown.run_folder import finite

        click.echo(json.dumps(finite(differences), indent=2))
        return 0
    for line in lines_of(differences):
        click.echo(line)
    return 0
