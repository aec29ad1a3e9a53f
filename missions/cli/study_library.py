"""The command lines of the package's studies."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli.mission_command import Given
from missions.cli.study_command import StudyCommand

if TYPE_CHECKING:
    from missions.studies.study import Study


def _lissajous_localization(given: Given) -> "Study[Any, Any]":
    from missions.studies.lissajous_localization import study

    return study(given["equations"])


def _magnetic_identification(given: Given) -> "Study[Any, Any]":
    from missions.studies.magnetic_identification import study

    return study(train=given["train"])


STUDIES: Final[Mapping[str, StudyCommand]] = MappingProxyType(
    {
        "lissajous-localization": StudyCommand(
            help=(
                "Two drones on Lissajous paths localise a target: Tables II to V of Steckenrider et al. "
                "2020.\n\n"
                "No filter (N), Kalman filter (K), the paper's (P), and one with the frequencies as "
                "states (F), "
                "beside the paper's Table IV. There are 20 cells. The folder gets figure_6.png and "
                "figure_7.png."
            ),
            options=(
                click.Option(
                    ["--equations"],
                    type=click.Choice(["corrected", "printed", "both"]),
                    default="both",
                    help="The paper's as they must be, as they are printed, or both.",
                ),
            ),
            build=_lissajous_localization,
        ),
        "magnetic-identification": StudyCommand(
            help=(
                "Magnetic targets and false anomalies after one and two passes: Lum et al. 2005.\n\n"
                "Areas under the ROC of the threshold, the paper's confidence, the classifier and the "
                "evidence of classes, on maps and targets that the classifier was not fitted to, and with "
                "larger offsets, more noise and deeper targets. The folder gets roc.png."
            ),
            options=(
                click.Option(
                    ["--train"],
                    is_flag=True,
                    help="Fit the classifier to the rows (needs the extra `learn`); writes classifier.toml.",
                ),
            ),
            build=_magnetic_identification,
        ),
    }
)
"""The studies with a name on the command line."""
