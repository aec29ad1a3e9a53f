"""Monte Carlo studies: a trial, a design of its parameters, engines that run it, and summaries with
intervals.

from missions.studies import Study, grid, run_study

"""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
