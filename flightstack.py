"""What users need of this project, under one name.

    import flightstack as fs

    result = fs.fly("lissajous", fs.RunRequest(options=fs.FlightOptions(width_m=60.0, height_m=60.0)))

The names are the public ones of the packages `flightsim`, `autopilot_bridge`, `estimators`, `missions` and
`missions.studies`. Each is imported when it is used. Other names are private: they may change in any version.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from autopilot_bridge import *
    from estimators import *
    from flightsim import *
    from missions import *
    from missions.studies import *
else:
    from flightsim.foundation.lazy_exports import joined_exports

    __getattr__, __dir__, __all__ = joined_exports(
        __name__, "autopilot_bridge", "estimators", "flightsim", "missions", "missions.studies"
    )
