"""The Monte Carlo study `lissajous-localization`: two drones on Lissajous paths localise a target (Table
IV).
"""

from pathlib import Path

from missions.studies.design import listed
from missions.studies.lissajous_figures import draw_paths, draw_target
from missions.studies.lissajous_setting import CELLS, READINGS
from missions.studies.lissajous_table import lines_of, summarise
from missions.studies.lissajous_trial import (
    Errors,
    LissajousCell,
    LocalizationTrial,
    compile_study,
    sample_run,
)
from missions.studies.options import LocalizationStudyOptions
from missions.studies.results import Results
from missions.studies.study import Study


def study(options: LocalizationStudyOptions | None = None) -> Study[LissajousCell, Errors]:
    """The study.

    Args:
        options: None: the defaults.
    """
    equations = (options or LocalizationStudyOptions()).equations.value
    return Study(
        name="lissajous-localization",
        description=(
            "Two drones on Lissajous paths localise a target: Tables II to V of Steckenrider et al. 2020."
        ),
        trial=LocalizationTrial(equations=READINGS[equations]),
        parameters=LissajousCell,
        row=Errors,
        design=listed([{"epsilon": epsilon, "delta": delta} for epsilon, delta in CELLS]),
        runs=1000,
        metrics=(),
        options={"equations": equations},
        warm_up=compile_study,
        summarise=summarise,
        report=lines_of,
        draw=draw,
    )


def draw(results: Results, folder: Path) -> None:
    """Draw figures 6 and 7."""

    sample = sample_run(results.seed)
    draw_paths(folder / "figure_6.png", sample)
    draw_target(folder / "figure_7.png", sample)
