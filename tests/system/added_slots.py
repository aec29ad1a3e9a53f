"""A short flight in a process of its own, in plain Python, with places added to some layouts: prints digests.

Arguments: model, file of the log, and the layout modules at whose beginning places are added. Kernels run as
plain Python (NUMBA_DISABLE_JIT=1), which compiles nothing for layouts that exist in this process only.
"""

import hashlib
import re
import sys
from collections.abc import Callable, Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, ModuleType

FLOWN_S = 12.0


def with_added_places(source: str) -> str:
    """A layout with two places before its first one."""
    changed, count = re.subn(r"^(_at = Slots\(.*\))$", r"\1\nADDED = _at.vector(2)", source, flags=re.M)
    assert count == 1
    return changed


def with_attributes(source: str) -> str:
    """Records whose fields are attributes in plain Python too, as in compiled code."""
    return source.replace("return np.dtype(fields)", "return np.dtype((np.record, fields))")


class _Changed(SourceFileLoader):
    def __init__(self, name: str, path: str, change: Callable[[str], str]) -> None:
        super().__init__(name, path)
        self._change = change

    def get_code(self, fullname: str) -> CodeType:
        return compile(self._change(Path(self.path).read_text(encoding="utf-8")), self.path, "exec")


class _Finder(MetaPathFinder):
    def __init__(self, changes: dict[str, Callable[[str], str]]) -> None:
        self._changes = changes

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        spec = PathFinder.find_spec(fullname, path, target) if fullname in self._changes else None
        if spec is not None:
            spec.loader = _Changed(fullname, str(spec.origin), self._changes[fullname])
        return spec


def main(model: str, log: str, *changed: str) -> None:
    """Take off and begin a mission; print the digest of the log and the added places."""
    changes = dict.fromkeys(changed, with_added_places)
    sys.meta_path.insert(0, _Finder(changes | {"autopilot_bridge.telemetry.records": with_attributes}))
    from benchmarks.sitl_speed import Flight

    class ShortFlight(Flight):
        def run(self, seconds: float) -> None:
            super().run(min(seconds, FLOWN_S))

    flight = ShortFlight(1, model, "px4", Path(log))
    flight.take_off()
    flight.close()
    digest = hashlib.sha256(Path(log).read_bytes()).hexdigest()
    places = (str(sys.modules[name].ADDED.start) for name in changed)
    sys.stdout.write(f"{digest}\n{' '.join(places)}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
