"""What `flightstack study` does."""

import json
from typing import Any

import click

from missions.cli.options import in_options, report
from missions.cli.study_library import STUDIES
from missions.errors import PlanError
from missions.flown.run_folder import finite
from missions.studies.comparison import compared, lines_of
from missions.studies.folder import StudyFolder
from missions.studies.results import Results
from missions.studies.rows import RowSchema
from missions.studies.running import read_results
from missions.studies.study import Study
from missions.studies.summary import failures_of, study_table, summary_of


def show(folder: str, failed: bool, as_json: bool) -> int:
    """`flightstack study show`."""
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
        click.echo(json.dumps(finite(summary), indent=2))
        return 0
    for line in study_table(study, results, summary):
        click.echo(line)
    return 0


def _study_of(place: StudyFolder, results: Results) -> Study[Any, Any] | None:
    """The study of this program that the results are of; None: they are of a file or of another version."""
    declared = STUDIES.get(results.name)
    if declared is None:
        return None
    try:
        study = declared.build(place.identity()["arguments"])
    except (PlanError, KeyError, ValueError, click.UsageError):  # an argument that this version doesn't have
        return None
    return study if RowSchema.of(study.row).names == set(results.fields) else None


def compare(**given: Any) -> int:
    """`flightstack study compare`."""
    try:
        differences = compared(read_results(given["first"]), read_results(given["second"]))
        differences |= {name: given[name] for name in ("first", "second")}
    except PlanError as error:
        raise click.UsageError(in_options(error)) from error
    if given["as_json"]:
        click.echo(json.dumps(finite(differences), indent=2))
        return 0
    for line in lines_of(differences):
        click.echo(line)
    return 0
