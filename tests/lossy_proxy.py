"""A poor radio between two UDP ends: loses, delays, repeats and swaps datagrams, both ways."""

import select
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

import numpy as np

from autopilot_bridge.links import Impairment, LossyLink, open_link

_TICK_S: Final = 0.002


class LossyProxy:
    """Carries between the vehicle's link and the client's until it is closed.

    Args:
        vehicle, client: connection strings of the two ends, seen from here.
        impairment: of each way.
        seed: of chance.
    """

    def __init__(self, vehicle: str, client: str, impairment: Impairment, seed: int) -> None:
        self._ends = (open_link(vehicle), open_link(client))
        self._lossy = LossyLink(
            self._ends[0],
            impairment,
            generator=np.random.default_rng(seed),
            time_us=lambda: int(time.monotonic() * 1e6),
        )
        self._stopped = threading.Event()
        self._worker = threading.Thread(target=self._carry, daemon=True)
        self._worker.start()

    @property
    def lost(self) -> int:
        return self._lossy.counters.dropped

    def close(self) -> None:
        self._stopped.set()
        self._worker.join()
        for end in self._ends:
            end.close()

    def _carry(self) -> None:
        client = self._ends[1]
        while not self._stopped.is_set():
            select.select([*self._lossy.filenos(), *client.filenos()], [], [], _TICK_S)
            for _, data in client.receive():
                self._lossy.send(data)
            for _, data in self._lossy.receive():
                client.send(data)


@contextmanager
def lossy_proxy(vehicle: str, client: str, impairment: Impairment, seed: int) -> Iterator[LossyProxy]:
    proxy = LossyProxy(vehicle, client, impairment, seed)
    try:
        yield proxy
    finally:
        proxy.close()
