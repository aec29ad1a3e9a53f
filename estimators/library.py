"""Creates an estimator by its name, or from a user's Python file by its path, with parameters from text."""

import importlib
import importlib.util
import inspect
import math
import re
import sys
import types
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Literal, Union, get_args, get_origin, get_type_hints

from estimators.errors import EstimatorError, described
from estimators.interface import Estimator

ESTIMATORS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "attitude": "estimators.attitude",
        "handoff": "estimators.handoff",
        "lissajous": "estimators.lissajous",
        "magnetic-identification": "estimators.magnetic_identification",
        "multi-target": "estimators.multi_target",
        "orbit-target": "estimators.orbit_target",
        "relative-pose": "estimators.relative_pose",
        "survey": "estimators.survey",
        "target-fusion": "estimators.target_fusion",
        "vision-search": "estimators.vision_search",
    }
)
"""Module of each estimator that has a name; it is imported only when it is used."""

_NAME: Final = re.compile(r"[\w-]+")
_TRUE: Final = ("1", "true", "yes", "on")
_FALSE: Final = ("0", "false", "no", "off")


def make_estimator(name: str, settings: Iterable[str] = ()) -> Estimator[Any]:
    """Create an estimator with parameters.

    Args:
        name: one of `ESTIMATORS`, or the path of a Python file.
        settings: parameters as NAME=VALUE.

    Raises:
        EstimatorError: the estimator or a parameter does not exist; the message lists the existing ones.
    """
    found = estimator_class(name)
    return found(parameters_from(found, settings))


def estimator_class(name: str) -> type[Estimator[Any]]:
    """The class of an estimator; a file must hold exactly one.

    Raises:
        EstimatorError: the estimator does not exist, or the file can't be loaded or contains none or several.
    """
    if name.endswith(".py"):
        path = Path(name)
        return _checked(_the_one(_load(path), f"estimator file {path}"), path)
    if name not in ESTIMATORS:
        raise EstimatorError(
            f"estimator {name!r} is not known; there are {', '.join(ESTIMATORS)}, "
            "or the path of a Python file (.py) with an Estimator of your own"
        )
    module = importlib.import_module(ESTIMATORS[name])
    exported = [getattr(module, item) for item in getattr(module, "__all__", ())]
    for candidate in exported:
        if inspect.isclass(candidate) and issubclass(candidate, Estimator) and name == candidate.NAME:
            return candidate
    raise EstimatorError(f"{ESTIMATORS[name]} exports no estimator named {name!r}")


def _load(path: Path) -> types.ModuleType:
    if not path.is_file():
        raise EstimatorError(f"estimator file {path} does not exist")
    # Registered under a name that no package has, because dataclasses look up their module while it is being
    # loaded.
    label = f"_estimator_file_{path.stem}"
    spec = importlib.util.spec_from_file_location(label, path)
    if spec is None or spec.loader is None:
        raise EstimatorError(f"estimator file {path} is not Python; its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[label] = module
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # a script that is not meant as a module may exit
        del sys.modules[label]
        raise EstimatorError(f"estimator file {path} can't be loaded: {described(error)}") from error
    return module


def _the_one(module: types.ModuleType, where: str) -> type[Estimator[Any]]:
    """The estimator class that a module defines itself; imported classes do not count."""
    found: list[type[Estimator[Any]]] = [
        item
        for item in vars(module).values()
        if inspect.isclass(item)
        and issubclass(item, Estimator)
        and item.__module__ == module.__name__
        and not inspect.isabstract(item)
    ]
    if len(found) == 1:
        return found[0]
    names = ", ".join(item.__name__ for item in found)
    raise EstimatorError(
        f"{where} holds {len(found)} estimators ({names}); leave one" if found
        else f"{where} holds no estimator; define a class on estimators.interface.Estimator"
    )  # fmt: skip


def _checked(found: type[Estimator[Any]], path: Path) -> type[Estimator[Any]]:
    """Check that a user's class has everything that the command line needs."""
    name = getattr(found, "NAME", None)
    if not (isinstance(name, str) and _NAME.fullmatch(name)):
        raise EstimatorError(
            f"estimator file {path}: {found.__name__}.NAME is {name!r}; give letters, digits, '-' and '_', "
            "for run folders are named after it"
        )
    if not is_dataclass(getattr(found, "PARAMETERS", None)):
        raise EstimatorError(f"estimator file {path}: {found.__name__}.PARAMETERS is no dataclass; name one")
    try:
        complete = hasattr(found(), "parameters")
    except Exception as error:
        raise EstimatorError(
            f"estimator file {path}: {found.__name__}() failed: {described(error)}"
        ) from error
    if not complete:
        raise EstimatorError(
            f"estimator file {path}: {found.__name__}.__init__ does not call super().__init__(parameters)"
        )
    return found


def parameters_from(found: type[Estimator[Any]], settings: Iterable[str]) -> Any:
    """Parameters of an estimator from NAME=VALUE texts; parameters that are not named keep their defaults.

    Raises:
        EstimatorError: a text is not NAME=VALUE, the parameter does not exist, or it does not accept the
            value.
    """
    kinds = _kinds(found.PARAMETERS)
    values: dict[str, Any] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        name = name.strip().replace("-", "_")
        if not (name and equals):
            raise EstimatorError(f"`settings` {setting!r} is not NAME=VALUE")
        if name not in kinds:
            accepted = ", ".join(kinds) if kinds else "none"
            raise EstimatorError(f"{found.NAME} has no parameter {name!r}; there are: {accepted}")
        values[name] = _value(text.strip(), kinds[name], name)
    try:
        return found.PARAMETERS(**values)
    except (ValueError, TypeError) as error:
        raise EstimatorError(f"{found.NAME}: {error}") from error


def _kinds(parameters: type[Any]) -> dict[str, Any]:
    hints = get_type_hints(parameters)
    return {field.name: hints[field.name] for field in fields(parameters) if field.init}


def _value(text: str, kind: Any, name: str) -> Any:
    """Convert a text to a value of an annotated type."""
    origin = get_origin(kind)
    if origin in (Union, types.UnionType):
        return _one_of(text, get_args(kind), name)
    if origin is Literal:
        return _choice(text, {str(value): value for value in get_args(kind)}, name)
    if origin is tuple:
        return _tuple(text, get_args(kind), name)
    if kind is bool:
        if text.lower() in _TRUE or text.lower() in _FALSE:
            return text.lower() in _TRUE
        raise EstimatorError(f"{name}: {text!r} is not accepted; give true or false")
    if kind in (int, float):
        return _number(text, kind, name)
    if kind is str:
        return text
    if inspect.isclass(kind) and issubclass(kind, Enum):
        return _choice(text, {str(member.value): member for member in kind}, name)
    if kind is Path:
        return Path(text)
    raise EstimatorError(f"{name} can't be given as text; set it in Python")


def _number(text: str, kind: type[Any], name: str) -> Any:
    try:
        number = kind(text)
    except ValueError:
        accepted = "a whole number" if kind is int else "a number"
        raise EstimatorError(f"{name}: {text!r} is not {accepted}") from None
    if math.isnan(number):
        raise EstimatorError(f"{name}: {text!r} is not a number")
    return number


def _choice(text: str, known: Mapping[str, Any], name: str) -> Any:
    if text not in known:
        raise EstimatorError(f"{name}: {text!r} is not accepted; there are {', '.join(known)}")
    return known[text]


def _one_of(text: str, kinds: tuple[Any, ...], name: str) -> Any:
    if type(None) in kinds and text.lower() in ("none", ""):
        return None
    errors: list[str] = []
    # Every input is valid text, so text is tried last.
    for kind in sorted((k for k in kinds if k is not type(None)), key=lambda k: k is str):
        try:
            return _value(text, kind, name)
        except EstimatorError as error:
            errors.append(str(error))
    accepts_none = ", or none" if type(None) in kinds else ""
    raise EstimatorError(errors[-1] + accepts_none)


def _tuple(text: str, kinds: tuple[Any, ...], name: str) -> tuple[Any, ...]:
    parts = [part.strip() for part in text.split(",")] if text else []
    if len(kinds) == 2 and kinds[1] is Ellipsis:
        return tuple(_value(part, kinds[0], name) for part in parts)
    if len(parts) != len(kinds):
        raise EstimatorError(f"{name}: {text!r} is not {len(kinds)} values with commas between")
    return tuple(_value(part, kind, name) for part, kind in zip(parts, kinds, strict=True))
