"""What the commands of studies do, and what they print."""

import hashlib
import json
import os
import re
import shlex
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import Any, Final

import click

from estimators.reports.figure import vector_figures
from missions.cli.bodies.status_line import PipeLines, StatusLine
from missions.cli.bodies.world import firmware_of
from missions.cli.declared_options import Given, made_of_values
from missions.cli.exit_codes import FAILED
from missions.cli.mission_commands import arguments_of
from missions.cli.options import in_options, report
from missions.cli.study_command import StudyCommand
from missions.errors import MissionError, PlanError
from missions.process.ending import EndedBySignal, EndSignalHandler
from missions.studies.engine import Engine, Progress
from missions.studies.flights import flown_by
from missions.studies.folder import StudyFolder
from missions.studies.inline import Inline
from missions.studies.job import load_study_module
from missions.studies.options import StudyRunOptions
from missions.studies.pool import Pool
from missions.studies.ray_cluster import RayCluster
from missions.studies.running import StudyResult, run_study, run_trial
from missions.studies.study import Study, Trial
from missions.studies.trial_runner import error_text

_KILLED: Final = 128
_SEPARATORS: Final = re.compile(r"[,;=]")  # of the values in one word
_FILE: Final = re.compile(r"[/\\]|\.[A-Za-z]\w*$")  # a folder or a suffix


def run(declared: StudyCommand, name: str, given: dict[str, Any]) -> int:
    """Run the study of a command, and print its table; returns the exit code."""
    try:
        return _run(declared, name, given)
    except PlanError as error:
        raise click.UsageError(in_options(error)) from error
    except MissionError as error:
        raise click.ClickException(in_options(error)) from error


def by_firmware(study: Study[Any, Any], given: Given) -> Study[Any, Any]:
    """The study with its flights flown by the real firmware of the option `--firmware`, if it is given.

    Raises:
        PlanError: the option is not accepted.
    """
    try:
        return flown_by(study, firmware_of(given))
    except ValueError as error:
        raise PlanError(str(error)) from error


def _run(declared: StudyCommand, name: str, given: dict[str, Any]) -> int:
    if given["resume"] is not None:
        _take_up(declared, name, given, StudyFolder.opened(given["resume"]).identity())
    study, how = declared.build(given), made_of_values(StudyRunOptions, given)
    runs = study.runs if how.runs is None else how.runs
    if how.trial is not None:
        return _one_trial(study, runs, how.seed, how.trial)
    own = words_of(declared.options, given)
    words = ["flightstack", "study", name, *own, "--runs", str(runs), "--seed", str(how.seed)]

    def repeat(trial: Trial) -> str:
        return shlex.join([*words, "--trial", str(trial.index)])

    arguments = {option.name: given[option.name] for option in declared.options if option.name is not None}
    return _run_and_tell(study, how, given, repeat=repeat, arguments=arguments)


def _take_up(declared: StudyCommand, study: str, given: dict[str, Any], identity: Mapping[str, Any]) -> None:
    """Give options that the user did not specify the values that a study was begun with.

    The folder may come from another person. It sets the study's own options, the number of runs and the seed,
    and nothing else: where trials are run and which files are read, written or executed is the command
    line's.

    Raises:
        PlanError: a value is not accepted, or names a file.
    """
    context = click.get_current_context()
    own = {option.name for option in declared.options}
    arguments = identity.get("arguments")
    before = dict(arguments) if isinstance(arguments, dict) else {}
    before = {name: value for name, value in before.items() if name in own}
    before |= {name: identity.get(name) for name in ("runs", "seed")}
    for option in context.command.params:
        source = None if option.name is None else context.get_parameter_source(option.name)
        if option.name not in before or source is click.core.ParameterSource.COMMANDLINE:
            continue
        value = before[option.name]
        try:
            taken = option.type_cast_value(context, tuple(value) if isinstance(value, list) else value)
        except (click.BadParameter, TypeError) as error:
            raise PlanError(
                f"{given['resume']}/study.json: {option.name} {value!r} is not accepted: {error}"
            ) from error
        parts = (part for text in _texts(taken) for part in _SEPARATORS.split(text))
        files = sorted({part for part in parts if _is_file(part)})
        if files:
            words = words_of(declared.options, {**given, **before})
            repeated = shlex.join(["flightstack", "study", study, "--resume", given["resume"], *words])
            raise PlanError(
                f"{given['resume']} names files ({', '.join(files)}), and a study's folder does not choose "
                f"which files are opened; check them, and repeat its options: {repeated}"
            )
        given[option.name] = taken


def _texts(value: object) -> list[str]:
    """The texts in the value of an option."""
    if isinstance(value, tuple):
        return [text for item in value for text in _texts(item)]
    return [value] if isinstance(value, str) else []


def _is_file(word: str) -> bool:
    """Whether a word looks like the name of a file, or is one."""
    return bool(_FILE.search(word)) or os.path.isfile(word)


def _one_trial(study: Study[Any, Any], runs: int, seed: int, index: int) -> int:
    """Run one trial in this process and print its row; its error, if it raises one, has the whole
    traceback.
    """
    try:
        row = run_trial(study, index, runs=runs, seed=seed)
    except IndexError as error:
        raise click.UsageError(str(error)) from error
    except Exception:  # noqa: BLE001 - whatever the trial raises is shown
        click.echo(traceback.format_exc(), nl=False, err=True)
        report(f"trial {index} failed")
        return FAILED
    click.echo(json.dumps(row, indent=2))
    return 0


def _run_and_tell(
    study: Study[Any, Any],
    how: StudyRunOptions,
    given: Given,
    *,
    repeat: Callable[[Trial], str],
    arguments: Mapping[str, Any],
) -> int:
    """Run a study with the options of every study, and print its table; returns the exit code.

    Args:
        study: the study.
        how: how it is run.
        given: values of the other options.
        repeat: the command that repeats a trial.
        arguments: what `--resume` needs to build the study again.
    """

    class Ending(EndSignalHandler):
        def _on_signal(self, number: int, frame: FrameType | None) -> None:
            raise EndedBySignal(number)

    line = _ProgressLine()
    with line.running(study.name), Ending(), vector_figures(wanted=given["vector"]):
        result = run_study(
            study,
            runs=how.runs,
            seed=how.seed,
            engine=engine_of(how, given["ray"]),
            out=given["out"],
            resume=given["resume"],
            keep_logs=how.keep_logs,
            time_limit_s=how.time_limit_s,
            picture=not given["no_picture"],
            command=shlex.join(["flightstack", *sys.argv[1:]]),
            repeat=repeat,
            arguments=arguments,
            on_progress=line,
        )
    return _tell(result)


def engine_of(how: StudyRunOptions, ray: str | None) -> Engine:
    """The engine that the options select."""
    if ray is not None:
        return RayCluster(ray, workers=how.workers)
    if how.workers == 1 and how.time_limit_s is None:
        return Inline()
    return Pool(how.workers)  # with a time limit, also one worker is a process, which can be terminated


def _tell(result: StudyResult) -> int:
    """Print the result; returns the exit code."""
    for line in result.table:
        click.echo(line)
    click.echo(f"run: {result.folder}")
    if result.outcome != "completed":
        done, trials = result.results.table.num_rows, result.results.runs * len(result.results.cells)
        report(
            f"{result.reason}; {done} of {trials} trials are in {result.folder}, and --resume "
            f"{result.folder} "
            "continues"
        )
        return _KILLED + result.signal if result.outcome == "interrupted" else FAILED
    without_row = result.results.without_row()
    if without_row:
        first = without_row[0]
        count = "1 trial has" if len(without_row) == 1 else f"{len(without_row)} trials have"
        report(f"{count} no row; trial {first['trial']}: {first['error']}; repeat it: {first['command']}")
        return FAILED
    return 0


def words_of(options: tuple[click.Parameter, ...], given: Given) -> list[str]:
    """The words of a command line that give options these values; those with their default are left out."""
    words: list[str] = []
    arguments: list[str] = []
    for option in options:
        value = None if option.name is None else given[option.name]
        if value is None or value == option.default or value in ((), []):
            continue
        if isinstance(option, click.Argument):
            arguments += [str(v) for v in value] if isinstance(value, (list, tuple)) else [str(value)]
        elif isinstance(option, click.Option) and option.is_flag:
            words += [option.opts[0]] if value else []
        else:
            for each in value if isinstance(value, (list, tuple)) else (value,):
                words += [option.opts[0], str(each)]
    if any(word.startswith("-") for word in arguments):
        words.append("--")
    return words + arguments


class _ProgressLine:
    """The progress: on a terminal a status line, in a pipe a line every few seconds."""

    def __init__(self) -> None:
        self._line = StatusLine()
        self._pipe = PipeLines()

    @contextmanager
    def running(self, name: str) -> Iterator[None]:
        """Context of the study."""
        self._pipe.doing(f"{name}: the first trials")
        if self._line.terminal:
            self._line.show(f"{name}: starting")
        try:
            with nullcontext() if self._line.terminal else self._pipe.running():
                yield
        finally:
            self._line.end()

    def __call__(self, progress: Progress) -> None:
        left = "" if progress.left_s is None else f", {_clock(progress.left_s)} left"
        rate = "" if progress.rate_hz == 0.0 else f", {progress.rate_hz:.3g}/s"
        text = f"{progress.done}/{progress.trials} done, {progress.failed} failed{rate}{left}"
        self._line.show(text)
        if progress.done:
            self._pipe.show(text)


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def study_of_file(given: Given) -> Study[Any, Any]:
    """The study in the file that the command names."""
    path = Path(click.get_current_context().info_name or "")

    arguments = arguments_of(given["arg"])
    module = load_study_module(path)
    found = getattr(module, "STUDY", None)
    if callable(getattr(module, "study", None)):
        try:
            found = module.study(arguments)
        except PlanError:
            raise
        except Exception as error:
            raise PlanError(f"study file {path}: {error_text(error)}") from error
    elif arguments:
        raise PlanError(f"study file {path} takes no arguments; they are for `def study(arguments)`")
    if not isinstance(found, Study):
        raise PlanError(
            f"study file {path} has neither `STUDY = Study(...)` nor `def study(arguments)`; add one"
        )
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return replace(
        found,
        files=(*found.files, path.resolve()),
        options={**found.options, **arguments, "file": path.name, "sha256": digest[:16]},
    )
