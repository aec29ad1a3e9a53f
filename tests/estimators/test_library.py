"""Estimators by name and by file, and their parameters from text."""

import subprocess
import sys
from pathlib import Path

import pytest

from estimators.errors import EstimatorError
from estimators.interface import Estimator
from estimators.library import estimator_class, make_estimator, parameters_from
from estimators.names import ESTIMATORS


@pytest.mark.parametrize("name", list(ESTIMATORS))
def test_each_name_gives_its_estimator(name):
    found = estimator_class(name)
    assert name == found.NAME
    assert issubclass(found, Estimator)
    assert found().needs


def test_a_file_needs_no_registration(level):
    assert make_estimator(level).NAME == "level"


def test_the_library_alone_imports_no_estimator():
    code = "import sys, estimators.library; print([m for m in sys.modules if 'attitude' in m])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("name", "reported"),
    [
        ("atitude", f"'atitude' is not known; there are {', '.join(ESTIMATORS)}"),
        ("nowhere.py", "nowhere.py does not exist"),
    ],
)
def test_unknown_names_are_reported_with_those_that_there_are(name, reported):
    with pytest.raises(EstimatorError, match=reported):
        estimator_class(name)


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        ("x = 1", "holds no estimator"),
        ("def f(:", "can't be loaded: SyntaxError"),
        ("1 / 0", "can't be loaded: ZeroDivisionError"),
        ("from estimators.attitude import *", "holds no estimator"),
    ],
)
def test_a_file_that_is_no_estimator_says_why(tmp_path, text, reported):
    path = tmp_path / "mine.py"
    path.write_text(text)
    with pytest.raises(EstimatorError, match=reported):
        estimator_class(str(path))


def test_two_estimators_in_a_file_are_one_too_many(tmp_path, level):
    path = tmp_path / "two.py"
    text = Path(level).read_text(encoding="utf-8")
    path.write_text(text + "\nclass Second(LevelEstimator):\n    NAME = 'second'\n")
    with pytest.raises(EstimatorError, match=r"holds 2 estimators \(LevelEstimator, Second\)"):
        estimator_class(str(path))


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("weight=0.5", 0.5), ("samples=-3", -3), ("publish=false", False), ("publish=On", True),
        ("label=a=b", "a=b"), ("limit_deg=none", None), ("limit-deg=4", 4.0), ("shape=none", "none"),
        ("gains=", ()), ("gains=1,2.5, 3", (1.0, 2.5, 3.0)), ("axes=4,0.5", (4, 0.5)),
    ],
)  # fmt: skip
def test_parameters_from_text(level, setting, value):
    parameters = parameters_from(estimator_class(level), [setting])
    found = getattr(parameters, setting.partition("=")[0].replace("-", "_"))
    assert getattr(found, "value", found) == value
    assert type(getattr(found, "value", found)) is type(value)


@pytest.mark.parametrize(
    ("setting", "reported"),
    [
        ("weight", "'weight' is not NAME=VALUE"),
        ("wieght=1", "level has no parameter 'wieght'; there are: weight, samples, publish"),
        ("weight=heavy", "weight: 'heavy' is not a number"),
        ("weight=nan", "weight: 'nan' is not a number"),
        ("weight=2", "level: weight 2 is not in 0..1"),
        ("samples=1.5", "samples: '1.5' is not a whole number"),
        ("publish=maybe", "publish: 'maybe' is not accepted; give true or false"),
        ("limit_deg=x", "limit_deg: 'x' is not a number, or none"),
        ("shape=round", "shape: 'round' is not accepted; there are exponential, none"),
        ("axes=1", "axes: '1' is not 2 values"),
    ],
)
def test_wrong_parameters_are_named_with_what_is_accepted(level, setting, reported):
    with pytest.raises(EstimatorError, match=reported):
        make_estimator(level, [setting])


@pytest.mark.parametrize(
    ("old", "new", "reported"),
    [
        ('NAME = "level"', "pass", "NAME is None; give letters"),
        ('NAME = "level"', 'NAME = "../level"', "NAME is '../level'; give letters"),
        ("PARAMETERS = LevelParameters", "pass", "PARAMETERS is no dataclass"),
        ("super().__init__(parameters)", "pass", "does not call super().__init__"),
        ("super().__init__(parameters)", "1 / 0", "LevelEstimator() failed: ZeroDivisionError"),
        ("class Shape(", "raise SystemExit(4)\nclass Shape(", "can't be loaded: SystemExit: 4"),
    ],
)
def test_what_an_estimator_file_lacks_is_reported(tmp_path, level, old, new, reported):
    path = tmp_path / "mine.py"
    text = Path(level).read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(EstimatorError) as raised:
        make_estimator(str(path))
    assert reported in str(raised.value) and str(path) in str(raised.value)
