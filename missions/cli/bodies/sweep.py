"""What `flightstack study sweep` does: flights of a mission over values of its options."""

import difflib
import hashlib
import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import click

from autopilot_bridge.sitl.warm_up import compile_flight_code
from missions.base.given_text import parse_wind
from missions.base.mission import Mission
from missions.base.request import RunRequest
from missions.cli.bodies.fly import flight_of
from missions.cli.declared_options import FlightOption, Given, Scope, made_of_values
from missions.cli.fly import fly
from missions.library import find_mission
from missions.runs.limits_before_flight import check_request
from missions.runs.vehicle_opening import VehicleOpener
from missions.studies.design import Design, Value, grid, latin_hypercube, random_sample
from missions.studies.flights import FlightRow, fly_trial
from missions.studies.options import Sampling, SweepOptions
from missions.studies.study import Study, Trials
from missions.studies.trial_runner import local_file

_SPEED, _FROM = "wind-speed", "wind-from"
_WIND: Final = (_SPEED, _FROM)
"""The two parts of `--wind SPEED@FROM`, which vary each by itself."""
_REFUSED: Final[Mapping[str, str]] = {
    "--seed": "the study gives each trial its seed; give --seed to the study, before --",
    "--out": "the study has the folder; give --out to the study, before --",
    "--export-plan": "nothing is flown with it",
    "--connect": "a sweep flies embedded vehicles only",
    "--no-picture": "a trial draws no picture anyway",
}
_RANGE: Final = re.compile(r"([-+\d.eE]+)\.\.([-+\d.eE]+)")
_YES: Final = {"yes": True, "on": True, "true": True, "no": False, "off": False, "false": False}
_FLY: Final = "fly"


def parsed(words: Sequence[str]) -> tuple[Mission[Any], RunRequest]:
    """The flight of `flightstack fly WORDS`, parsed by that command itself.

    Raises:
        click.UsageError, PlanError: an option or a value is not accepted.
    """
    with fly.make_context(_FLY, list(words)) as context:
        return flight_of(context)


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepTrial:
    """One flight of a sweep.

    Attributes:
        words: mission and options that all trials have.
        wind: speed and direction that the words or the mission give, for what of it does not vary.
        files: users' files among the words and the values, as they are written there.
        flags: options that are switched on or off, with the words for both.
    """

    words: tuple[str, ...]
    wind: tuple[float, float]
    files: Mapping[str, Path]
    flags: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]]

    def __call__(self, values: Mapping[str, Value], seed: int) -> FlightRow:
        """Fly it."""
        mission, request = parsed([self._here(word) for word in self.line(values, seed)])
        return FlightRow.of(fly_trial(mission, request))

    def command(self, values: Mapping[str, Value], seed: int) -> str:
        """The command that flies it."""
        return shlex.join(["flightstack", _FLY, *self.line(values, seed)])

    def warm_up(self) -> None:
        """Compile or load what the flights need."""
        _, request = parsed([self._here(word) for word in self.words])
        compile_flight_code(request.embedded_world.vehicles)

    def line(self, values: Mapping[str, Value], seed: int) -> list[str]:
        """Its words after `flightstack fly`."""
        line = list(self.words)
        if any(name in values for name in _WIND):
            line = _without_wind(line)
            speed, direction = values.get(_SPEED, self.wind[0]), values.get(_FROM, self.wind[1])
            line += ["--wind", f"{_number(speed)}@{_number(direction)}" if direction else f"{_number(speed)}"]
        for name, value in values.items():
            if name in self.flags:
                line += self.flags[name][0 if value else 1]
            elif name not in _WIND:
                line += [f"--{name}", _number(value)]
        return [*line, "--seed", str(seed)]

    def _here(self, word: str) -> str:
        """A word with the files in it where they are on this machine."""
        parts = re.split(r"([,=])", word)
        return "".join(str(local_file(self.files[p])) if p in self.files else p for p in parts)


def _number(value: object) -> str:
    """A value as a word: a float with all its digits."""
    short = f"{value:g}" if isinstance(value, float) else str(value)
    return repr(value) if isinstance(value, float) and float(short) != value else short


def _without_wind(words: list[str]) -> list[str]:
    kept: list[str] = []
    skip = False
    for word in words:
        if not (skip or word == "--wind" or word.startswith("--wind=")):
            kept.append(word)
        skip = word == "--wind"
    return kept


def sweep_study(
    mission: str, vary: Sequence[str], words: Sequence[str], *, sampling: Sampling | str
) -> Study[Mapping[str, Value], FlightRow]:
    """The study of a sweep.

    Args:
        mission: the mission: its name or its file.
        vary: "NAME=VALUE,VALUE,..." (a factor of the grid) or "NAME=LOW..HIGH" (drawn for each run).
        words: options of the mission, as for `flightstack fly`.
        sampling: how values between two bounds are drawn.

    Raises:
        click.UsageError, PlanError: an option or a value is not accepted.
    """
    find_mission(mission)  # an unknown one is reported with a list of those that there are
    base = (mission, *words)
    with fly.make_context(_FLY, list(base)) as context:
        _refuse(context)
        options = {opt: p for p in fly.get_params(context) if isinstance(p, FlightOption) for opt in p.opts}
        flight, _ = flight_of(context)
        given_wind = context.params["wind"]
    wind = parse_wind(given_wind if given_wind is not None else flight.world_defaults.wind)
    factors = dict(_factor(text, options, flight.name) for text in vary)
    if len(factors) < len(vary):
        raise click.UsageError("--vary names an option twice; give its values in one --vary")
    design = _design(factors, Sampling(sampling))
    texts = [part for word in base for part in re.split(r"[,=]", word)]
    texts += [str(value) for cell in design.cells for value in cell.values()]
    trial = SweepTrial(
        words=base,
        wind=wind,
        files={text: Path(text).resolve() for text in texts if text and Path(text).is_file()},
        flags={
            name: _switch(options[f"--{name}"])
            for name in factors
            if name not in _WIND and _is_flag(options, name)
        },
    )
    study = Study(
        name=f"sweep-{flight.name}",
        description=f"Flights of {flight.name} over {', '.join(factors) or 'seeds alone'}.",
        trial=trial,
        row=FlightRow,
        design=design,
        success="completed",
        options={"mission": mission, "words": shlex.join(words), **_digests(trial.files.values())},
        warm_up=trial.warm_up,
        command=trial.command,
        files=tuple(trial.files.values()),
    )
    trials, opener = Trials(study, 1, 0), VehicleOpener()
    for index in range(len(trials)):  # values that fly refuses are reported before anything is flown
        flight, request = parsed(trial.line(trials[index].values, trials[index].seed))
        check_request(flight, request, opener)
    return study


def _refuse(context: click.Context) -> None:
    """Refuse options that make no sense in a sweep."""
    for parameter in fly.get_params(context):
        if not isinstance(parameter, FlightOption) or parameter.name is None:
            continue
        source = context.get_parameter_source(parameter.name)
        if source is not click.core.ParameterSource.COMMANDLINE:
            continue
        _refuse_option(parameter)


def _refuse_option(option: FlightOption) -> None:
    if option.scope is Scope.CONNECTED:
        raise click.UsageError(f"{option.opts[0]}: a sweep flies embedded vehicles only")
    for name in option.opts:
        if name in _REFUSED:
            raise click.UsageError(f"{name}: {_REFUSED[name]}")


def _factor(
    text: str, options: Mapping[str, FlightOption], mission: str
) -> tuple[str, list[Value] | tuple[float, float]]:
    """Name and values of one --vary."""
    name, equals, values = text.partition("=")
    name = name.removeprefix("--")
    if not (equals and name and values):
        raise click.UsageError(f"--vary {text!r} is not NAME=VALUE,VALUE,... or NAME=LOW..HIGH")
    if name not in _WIND:
        option = options.get(f"--{name}")
        if option is None:
            close = difflib.get_close_matches(name, [*_WIND, *(o.removeprefix("--") for o in options)], n=3)
            more = (
                f"; did you mean {' or '.join(close)}?"
                if close
                else f"; see flightstack fly {mission} --help"
            )
            raise click.UsageError(f"--vary {name}: fly {mission} has no such option{more}")
        _refuse_option(option)
    found = _RANGE.fullmatch(values)
    if found is not None:
        try:
            return name, (float(found[1]), float(found[2]))
        except ValueError:
            raise click.UsageError(f"--vary {text!r} is not NAME=LOW..HIGH, for example speed=3..8") from None
    parts = values.split(";") if ";" in values else values.split(",")
    if not all(parts):
        raise click.UsageError(f"--vary {text!r} has a place without a value")
    if name not in _WIND and _is_flag(options, name):
        try:
            return name, [_YES[part.lower()] for part in parts]
        except KeyError as error:
            raise click.UsageError(f"--vary {text!r}: {error.args[0]!r} is not yes or no") from None
    return name, _typed(parts)


def _typed(parts: list[str]) -> list[Value]:
    """Texts as numbers, if all are; otherwise as they are."""
    for kind in (int, float):
        try:
            return [kind(part) for part in parts]
        except ValueError:
            continue
    return [*parts]


def _is_flag(options: Mapping[str, FlightOption], name: str) -> bool:
    return bool(options[f"--{name}"].is_flag)


def _switch(option: FlightOption) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The words that switch an option on and off."""
    return (option.opts[0],), tuple(option.secondary_opts[:1])


def _design(factors: Mapping[str, list[Value] | tuple[float, float]], sampling: Sampling) -> Design:
    cells = grid(**{name: values for name, values in factors.items() if isinstance(values, list)})
    ranges = {name: values for name, values in factors.items() if isinstance(values, tuple)}
    if not ranges:
        return cells
    return cells * (random_sample(**ranges) if sampling is Sampling.RANDOM else latin_hypercube(**ranges))


def _digests(paths: Any) -> dict[str, str]:
    """Names and contents of files: a study is continued with the same ones only."""
    return {f"sha256 {p.name}": hashlib.sha256(p.read_bytes()).hexdigest()[:16] for p in sorted(set(paths))}


def build(given: Given) -> Study[Any, Any]:
    """The study that the options of `sweep` make."""
    if given["mission"] is None:
        raise click.UsageError(
            "sweep needs a MISSION: its name or its file; flightstack fly --help lists them"
        )
    sampling = made_of_values(SweepOptions, given).sampling
    return sweep_study(given["mission"], given["vary"], given["words"], sampling=sampling)
