"""Creates an estimator by its name, or from a user's Python file by its path, with parameters from text."""

import importlib
import importlib.util
import inspect
import re
import sys
import types
from collections.abc import Iterable
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, Final

from estimators.errors import EstimatorError, described
from estimators.interface import Estimator
from estimators.names import ESTIMATORS, GROUP
from flightsim.foundation.conversion import Conversion, Refused
from flightsim.foundation.options import declared
from flightsim.foundation.plug_ins import plug_ins

_NAME: Final = re.compile(r"[\w-]+")


def make_estimator(name: str, settings: Iterable[str] = ()) -> Estimator[Any]:
    """Create an estimator with parameters.

    Args:
        name: one of `estimators.names`, or of a user's package, or the path of a Python file.
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
        return _checked(_the_one(_load(path), f"estimator file {path}"), f"estimator file {path}")
    if name not in ESTIMATORS:
        return _of_package(name)
    module = importlib.import_module(ESTIMATORS[name])
    exported = [getattr(module, item) for item in getattr(module, "__all__", ())]
    for candidate in exported:
        if inspect.isclass(candidate) and issubclass(candidate, Estimator) and name == candidate.NAME:
            return candidate
    raise EstimatorError(f"{ESTIMATORS[name]} exports no estimator named {name!r}")


def _of_package(name: str) -> type[Estimator[Any]]:
    """The class of an estimator that a user's package names."""
    others = plug_ins(GROUP)
    if name not in others:
        raise EstimatorError(
            f"estimator {name!r} is not known; there are {', '.join((*ESTIMATORS, *others))}, "
            "or the path of a Python file (.py) with an Estimator of your own"
        )
    where = f"estimator {name!r} of {others[name].value}"
    try:
        found = others[name].load()
    except Exception as error:
        raise EstimatorError(f"{where} can't be loaded: {described(error)}") from error
    if not (inspect.isclass(found) and issubclass(found, Estimator)):
        raise EstimatorError(f"{where} is no class on estimators.interface.Estimator")
    return _checked(found, where)


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


def _checked(found: type[Estimator[Any]], where: str) -> type[Estimator[Any]]:
    """Check that a user's class has everything that the command line needs."""
    name = getattr(found, "NAME", None)
    if not (isinstance(name, str) and _NAME.fullmatch(name)):
        raise EstimatorError(
            f"{where}: {found.__name__}.NAME is {name!r}; give letters, digits, '-' and '_', "
            "for run folders are named after it"
        )
    if not is_dataclass(getattr(found, "PARAMETERS", None)):
        raise EstimatorError(f"{where}: {found.__name__}.PARAMETERS is no dataclass; name one")
    try:
        complete = hasattr(found(), "parameters")
    except Exception as error:
        raise EstimatorError(f"{where}: {found.__name__}() failed: {described(error)}") from error
    if not complete:
        raise EstimatorError(f"{where}: {found.__name__}.__init__ does not call super().__init__(parameters)")
    return found


def parameters_from(found: type[Estimator[Any]], settings: Iterable[str]) -> Any:
    """Parameters of an estimator from NAME=VALUE texts; parameters that are not named keep their defaults.

    Raises:
        EstimatorError: a text is not NAME=VALUE, the parameter does not exist, or it does not accept the
            value.
    """
    kinds = {each.name: each for each in declared(found.PARAMETERS)}
    texts = Conversion(text=True)
    values: dict[str, Any] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        name = name.strip().replace("-", "_")
        if not (name and equals):
            raise EstimatorError(f"`settings` {setting!r} is not NAME=VALUE")
        if name not in kinds:
            accepted = ", ".join(kinds) if kinds else "none"
            raise EstimatorError(f"{found.NAME} has no parameter {name!r}; there are: {accepted}")
        try:
            values[name] = texts.value(kinds[name].hint, text.strip())
        except Refused as error:
            raise EstimatorError(f"{name}: {error}") from None
    try:
        return found.PARAMETERS(**values)
    except (ValueError, TypeError) as error:
        raise EstimatorError(f"{found.NAME}: {error}") from error
