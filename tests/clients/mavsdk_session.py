"""MAVSDK's two interfaces behind one: what tests call, whether it is awaited or not.

`call` a method of a plugin, take the `first` element of a stream that satisfies, `collect` what a method
yields until it is done. Results and errors are MAVSDK's own.
"""

import asyncio
import importlib
import queue
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Final

from tests.clients.mavsdk_waiting import WALL_DEADLINE_S, first, transfer, worded

ASYNCIO: Final = "MAVSDK asyncio"
SYNCHRONOUS: Final = "MAVSDK synchronous"
DISCOVERY_S: Final = 100.0

Found = Callable[[Any], bool]
Each = Callable[[], None] | None


def _anything(element: Any) -> bool:
    return True


def _class_name(plugin: str) -> str:
    return "".join(word.capitalize() for word in plugin.split("_"))


class Session(ABC):
    """A ground station by MAVSDK, connected to one vehicle.

    Attributes:
        before_arming: what must be done otherwise before the vehicle can be armed.
    """

    def __init__(self) -> None:
        self._plugins: dict[str, Any] = {}
        self._kept: list[Any] = []
        self.before_arming: Callable[[], None] = lambda: None

    def plugin(self, name: str) -> Any:
        """A plugin by the name of its module."""
        if name not in self._plugins:
            self._plugins[name] = self._new_plugin(name)
        return self._plugins[name]

    @abstractmethod
    def _new_plugin(self, name: str) -> Any: ...

    def _keep_callbacks(self, plugin: str) -> None:
        """Keep what MAVSDK calls back: its threads may do so once more after the end of a subscription."""
        owner = self.plugin(plugin)
        self._kept += getattr(getattr(owner, "_plugin", owner), "_subscriptions", {}).values()

    @abstractmethod
    def call(self, plugin: str, method: str, *arguments: Any) -> Any:
        """What a method returns."""

    def first(
        self,
        plugin: str,
        stream: str,
        found: Found = _anything,
        each: Each = None,
        wait_s: float = WALL_DEADLINE_S,
    ) -> Any:
        """The first element of a stream for which `found`; `each` is called at some 40 Hz meanwhile."""
        return self._first(plugin, stream, found, each, wait_s)

    @abstractmethod
    def _first(self, plugin: str, stream: str, found: Found, each: Each, wait_s: float) -> Any: ...

    @abstractmethod
    def collect(self, plugin: str, method: str, *arguments: Any) -> list[Any]:
        """Everything that a method tells until it is done."""

    @abstractmethod
    def cut_short(self, plugin: str, method: str, stop: str, found: Found) -> str:
        """Begin a method that tells how it goes, call `stop` at the element `found`; the result's name."""

    def until(self, what: str, found: Callable[[], bool], wait_s: float = WALL_DEADLINE_S) -> None:
        """Poll a condition."""
        deadline_s = time.monotonic() + wait_s
        while not found():
            assert time.monotonic() < deadline_s, f"{what} was not seen"
            self.wait(0.05)

    def transfer(self, plugin: str, method: str, *arguments: Any) -> Any:
        """`call` an upload or a download of a plan; begun anew when it stood still for too long."""
        return transfer(lambda: self.call(plugin, method, *arguments))

    def answer(
        self, plugin: str, method: str, found: Found, *arguments: Any, wait_s: float = WALL_DEADLINE_S
    ) -> Any:
        """Call until what is answered is `found`; MAVSDK's errors count as answers that are not."""
        from mavsdk.exceptions import MavsdkError

        deadline_s = time.monotonic() + wait_s
        while True:
            last: Any
            try:
                last = self.call(plugin, method, *arguments)
                if found(last):
                    return last
            except MavsdkError as error:
                last = error
            assert time.monotonic() < deadline_s, f"{plugin}.{method} did not answer so; last: {worded(last)}"
            self.wait(0.05)

    @abstractmethod
    def wait(self, seconds: float) -> None:
        """Let the client's own threads work."""

    @abstractmethod
    def close(self) -> None: ...


def _configuration(module: Any, system_id: int) -> Any:
    made = module.Configuration.create_with_component_type(module.ComponentType.GROUND_STATION)
    made.system_id = system_id
    return made


class AsyncioSession(Session):
    """By `mavsdk.asyncio`."""

    def __init__(self, url: str, *, system_id: int) -> None:
        super().__init__()
        self._runner = asyncio.Runner()
        self._runner.run(self._connect(url, system_id))

    async def _connect(self, url: str, system_id: int) -> None:
        import mavsdk.asyncio as mavsdk

        self._mavsdk = mavsdk.Mavsdk(_configuration(mavsdk, system_id))
        await self._mavsdk.add_any_connection(url)
        self._system = await self._mavsdk.first_autopilot(timeout_s=DISCOVERY_S)
        assert self._system is not None, f"no autopilot on {url}"

    def _new_plugin(self, name: str) -> Any:
        return getattr(
            importlib.import_module(f"mavsdk.asyncio.plugins.{name}.{name}"), _class_name(name) + "Async"
        )(self._system)

    def _run(self, awaited: Any, wait_s: float = 2 * WALL_DEADLINE_S) -> Any:
        async def limited() -> Any:
            async with asyncio.timeout(wait_s):
                return await awaited

        return self._runner.run(limited())

    def call(self, plugin: str, method: str, *arguments: Any) -> Any:
        return self._run(getattr(self.plugin(plugin), method)(*arguments))

    def _first(self, plugin: str, stream: str, found: Found, each: Each, wait_s: float) -> Any:
        owner = self.plugin(plugin)

        async def watch() -> Any:
            elements = getattr(owner, f"subscribe_{stream}")()
            repeater = None if each is None else asyncio.create_task(repeat(each))
            try:
                return await first(elements, found, f"{plugin}.{stream}", wait_s)
            finally:
                self._keep_callbacks(plugin)
                await elements.aclose()
                if repeater is not None:
                    repeater.cancel()

        async def repeat(each: Callable[[], None]) -> None:
            while True:
                each()
                await asyncio.sleep(0.025)

        return self._runner.run(watch())

    def collect(self, plugin: str, method: str, *arguments: Any) -> list[Any]:
        async def everything() -> list[Any]:
            return [element async for element in getattr(self.plugin(plugin), method)(*arguments)]

        return list(self._run(everything()))

    def cut_short(self, plugin: str, method: str, stop: str, found: Found) -> str:
        from mavsdk.exceptions import MavsdkError

        async def begin() -> str:
            stopped = False
            try:
                async for _, data in getattr(self.plugin(plugin), method)():
                    if not stopped and found(data):
                        stopped = True
                        await getattr(self.plugin(plugin), stop)()
            except MavsdkError as error:
                return str(error).split(";")[0]
            return "SUCCESS"

        return str(self._run(begin()))

    def wait(self, seconds: float) -> None:
        self._runner.run(asyncio.sleep(seconds))

    def close(self) -> None:
        self._plugins.clear()
        self._mavsdk.destroy()
        self._runner.close()


class SynchronousSession(Session):
    """By `mavsdk` itself."""

    def __init__(self, url: str, *, system_id: int) -> None:
        super().__init__()
        import mavsdk

        self._mavsdk = mavsdk.Mavsdk(_configuration(mavsdk, system_id))
        self._mavsdk.add_any_connection(url)
        self._system = self._mavsdk.first_autopilot(timeout_s=DISCOVERY_S)
        assert self._system is not None, f"no autopilot on {url}"

    def _new_plugin(self, name: str) -> Any:
        return getattr(importlib.import_module(f"mavsdk.plugins.{name}"), _class_name(name))(self._system)

    def call(self, plugin: str, method: str, *arguments: Any) -> Any:
        return getattr(self.plugin(plugin), method)(*arguments)

    def _first(self, plugin: str, stream: str, found: Found, each: Each, wait_s: float) -> Any:
        owner = self.plugin(plugin)
        received: queue.SimpleQueue[Any] = queue.SimpleQueue()
        handle = getattr(owner, f"subscribe_{stream}")(lambda data, _user: received.put(data))
        deadline_s = time.monotonic() + wait_s
        last: Any = None
        try:
            while time.monotonic() < deadline_s:
                if each is not None:
                    each()
                try:
                    last = received.get(timeout=0.025 if each is not None else 0.5)
                except queue.Empty:
                    continue
                if found(last):
                    return last
        finally:
            self._keep_callbacks(plugin)
            getattr(owner, f"unsubscribe_{stream}")(handle)
        raise AssertionError(f"{plugin}.{stream} was not seen; last: {worded(last)}")

    def collect(self, plugin: str, method: str, *arguments: Any) -> list[Any]:
        received: queue.SimpleQueue[Any] = queue.SimpleQueue()
        getattr(self.plugin(plugin), f"{method}_async")(
            *arguments, lambda result, data, _user: received.put((result, data))
        )
        elements: list[Any] = []
        while True:
            result, data = received.get(timeout=2 * WALL_DEADLINE_S)
            elements.append((result, data))
            if result.name != "NEXT":
                assert result.name == "SUCCESS", result
                return elements

    def cut_short(self, plugin: str, method: str, stop: str, found: Found) -> str:
        received: queue.SimpleQueue[Any] = queue.SimpleQueue()
        owner = self.plugin(plugin)
        getattr(owner, f"{method}_async")(lambda result, data, _user: received.put((result.name, data)))
        stopped = False
        while True:
            name, data = received.get(timeout=WALL_DEADLINE_S)
            if name != "NEXT":
                return str(name)
            if not stopped and found(data):
                stopped = True
                getattr(owner, stop)()

    def wait(self, seconds: float) -> None:
        time.sleep(seconds)

    def close(self) -> None:
        self._plugins.clear()
        self._mavsdk.destroy()


SESSIONS: Final[dict[str, Callable[..., Session]]] = {
    ASYNCIO: AsyncioSession,
    SYNCHRONOUS: SynchronousSession,
}
