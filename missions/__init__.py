"""Missions, and the runs that fly them: on an embedded SITL, or on any vehicle.

from missions import FlightOptions, RunRequest, fly

result = fly("lissajous", RunRequest(options=FlightOptions(width_m=60.0, height_m=60.0)))
print(result.outcome, result.summary["path_rms_error_m"], result.folder)

"""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
