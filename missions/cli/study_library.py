"""The command lines of the package's studies."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import click

from missions.cli.mission_command import Given, declared_options, made
from missions.cli.options import FiniteRange
from missions.cli.study_command import StudyCommand
from missions.multi_target.options import MultiTargetOptions

if TYPE_CHECKING:
    from missions.studies.study import Study


def _handoff(given: Given) -> "Study[Any, Any]":
    from missions.studies.handoff import study

    return study(
        given["comparison"],
        given["belief"],
        given["window"],
        given["trade_off"],
        given["camera"],
        given["timeout"],
        given["rate"],
    )


def _lissajous_localization(given: Given) -> "Study[Any, Any]":
    from missions.studies.lissajous_localization import study

    return study(given["equations"])


def _lissajous_search(given: Given) -> "Study[Any, Any]":
    from missions.studies.lissajous_search import study

    return study(speed=given["speed"], target_speed=given["target_speed"])


def _magnetic_identification(given: Given) -> "Study[Any, Any]":
    from missions.studies.magnetic_identification import study

    return study(train=given["train"])


def _magnetic_search(given: Given) -> "Study[Any, Any]":
    from missions.occupancy.parameters import Identify
    from missions.studies.magnetic_search import study

    return study([Identify(way) for way in given["identify"]], flights=given["flights"])


def _multi_target(given: Given) -> "Study[Any, Any]":
    from missions.studies.multi_target_search import study

    specified = {name for name, value in given.items() if value is not None}
    return study(made(MultiTargetOptions, _PLANNING, given, specified).planning)


def _vision_search(given: Given) -> "Study[Any, Any]":
    from missions.studies.vision_search import study

    return study(given["model"], given["side"], given["passes"])


_PLANNING: Final = tuple(
    option
    for option in declared_options(MultiTargetOptions)
    if option.user.path == "planning" and option.name != "beam"
)
"""Options of the planner of `fly multi-target`."""

STUDIES: Final[Mapping[str, StudyCommand]] = MappingProxyType(
    {
        "handoff": StudyCommand(
            help=(
                "Moving-target handoff without GPS: two aircraft in opposite orbits, five walking targets, "
                "of which one is the tracker's (Tolman et al. 2021, section VII).\n\n"
                "Image points stand for pixels, unless --camera pixels renders and searches all frames. The "
                "folder gets handoff.png: correct decisions against the time that they take."
            ),
            options=(
                click.Option(
                    ["--comparison"],
                    type=click.Choice(["evidence", "paper", "rms", "all"]),
                    default="evidence",
                    help=(
                        "What decides: probabilities from all pairs of tracks, the paper's thresholds, the "
                        "same with the root mean square as residual, or all three."
                    ),
                ),
                click.Option(
                    ["--belief"],
                    type=click.Choice(["particles", "gaussians"]),
                    default="gaussians",
                    help="What estimates the relative pose.",
                ),
                click.Option(
                    ["--window"],
                    type=click.IntRange(10, 600),
                    default=100,
                    help="Samples of the windows that are compared, at 10 Hz or the rate of a slower camera.",
                ),
                click.Option(
                    ["--trade-off"],
                    is_flag=True,
                    help="Windows of 25 to 100 samples with several thresholds (figure 9), not --window.",
                ),
                click.Option(
                    ["--camera"],
                    type=click.Choice(["points", "pixels"]),
                    default="points",
                    help="Moving points by a model, or found in rendered pictures; slow.",
                ),
                click.Option(
                    ["--timeout"],
                    type=click.FloatRange(1.0, 3600.0),
                    default=900.0,
                    help="A trial without a decision ends then, s.",
                ),
                click.Option(
                    ["--rate"],
                    type=FiniteRange(2.0, 60.0),
                    help="Frames, Hz. [default: 10; with --camera pixels: 30]",
                ),
            ),
            build=_handoff,
        ),
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
        "lissajous-search": StudyCommand(
            help=(
                "Seven patterns search for a walking tag in 1800 s: Table I of Steckenrider et al. 2020, as "
                "flights on SITL.\n\n"
                "The tag is read off rendered pictures. The folder gets search.png, the share of searches "
                "that have found it over time."
            ),
            options=(
                click.Option(
                    ["--speed"],
                    type=FiniteRange(min=0.5, max=10.0),
                    default=5.0,
                    help="Of the vehicle, m/s; the paper does not give it.",
                ),
                click.Option(
                    ["--target-speed"],
                    type=FiniteRange(min=0.0, max=5.0),
                    default=0.3,
                    help="Of the target, m/s; the paper does not give it.",
                ),
            ),
            build=_lissajous_search,
        ),
        "magnetic-identification": StudyCommand(
            help=(
                "Magnetic targets and false anomalies after one and two passes: Lum et al. 2005.\n\n"
                "Areas under the ROC of the threshold, the paper's confidence, the classifier and the "
                "evidence of classes, on maps and targets that the classifier was not fitted to, and with "
                "larger offsets, more noise and deeper targets. The folder gets roc.png, and passes.png with "
                "figures 4 to 6."
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
        "magnetic-search": StudyCommand(
            help=(
                "Three searchers name a magnetic target among five false anomalies: Lum et al. 2005, "
                "figure 8.\n\n"
                "By passes that detect an anomaly, by the trace of the paper's confidence, and by the "
                "evidence of classes, in the worlds of fly occupancy. The searchers are points that turn at "
                "one rate, or aircraft on SITL."
            ),
            options=(
                click.Option(
                    ["--identify"],
                    type=click.Choice(["threshold", "trace", "bayes"]),
                    multiple=True,
                    default=("threshold", "trace", "bayes"),
                    help="Ways that are compared; repeat.",
                ),
                click.Option(["--flights"], is_flag=True, help="Flights of fly occupancy, not points."),
            ),
            build=_magnetic_search,
        ),
        "multi-target": StudyCommand(
            help=(
                "Search for an unknown number of targets: the experiments E1 and E2 of Yousuf, Lendek and "
                "Busoniu, as flights on SITL.\n\n"
                "The proposed planner beside a lawnmower and information alone. The folder gets found.png."
            ),
            options=_PLANNING,
            build=_multi_target,
        ),
        "vision-search": StudyCommand(
            help=(
                "One and two aircraft search a square for a tag with downward cameras, and localize it: "
                "Tisdale et al. 2008, as flights on SITL.\n\n"
                "A fine grid, a coarse grid and particles over the same flights, with their error, sigma and "
                "consistency; the measured pose errors; the error budget of Table II. The folder gets "
                "errors.png."
            ),
            options=(
                click.Option(["--model"], default="aerosonde", help="Of the vehicles."),
                click.Option(
                    ["--side"],
                    type=FiniteRange(min=100.0, max=5000.0),
                    default=1000.0,
                    help="Of the searched square, m.",
                ),
                click.Option(
                    ["--passes"], type=click.IntRange(1, 100), default=4, help="Over the target, of each."
                ),
            ),
            build=_vision_search,
        ),
    }
)
"""The studies with a name on the command line."""
