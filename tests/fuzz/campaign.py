"""A vehicle in hold under fire: what must be true whatever comes in.

Rounds of harmless messages: the vehicle stays armed, in its mode, and in its place. Rounds with orders: it
may go anywhere and refuse anything; afterwards it is replaced by a new one in hold. In both: nothing raises,
no batch of messages (with the step of the vehicle after it) takes long, all it computes stays finite, and no
memory is kept.
"""

import gc
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from autopilot_bridge.mavlink import DEFINITIONS, FrameParser
from autopilot_bridge.sitl.server import objects_kept
from autopilot_bridge.sitl.warm_up import compile_flight_code
from autopilot_bridge.tlog import TlogWriter
from flightsim import truth as t
from flightsim.payload import CameraParameters, GimbalParameters, PayloadParameters
from flightsim.vehicle import VehicleDivergedError
from flightsim.world_spec import VehicleSpec
from tests.fuzz.generator import Generator
from tests.system.flying import Flying

BATCH: Final = 4
"""Messages between two steps of the vehicle, which makes 1000 a second."""
LONGEST_S: Final = 0.05
HARMLESS_ROUND: Final = 10_000
ORDERS_ROUND: Final = 2_000
_CARRIED: Final = PayloadParameters(gimbal=GimbalParameters(), camera=CameraParameters())
_PAGE_BYTES: Final = 4096


@dataclass
class Figures:
    """What a campaign has seen.

    Attributes:
        longest_s: of a batch, in this thread's own time; where it was longer than allowed, `slow` tells.
        farthest_m: from where the vehicle held, in harmless rounds (multicopters).
        diverged: rounds with orders after which the motion was not possible any more.
        complaints: what should not have been.
        memory_bytes: resident after each round.
    """

    messages: int = 0
    answers_bytes: int = 0
    longest_s: float = 0.0
    farthest_m: float = 0.0
    diverged: int = 0
    complaints: list[str] = field(default_factory=list)
    memory_bytes: list[int] = field(default_factory=list)


class Campaign:
    """Fires at one kind of vehicle.

    Args:
        flavour, model: whom.
        seed: all of it follows from this.
    """

    def __init__(self, flavour: str, model: str, seed: int) -> None:
        self.name = f"{flavour} {model}"
        self.figures = Figures()
        self._flavour, self._model, self._seed = flavour, model, seed
        self._wings = model != "iris"
        self._round = 0
        compile_flight_code((VehicleSpec(model=model),))

    def run(
        self, count: int, *, orders_only: bool = False, reported: Callable[[str], None] = lambda text: None
    ) -> Figures:
        """Fire so many messages: five of six in rounds that are harmless, or all in rounds with orders."""
        with objects_kept():
            return self._run(count, orders_only, reported)

    def _run(self, count: int, orders_only: bool, reported: Callable[[str], None]) -> Figures:
        figures = self.figures
        while figures.messages < count:
            flying = self._fresh()
            gc.unfreeze()  # the vehicle before is garbage now, and would be kept for good
            gc.collect()
            gc.freeze()
            if not orders_only:
                self._fire(flying, min(count - figures.messages, HARMLESS_ROUND), orders=False)
            if figures.messages < count:
                self._fire(flying, min(count - figures.messages, ORDERS_ROUND), orders=True)
            figures.memory_bytes.append(resident_bytes())
            reported(f"{self.name}: {figures.messages} messages")
        return figures

    def one_round(self, count: int, *, orders: bool) -> Figures:
        """One round on a new vehicle."""
        flying = self._fresh()
        with objects_kept():
            self._fire(flying, count, orders=orders)
        return self.figures

    def _fresh(self) -> Flying:
        flying = Flying(self._flavour, model=self._model, payload=_CARRIED, seed=self._seed + self._round)
        flying.sitl.record(_Log())  # on a link of its own, to which what is for others is forwarded
        flying.take_off(60.0 if self._wings else 10.0)
        flying.step(5.0)
        return flying

    def _fire(self, flying: Flying, count: int, *, orders: bool) -> None:
        self._round += 1
        generator = Generator(
            self._seed * 1000 + self._round,
            flying.autopilot.parameters.definitions,
            orders=orders,
            bytewise=flying.autopilot.flavour.services.parameters.bytewise,
        )
        link = flying.sitl.connect(0)
        figures, sitl = self.figures, flying.sitl

        def count_bytes(data: bytes) -> None:
            figures.answers_bytes += len(data)

        link.on_receive = count_bytes
        held = _Held(flying, wings=self._wings)
        sent = 0
        while sent < count:
            batch = generator.batch(BATCH)
            wall_s, start_s = time.perf_counter(), time.thread_time()
            try:
                for frame in batch:
                    link.send(frame)
                sitl.advance()
            except VehicleDivergedError:
                if not orders:
                    raise
                figures.diverged += 1  # no gains suit every vehicle; a server starts it again
                return
            except Exception as error:  # noqa: BLE001 - whatever it is, it is what is looked for
                where = traceback.extract_tb(error.__traceback__)[-1]
                what = f"{type(error).__name__}: {error} ({where.filename}:{where.lineno})"
                self._complain(orders, sent, what, batch)
                break
            taken_s = min(time.perf_counter() - wall_s, time.thread_time() - start_s)
            figures.longest_s = max(figures.longest_s, taken_s)
            if taken_s > LONGEST_S:
                self._complain(orders, sent, f"a batch took {1e3 * taken_s:.0f} ms", batch)
            sent += len(batch)
            figures.messages += len(batch)
            if not np.isfinite(flying.autopilot.actuators).all():
                self._complain(orders, sent, "actuators are not finite", batch)
                break
            if not orders:
                if not self._wings:
                    figures.farthest_m = max(figures.farthest_m, held.distance_m())
                left = held.left()
                if left:
                    self._complain(orders, sent, left, batch)
                    break
        if not np.isfinite(flying.vehicle.vehicle.truth).all():
            self._complain(orders, sent, "the truth is not finite", [])
        flying.vehicle.close(flying.vehicle.channels[-1])

    def _complain(self, orders: bool, sent: int, what: str, batch: list[bytes]) -> None:
        names = [DEFINITIONS[f.message_id].name for f in FrameParser().feed(b"".join(batch))]
        kind = "orders" if orders else "harmless"
        self.figures.complaints.append(
            f"{self.name}, seed {self._seed}, round {self._round} ({kind}), message {sent}: {what} at {names}"
        )


class _Log(TlogWriter):
    """A log that looks at what it is given, and keeps nothing."""

    def __init__(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            super().__init__(Path(folder) / "discarded.tlog")

    def flush(self) -> None:
        assert not self._split()
        self._buffer.clear()


class _Held:
    """Where a vehicle holds, and what would show that it does so no more."""

    def __init__(self, flying: Flying, *, wings: bool) -> None:
        self._flying = flying
        self._wings = wings
        self._mode = flying.mode
        self._place_m = np.array(flying.true_position_m)

    def distance_m(self) -> float:
        return float(np.linalg.norm(np.array(self._flying.true_position_m) - self._place_m))

    def left(self) -> str:
        """Why it holds no more; empty while it does."""
        flying = self._flying
        if not flying.armed:
            return "disarmed"
        if flying.mode is not self._mode:
            return f"mode {flying.mode} instead of {self._mode}"
        away_m = np.array(flying.true_position_m) - self._place_m
        if self._wings:
            circle_m, height_m = float(np.hypot(*away_m[:2])), abs(float(away_m[2]))
            if circle_m > 400.0 or height_m > 15.0:
                return f"{circle_m:.0f} m and {height_m:.0f} m of height away"
            if flying.vehicle.vehicle.truth[t.AIRSPEED_TRUE_M_S] < 14.0:
                return "too slow to fly"
        elif (distance_m := float(np.linalg.norm(away_m))) > 2.0:
            return f"{distance_m:.1f} m away"
        return ""


def resident_bytes() -> int:
    """Memory of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * _PAGE_BYTES
