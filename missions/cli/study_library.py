"""The command lines of the package's studies."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

import click

from missions.base.options import PlanOptions
from missions.cli.declared_options import Given, declared_options, made_of_values
from missions.cli.later import later
from missions.cli.options import FIRMWARE_HELP
from missions.cli.study_command import StudyCommand
from missions.studies.options import (
    HandoffStudyOptions,
    IdentificationStudyOptions,
    LissajousStudyOptions,
    LocalizationStudyOptions,
    MagneticStudyOptions,
    MultiTargetStudyOptions,
    VisionStudyOptions,
)

_FIRMWARE: Final = click.Option(["--firmware"], metavar="NAME[=BUILD]", help=FIRMWARE_HELP)


def _study(name: str, kind: type[PlanOptions]) -> Callable[[Given], Any]:
    """What makes the study of a module of `missions.studies` from its options."""
    study = later(f"missions.studies.{name}", "study")
    return lambda given: study(made_of_values(kind, given))


def _flights(name: str, kind: type[PlanOptions]) -> Callable[[Given], Any]:
    """As `_study`, of a study whose trials are flights."""
    study = _study(name, kind)
    return lambda given: later("missions.cli.bodies.study", "by_firmware")(study(given), given)


STUDIES: Final[Mapping[str, StudyCommand]] = MappingProxyType(
    {
        "handoff": StudyCommand(
            help=(
                "Moving-target handoff without GPS: two aircraft in opposite orbits, five walking targets, "
                "of which one is the tracker's (Tolman et al. 2021, section VII).\n\n"
                "Image points stand for pixels, unless --camera pixels renders and searches all frames. The "
                "folder gets handoff.png: correct decisions against the time that they take."
            ),
            options=declared_options(HandoffStudyOptions),
            build=_study("handoff", HandoffStudyOptions),
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
            options=declared_options(LocalizationStudyOptions),
            build=_study("lissajous_localization", LocalizationStudyOptions),
        ),
        "lissajous-search": StudyCommand(
            help=(
                "Seven patterns search for a walking tag in 1800 s: Table I of Steckenrider et al. 2020, as "
                "flights on SITL.\n\n"
                "The tag is read off rendered pictures. The folder gets search.png, the share of searches "
                "that have found it over time."
            ),
            options=(*declared_options(LissajousStudyOptions), _FIRMWARE),
            build=_flights("lissajous_search", LissajousStudyOptions),
        ),
        "magnetic-identification": StudyCommand(
            help=(
                "Magnetic targets and false anomalies after one and two passes: Lum et al. 2005.\n\n"
                "Areas under the ROC of the threshold, the paper's confidence, the classifier and the "
                "evidence of classes, on maps and targets that the classifier was not fitted to, and with "
                "larger offsets, more noise and deeper targets. The folder gets roc.png, and passes.png with "
                "figures 4 to 6."
            ),
            options=declared_options(IdentificationStudyOptions),
            build=_study("magnetic_identification", IdentificationStudyOptions),
        ),
        "magnetic-search": StudyCommand(
            help=(
                "Three searchers name a magnetic target among five false anomalies: Lum et al. 2005, "
                "figure 8.\n\n"
                "By passes that detect an anomaly, by the trace of the paper's confidence, and by the "
                "evidence of classes, in the worlds of fly occupancy. The searchers are points that turn at "
                "one rate, or aircraft on SITL."
            ),
            options=declared_options(MagneticStudyOptions),
            build=_study("magnetic_search", MagneticStudyOptions),
        ),
        "multi-target": StudyCommand(
            help=(
                "Search for an unknown number of targets: the experiments E1 and E2 of Yousuf, Lendek and "
                "Busoniu, as flights on SITL.\n\n"
                "The proposed planner beside the paper's, a lawnmower, information alone, a sweep with "
                "detours and ergodic coverage; every run of E2 has a terrain of its own. Worlds that the "
                "filter does not expect are chosen by --world. The folder gets found.png."
            ),
            options=(*declared_options(MultiTargetStudyOptions), _FIRMWARE),
            build=_flights("multi_target_search", MultiTargetStudyOptions),
        ),
        "vision-search": StudyCommand(
            help=(
                "One and two aircraft search a square for a tag with downward cameras, and localize it: "
                "Tisdale et al. 2008, as flights on SITL.\n\n"
                "A fine grid, a coarse grid and particles over the same flights, with their error, sigma and "
                "consistency; the measured pose errors; the error budget of Table II. The folder gets "
                "errors.png."
            ),
            options=(*declared_options(VisionStudyOptions), _FIRMWARE),
            build=_flights("vision_search", VisionStudyOptions),
        ),
    }
)
"""The studies with a name on the command line."""
