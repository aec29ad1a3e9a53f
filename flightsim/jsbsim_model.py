"""A typed interface to JSBSim: load a model, find its properties. Its messages go to `logging`."""

import logging
import re
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import get_ident
from typing import Any, Final
from xml.etree import ElementTree

from flightsim.airframe import Airframe, AirframeError, AirframeKind
from flightsim.jsbsim_package import jsbsim
from flightsim.model_files import refusal, write_copy

_LOG: Final = logging.getLogger("flightsim.jsbsim")
_LOG.addHandler(logging.NullHandler())

LAUNCHER_FORCE: Final = "launcher"
LAUNCHER_MOMENT: Final = "launcher-moment"
"""Names among a model's external reactions; the force in pounds, the moment in foot-pounds, body axes."""

ROTARY_GUSTS: Final = tuple(f"flightsim/{rate}-gust-rad_sec" for rate in "pqr")
"""Properties of a model with wings: rotation of the air, body axes. Aerodynamics use the rates less these.

JSBSim has such rates too, but only its own turbulence can write them.
"""

_NONE: Final = 0.0
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


_messages: Final[dict[int, _Messages]] = {}  # by thread


def _messages_of_thread() -> _Messages:
    """The logger of the calling thread, empty.

    JSBSim gives up a thread's logger when the thread has ended, without Python's lock: if that reference were
    the last one, Python would abort. Threads that begin later get the numbers of those that have ended, so
    there are no more loggers than there were threads at a time.
    """
    messages = _messages.setdefault(get_ident(), _Messages())
    messages.warnings = []
    return messages


def load_fdm(
    airframe: Airframe, physics_rate_hz: int, *, launcher: bool = False
) -> tuple[jsbsim.FGFDMExec, tuple[str, ...]]:
    """A new, independent JSBSim instance with the model loaded. It prints nothing, opens no port and writes
    no file, whatever the model names.

    JSBSim keeps its logger per thread; this leaves ours installed in the calling thread.

    Args:
        airframe: which model; `model_files` says where its engines and systems are searched.
        physics_rate_hz: steps per second.
        launcher: add a force and a moment for a `Launcher` to a copy of the model.

    Returns:
        The instance, and the warnings JSBSim had about the model (none for a clean one).

    Raises:
        AirframeError: JSBSim refuses the model; the message carries its reasons.
    """

    def prepare(root: ElementTree.Element) -> None:
        if airframe.kind is AirframeKind.FIXED_WING:
            _add_rotary_gusts(root)
        if launcher:
            _add_launcher(root)

    with TemporaryDirectory(prefix="flightsim-") as folder:
        write_copy(airframe, Path(folder), prepare)
        return _load(airframe, Path(folder), physics_rate_hz)


def _load(airframe: Airframe, folder: Path, physics_rate_hz: int) -> tuple[jsbsim.FGFDMExec, tuple[str, ...]]:
    messages = _messages_of_thread()
    jsbsim.set_logger(messages)
    fdm = jsbsim.FGFDMExec(str(folder))
    fdm.set_debug_level(0)
    for set_path in (fdm.set_aircraft_path, fdm.set_engine_path, fdm.set_systems_path):
        set_path(".")  # all files of the model lie in one folder
    fdm.set_dt(1.0 / physics_rate_hz)  # filters and actuators take it when they are made
    try:
        if not fdm.load_model(airframe.jsbsim, False):
            raise AirframeError(refusal(airframe, _in_the_model(messages.warnings, folder)))
        if airframe.kind is AirframeKind.FIXED_WING:
            # the friction of JSBSim's wheels starts from uninitialised memory, which only a reset clears
            fdm.set_property_value("ic/h-agl-ft", 1000.0)
            fdm.run_ic()
            fdm.reset_to_initial_conditions(0)
    except jsbsim.BaseError as error:
        reasons = _in_the_model([*messages.warnings, str(error)], folder)
        raise AirframeError(refusal(airframe, reasons)) from None
    fdm.set_dt(1.0 / physics_rate_hz)
    hold_motion(fdm, False)
    return fdm, tuple(messages.warnings)


def _in_the_model(messages: list[str], folder: Path) -> list[str]:
    """Messages about the copy in a folder, as messages about the model's own files.

    Their line numbers are left out: the copy has other lines.
    """
    place = re.compile(rf"{re.escape(str(folder))}/(?:\./)?(.+?\.xml):\d+")
    return [place.sub(r"\1", text) for text in messages]


def _add_launcher(root: ElementTree.Element) -> None:
    """Add an external force and moment."""
    reactions = root.find("external_reactions")
    if reactions is None:
        reactions = ElementTree.SubElement(root, "external_reactions")
    for kind, name in (("force", LAUNCHER_FORCE), ("moment", LAUNCHER_MOMENT)):
        element = ElementTree.SubElement(reactions, kind, {"name": name, "frame": "BODY"})
        for tag, attributes in (("location", {"unit": "IN"}), ("direction", {})):
            place = ElementTree.SubElement(element, tag, attributes)
            for axis in "xyz":
                ElementTree.SubElement(place, axis).text = "0"


def _add_rotary_gusts(root: ElementTree.Element) -> None:
    """Let the aerodynamics use the rates against the air: those of the body less `ROTARY_GUSTS`.

    Aerodynamics in a separate file, and those without rates, are not changed.
    """
    aerodynamics = root.find("aerodynamics")
    if aerodynamics is None or "file" in aerodynamics.attrib:
        return
    renamed = {}
    for rate in "pqr":
        for name in (f"velocities/{rate}-aero-rad_sec", f"velocities/{rate}-rad_sec"):
            renamed[name] = f"flightsim/{name.removeprefix('velocities/')}"
    used = set()
    for element in aerodynamics.iter():
        text = (element.text or "").strip()
        sign, name = ("-", text[1:]) if text.startswith("-") else ("", text)
        if name in renamed:
            element.text = f"{sign}{renamed[name]}"
            used.add(name)
    if not used:
        return
    added = []
    for gust in ROTARY_GUSTS:
        added.append(ElementTree.Element("property", {"value": "0"}))
        added[-1].text = gust
    for name in sorted(used):
        function = ElementTree.Element("function", {"name": renamed[name]})
        difference = ElementTree.SubElement(function, "difference")
        gust = ROTARY_GUSTS["pqr".index(name.removeprefix("velocities/")[0])]
        for operand in (name, gust):
            ElementTree.SubElement(difference, "property").text = operand
        added.append(function)
    aerodynamics[:0] = added


def hold_motion(fdm: jsbsim.FGFDMExec, held: bool) -> None:
    """Hold position, attitude, velocity and rates while everything else is simulated, or release them."""
    for name, method in _INTEGRATORS:
        fdm.set_property_value(f"simulation/integrator/{name}", _NONE if held else method)


def find_property(fdm: jsbsim.FGFDMExec, name: str, *, needed_by: str) -> Any:
    """Node of a JSBSim property, for fast access.

    Raises:
        AirframeError: the model has no such property.
    """
    node = fdm.get_property_manager().get_node(name)
    if node is None:
        raise AirframeError(f"the JSBSim model has no property '{name}', which {needed_by} needs")
    return node
