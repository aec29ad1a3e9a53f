"""`flightstack study show` and `compare`: the results of studies that were run."""

import json
from typing import Any

import click

from missions.cli.options import in_options, report


@click.command(context_settings={"show_default": True})
@click.argument("folder", metavar="DIR|URI")
@click.option("--failed", is_flag=True, help="List the trials without success, with the command of each.")
@click.option("--json", "as_json", is_flag=True, help="Print the summary as JSON.")
def show(folder: str, failed: bool, as_json: bool) -> int:
    """Print the table of a study, complete or not.

    Figures, intervals and notes are computed again from its rows.
    """
    from missions.errors import PlanError
    from missions.studies.running import read_results
    from missions.studies.summary import failures_of, summary_of, table_of

    try:
        results = read_results(folder)
    except PlanError as error:
        raise click.UsageError(in_options(error)) from error
    if failed:
        found = failures_of(results)
        for trial in found:
            click.echo(f"trial {trial['trial']}: {trial['error']}\n    {trial['command']}")
        report(f"{len(found)} of {results.table.num_rows} trials without success")
        return 0
    summary = summary_of(None, results)
    if as_json:
        from missions.runs.run_folder import finite

        click.echo(json.dumps(finite(summary), indent=2))
        return 0
    for line in table_of(summary):
        click.echo(line)
    return 0


@click.command()
@click.argument("first", metavar="DIR|URI")
@click.argument("second", metavar="DIR|URI")
@click.option("--json", "as_json", is_flag=True, help="Print the differences as JSON.")
def compare(**given: Any) -> int:
    """Compare two studies: the differences second - first in cells with the same parameters.

    Trials with equal seeds and parameters are compared in pairs. Where the studies have none, their means are
    compared without pairs.
    """
    from missions.errors import PlanError
    from missions.studies.comparison import compared, lines_of
    from missions.studies.running import read_results

    try:
        differences = compared(read_results(given["first"]), read_results(given["second"]))
        differences |= {name: given[name] for name in ("first", "second")}
    except PlanError as error:
        raise click.UsageError(in_options(error)) from error
    if given["as_json"]:
        from missions.runs.run_folder import finite

        click.echo(json.dumps(finite(differences), indent=2))
        return 0
    for line in lines_of(differences):
        click.echo(line)
    return 0
