"""Options are declared once: their texts, their defaults, and the page about them."""

import re
from dataclasses import fields
from inspect import signature
from itertools import pairwise
from pathlib import Path
from typing import get_args

import click
import pytest

from autopilot_bridge.sitl import SigningParameters, UnsignedFrom
from estimators.library import estimator_class
from estimators.logs.mutate import mutated_records
from estimators.names import ESTIMATORS
from flightsim.airframe import LaunchKind
from flightsim.environment import Turbulence
from flightsim.foundation.options import Declared, Options, declared
from flightsim.foundation.user_options import user_options
from flightsim.sensors import RECEIVERS
from flightsim.wind_profile import WindLaw
from flightsim.world_spec import HOMES
from missions.base.options import SeedOptions
from missions.base.run_options import ServedWorldOptions
from missions.cli import options_page
from missions.cli.declared_options import DeclaredOption, chosen_names, specified
from missions.cli.fly import fly
from missions.cli.fly_command import _COMMANDS
from missions.cli.main import command_line
from missions.estimation.log_options import PlayOptions
from missions.runs.log_play import play
from missions.studies.options import StudyRunOptions
from missions.studies.running import run_study
from missions.survey.options import CALIBRATION_ALTITUDE_M, SurveyOptions

PAGE = Path(__file__).parents[1] / "docs/options.md"
NO_NOUNS = re.compile(
    r"(an?|and|as|at|by|don't|for|from|give|how|if|in|its?|of|on|or|so|that|the|their|these|they|this|to)\b"
    r"|(what(?!:)|where|which|with|without|draw|find|fly|keep|leave|look|make|print|show|speak|take|use)\b"
    r"|run (?!folder)",
    re.IGNORECASE,
)
"""Words with which a text would begin that can't be read alone, or that is a command."""

MISSIONS = {name: command.options_class for name, command in _COMMANDS.items()}
WORLDS = {name: command.part_class for name, command in _COMMANDS.items() if command.part is not None}
PARAMETERS = {name: estimator_class(name).PARAMETERS for name in ESTIMATORS}
OWNERS = {
    option.owner: command
    for _, command in options_page.commands_of(command_line)
    for option in command.params
    if isinstance(option, DeclaredOption)
}
"""The classes of the options of the other commands, each with a command that has it."""
CLASSES = [*MISSIONS.values(), *WORLDS.values(), *PARAMETERS.values(), *OWNERS]


def held_by(kind: type) -> list[Declared]:
    return [each for each in declared(kind) if isinstance(each.default, Options)]


def every_declaration() -> dict[tuple[type, str], Declared]:
    kinds = [*CLASSES, *(held.kind for kind in MISSIONS.values() for held in held_by(kind))]
    return {(kind, each.name): each for kind in dict.fromkeys(kinds) for each in declared(kind)}


def test_the_page_has_what_the_fields_declare():
    page = PAGE.read_text(encoding="utf-8")
    written = options_page.with_tables(page)
    assert page == written, "run python -m missions.cli.options_page docs/options.md"


def test_texts_begin_with_a_noun_and_stand_alone():
    wrong = []
    for (kind, name), each in every_declaration().items():
        text = each.option.help
        if not text:
            continue
        sentences = text.endswith(".") and not re.search(r"[a-z]\. [A-Z]", text)
        if not text[0].isupper() or NO_NOUNS.match(text) or not sentences:
            wrong.append((kind.__name__, name, text))
    assert wrong == []


def helps(command, path="flightstack"):
    """Where and what of each text of the command line that is not one of a field."""
    for parameter in command.params:
        if (
            isinstance(parameter, click.Option)
            and not isinstance(parameter, DeclaredOption)
            and parameter.help
        ):
            yield f"{path} {parameter.opts[0]}", parameter.help
    if isinstance(command, click.Group):
        with click.Context(command) as context:
            for name in command.list_commands(context):
                yield from helps(command.get_command(context, name), f"{path} {name}")


def test_the_other_texts_of_the_command_line_begin_with_a_noun_too():
    found = {
        where: text for where, text in helps(command_line) if where.split()[-1] not in ("--help", "--version")
    }
    assert len(found) > 90
    assert {
        where: text for where, text in found.items() if not text[0].isupper() or NO_NOUNS.match(text)
    } == {}


@pytest.mark.parametrize("name", ESTIMATORS)
def test_each_parameter_of_an_estimator_has_a_text(name):
    assert issubclass(PARAMETERS[name], Options)
    assert [each.name for each in declared(PARAMETERS[name]) if not each.option.help] == []


@pytest.mark.parametrize("name", MISSIONS)
def test_the_command_line_makes_the_defaults_of_python(name):
    file = {"a mission of your own": "mine.py", "a mission file": "field.plan"}.get(name, name)
    with fly.make_context("fly", [file]) as context:
        chosen = chosen_names(context)
        options = context.meta["mission command"].build(context.params, chosen, vehicles=1)
    plain = MISSIONS[name]()
    for each in fields(plain):
        if each.name != "given":
            assert getattr(options, each.name) == getattr(plain, each.name), each.name


@pytest.mark.parametrize(
    ("words", "altitude_m"), [((), 800.0), (("--altitude", "300"), 300.0), (("--altitude", "80"), 80.0)]
)
def test_a_flight_of_calibration_is_as_high_from_python(words, altitude_m):
    with fly.make_context("fly", ["survey", "--calibrate", *words]) as context:
        chosen = chosen_names(context)
        options = context.meta["mission command"].build(context.params, chosen, vehicles=1)
    assert options.altitude_m == altitude_m
    assert SurveyOptions(calibrate=True, altitude_m=altitude_m, given=options.given) == options
    assert SurveyOptions(calibrate=True).altitude_m == CALIBRATION_ALTITUDE_M


@pytest.mark.parametrize("name", MISSIONS)
def test_a_mission_has_the_defaults_of_the_estimator_whose_parameters_it_holds(name):
    """All fields, also those of a class on the parameters, which the estimator has for itself."""
    for holder in held_by(MISSIONS[name]):
        kinds = [kind for kind in PARAMETERS.values() if issubclass(kind, holder.kind)]
        for own in (kind() for kind in kinds):
            for each in declared(holder.kind):
                assert getattr(holder.default, each.name) == getattr(own, each.name), (holder.name, each.name)


def test_missions_hold_the_parameters_of_estimators():
    holders = {
        name for name, kind in MISSIONS.items() for held in held_by(kind) if issubclass(held.kind, Options)
    }
    assert {"orbit", "handoff", "vision-search", "multi-target", "occupancy", "survey"} <= holders


@pytest.mark.parametrize("name", MISSIONS)
def test_a_mission_declares_nothing_that_it_holds(name):
    """No text stands at two fields of what a mission's options declare, hold or inherit."""
    kind = MISSIONS[name]
    texts: dict[str, list[str]] = {}
    for owner in (kind, *(held.kind for held in held_by(kind))):
        for each in declared(owner):
            if each.option.help:
                texts.setdefault(each.option.help, []).append(f"{owner.__name__}.{each.name}")
    assert [names for names in texts.values() if len(names) > 1] == []


def test_a_derived_class_does_not_repeat_a_declaration():
    """Another default of a base's field is an `other_default`, which has the text of the base."""
    repeated = []
    for kind in dict.fromkeys(CLASSES):
        line = [
            base
            for base in kind.__mro__
            if issubclass(base, Options) and "__dataclass_fields__" in vars(base)
        ]
        for own, base in pairwise(line):
            texts = {each.name: each.option.help for each in declared(base) if each.option.help}
            for each in fields(own):
                mine = each.metadata.get("option")
                inherited = each is base.__dataclass_fields__.get(each.name)  # type: ignore[attr-defined]
                if mine is not None and not inherited and mine.help == texts.get(each.name):
                    repeated.append((own.__name__, each.name))
    assert repeated == []


def test_the_command_line_states_no_default_of_its_own():
    further = [
        option.name
        for command in _COMMANDS.values()
        for option in command.options
        if not isinstance(option, DeclaredOption) and isinstance(option.default, str | int | float)
    ]
    assert further == []


def test_no_command_states_a_number_of_its_own():
    """Switches and paths have no field, nor texts without a default; a number and a default have one."""
    plain = []
    for name, command in options_page.commands_of(command_line):
        for option in command.params:
            if not isinstance(option, click.Option) or isinstance(option, DeclaredOption) or option.is_flag:
                continue
            number = isinstance(option.type, click.types.IntParamType | click.types.FloatParamType)
            default = option.get_default(click.Context(command))
            if number or (isinstance(default, str | int | float | tuple) and default):
                plain.append(f"{name} {option.opts[0]}")
    assert plain == []


@pytest.mark.parametrize("kind", OWNERS, ids=lambda kind: kind.__name__)
def test_a_command_makes_the_defaults_of_python(kind):
    with click.Context(OWNERS[kind]) as context:
        context.params = {p.name: p.get_default(context) for p in OWNERS[kind].params}
        assert specified(kind) == kind()


def test_the_words_of_a_world_are_those_of_the_classes_that_it_is_made_of():
    """Those classes need NumPy, so that help would be slow with them."""
    words = {each.name: get_args(each.kind) for each in declared(ServedWorldOptions)}
    assert words["turbulence"] == tuple(Turbulence) and words["launch"] == tuple(LaunchKind)
    assert words["gps"] == RECEIVERS and words["autopilot"] == tuple(HOMES)
    assert set(words["wind_profile"]) < set(WindLaw) and words["unsigned"] == tuple(UnsignedFrom)
    assert SigningParameters().unsigned_from == ServedWorldOptions().unsigned


@pytest.mark.parametrize(
    ("function", "options"),
    [(run_study, StudyRunOptions()), (play, PlayOptions()), (mutated_records, SeedOptions())],
    ids=lambda each: getattr(each, "__name__", ""),
)
def test_functions_have_the_defaults_of_the_options(function, options):
    stated = {name: p.default for name, p in signature(function).parameters.items()}
    shared = [each.name for each in declared(type(options)) if each.name in stated]
    assert shared
    for name in shared:
        value = getattr(options, name)
        assert stated[name] == (float(value) if name == "speed" else value)


def test_an_option_of_a_mission_is_one_field():
    """Each field with a text is an option: nothing else must be edited for it."""
    for name, command in _COMMANDS.items():
        shown = {user.name for user in user_options(MISSIONS[name])}
        options = {o.user.name for o in command.options if isinstance(o, DeclaredOption)}
        assert shown - set(command.without) <= options
        assert set(command.without) <= shown, name
