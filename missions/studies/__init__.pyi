"""Public names of `missions.studies`, each where it is defined; see `__init__.py`."""

from missions.studies.design import Design as Design
from missions.studies.design import grid as grid
from missions.studies.design import latin_hypercube as latin_hypercube
from missions.studies.design import listed as listed
from missions.studies.design import random_sample as random_sample
from missions.studies.flights import FlightRow as FlightRow
from missions.studies.flights import flown_by as flown_by
from missions.studies.flights import fly_trial as fly_trial
from missions.studies.inline import Inline as Inline
from missions.studies.options import KeepLogs as KeepLogs
from missions.studies.pool import Pool as Pool
from missions.studies.ray_cluster import RayCluster as RayCluster
from missions.studies.results import Results as Results
from missions.studies.running import StudyResult as StudyResult
from missions.studies.running import read_results as read_results
from missions.studies.running import run_study as run_study
from missions.studies.running import run_trial as run_trial
from missions.studies.study import Study as Study
from missions.studies.trial_runner import local_file as local_file
from missions.studies.trial_runner import trial_folder as trial_folder
