"""JSBSim behind a quiet, typed edge: load a model, find its properties. Its messages go to `logging`."""

import logging
from typing import Any, Final

import jsbsim

from flightsim.airframe import Airframe, AirframeError

_LOG: Final = logging.getLogger("flightsim.jsbsim")
_LOG.addHandler(logging.NullHandler())

_EULER: Final = 1.0
_ADAMS_BASHFORTH_2: Final = 3.0
_ADAMS_BASHFORTH_3: Final = 4.0
# JSBSim's contact solver brings a sliding foot to rest in one Euler step; with its default Adams-Bashforth
# velocities that rings for ever. Euler also makes the change of velocity exactly the specific force times dt,
# as an IMU that integrates sees it. Second order for the attitude, which JSBSim has at first.
_INTEGRATORS: Final = (
    ("rate/rotational", _EULER),
    ("rate/translational", _EULER),
    ("position/rotational", _ADAMS_BASHFORTH_2),
    ("position/translational", _ADAMS_BASHFORTH_3),
)


class _Messages(jsbsim.FGLogger):
    """Collects JSBSim's log records; without it they go to the terminal from C++."""

    def __init__(self) -> None:
        super().__init__()
        self._level = int(jsbsim.LogLevel.DEBUG)
        self._parts: list[str] = []
        self.warnings: list[str] = []

    def set_level(self, level: int) -> None:
        self._level = int(level)

    def file_location(self, filename: str, line: int) -> None:
        self._parts.append(f"{filename}:{line}: ")

    def message(self, message: str) -> None:
        self._parts.append(message)

    def format(self, format: int) -> None:
        """Colours mean nothing here."""

    def flush(self) -> None:
        text = "".join(self._parts).strip()
        self._parts.clear()
        if not text:
            return
        if int(jsbsim.LogLevel.WARN) <= self._level <= int(jsbsim.LogLevel.FATAL):
            self.warnings.append(text)
            _LOG.warning("%s", text)
        else:
            _LOG.debug("%s", text)


def load_fdm(airframe: Airframe, physics_rate_hz: int) -> tuple[jsbsim.FGFDMExec, tuple[str, ...]]:
    """A new, independent JSBSim instance with the model loaded. Prints nothing.

    JSBSim keeps its logger per thread; this leaves ours installed in the calling thread.

    Returns:
        The instance, and the warnings JSBSim had about the model (none for a clean one).

    Raises:
        AirframeError: JSBSim refuses the model; the message carries its reasons.
    """
    messages = _Messages()
    jsbsim.set_logger(messages)
    fdm = jsbsim.FGFDMExec(str(airframe.folder))
    fdm.set_debug_level(0)
    fdm.set_aircraft_path(".")
    fdm.set_dt(1.0 / physics_rate_hz)  # filters and actuators take it when they are made
    try:
        loaded = fdm.load_model(airframe.jsbsim, False)
    except RuntimeError as error:
        raise AirframeError(_refusal(airframe, [*messages.warnings, str(error)])) from None
    if not loaded:
        raise AirframeError(_refusal(airframe, messages.warnings))
    fdm.set_dt(1.0 / physics_rate_hz)
    for name, method in _INTEGRATORS:
        fdm.set_property_value(f"simulation/integrator/{name}", method)
    return fdm, tuple(messages.warnings)


def find_property(fdm: jsbsim.FGFDMExec, name: str, *, needed_by: str) -> Any:
    """Node of a JSBSim property, for fast access.

    Raises:
        AirframeError: the model has no such property.
    """
    node = fdm.get_property_manager().get_node(name)
    if node is None:
        raise AirframeError(f"the JSBSim model has no property '{name}', which {needed_by} needs")
    return node


def _refusal(airframe: Airframe, reasons: list[str]) -> str:
    detail = "; ".join(" ".join(reason.split()) for reason in reasons) or "no reason given"
    return f"JSBSim cannot load {airframe.xml_path}: {detail}"
