"""The `jsbsim` package, or a stand-in that fails when it is used: missions on links need no simulator.

JSBSim has no wheel for Linux on ARM64, and a companion computer has no use for it.
"""

from typing import Any

from flightsim.foundation.packages import MissingPackage, missing

__all__ = ["jsbsim"]


class _Absent:
    """Has every name of the package; a call of one, also to make an object, raises MissingPackage."""

    def __getattr__(self, name: str) -> Any:
        def refuse(*_arguments: object, **_more: object) -> None:
            raise MissingPackage(missing("jsbsim", "a simulated vehicle"), name="jsbsim")

        return type(name, (Exception,), {"__init__": refuse})


try:
    import jsbsim
except ModuleNotFoundError:
    jsbsim = _Absent()  # type: ignore[assignment]
