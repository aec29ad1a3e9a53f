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
    }
)
"""The studies with a name on the command line."""
