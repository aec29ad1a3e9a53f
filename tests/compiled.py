"""The flight code, compiled by one process of a test run while others wait: a fresh clone has none."""

import contextlib
import hashlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

from autopilot_bridge.sitl import compile_flight_code
from flightsim.world_spec import VehicleSpec

try:
    import fcntl
except ImportError:  # not on Windows: there everybody compiles
    fcntl = None  # type: ignore[assignment]


def compile_in_turn() -> None:
    """Compile for every kind of vehicle, or load what another process has compiled in the meantime."""
    with _turn():
        compile_flight_code((VehicleSpec(), VehicleSpec(model="aerosonde")))


@contextlib.contextmanager
def _turn() -> Iterator[None]:
    """One process of this checkout at a time; a turn ends with its process, however that ends."""
    checkout = hashlib.sha256(str(Path(__file__).resolve()).encode()).hexdigest()[:16]
    with open(Path(tempfile.gettempdir()) / f"flightstack-tests-{checkout}.lock", "w") as lock:
        if fcntl is not None:
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
