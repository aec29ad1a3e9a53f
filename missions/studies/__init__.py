"""Monte Carlo studies: a trial, a design of its parameters, engines that run it, and summaries with
intervals.

from missions.studies import Study, grid, run_study

"""

from typing import TYPE_CHECKING, Final

from flightsim.foundation.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from missions.studies.design import Design, grid, latin_hypercube, listed, random_sample
    from missions.studies.flights import FlightRow, fly_trial
    from missions.studies.inline import Inline
    from missions.studies.pool import Pool
    from missions.studies.ray_cluster import RayCluster
    from missions.studies.results import Results
    from missions.studies.running import StudyResult, read_results, run_study, run_trial
    from missions.studies.study import Study
    from missions.studies.trial_runner import KeepLogs, local_file, trial_folder

__all__ = [
    "Design",
    "FlightRow",
    "Inline",
    "KeepLogs",
    "Pool",
    "RayCluster",
    "Results",
    "Study",
    "StudyResult",
    "fly_trial",
    "grid",
    "latin_hypercube",
    "listed",
    "local_file",
    "random_sample",
    "read_results",
    "run_study",
    "run_trial",
    "trial_folder",
]

_MODULES: Final = {
    "Design": "missions.studies.design",
    "FlightRow": "missions.studies.flights",
    "Inline": "missions.studies.inline",
    "KeepLogs": "missions.studies.trial_runner",
    "Pool": "missions.studies.pool",
    "RayCluster": "missions.studies.ray_cluster",
    "Results": "missions.studies.results",
    "Study": "missions.studies.study",
    "StudyResult": "missions.studies.running",
    "fly_trial": "missions.studies.flights",
    "grid": "missions.studies.design",
    "latin_hypercube": "missions.studies.design",
    "listed": "missions.studies.design",
    "local_file": "missions.studies.trial_runner",
    "random_sample": "missions.studies.design",
    "read_results": "missions.studies.running",
    "run_study": "missions.studies.running",
    "run_trial": "missions.studies.running",
    "trial_folder": "missions.studies.trial_runner",
}

__getattr__ = lazy_exports(__name__, _MODULES)
