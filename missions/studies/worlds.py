"""Worlds of a study: the nominal one, which the estimator assumes, and named ones that differ from it.

A study keeps its worlds in a mapping by name, the nominal one first, and has an option `--world` of an enum
with these names and `mismatched`:

    class HandoffWorlds(StrEnum):
        NOMINAL = "nominal"
        MISMATCHED = "mismatched"  # all that follow
        CLOCK = "clock"

    WORLDS: Final[Mapping[str, World[HandoffSetting]]] = {
        "nominal": World(setting=HandoffSetting()),
        "clock": World(setting=HandoffSetting(late_s=0.3), differs="...", source="..."),
    }
    design = grid(world=chosen_worlds(options.world, WORLDS))

The estimator keeps the parameters of the nominal world in all of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Generic, TypeVar

from missions.errors import PlanError

__all__ = ["MISMATCHED", "NOMINAL", "World", "chosen_worlds", "described"]

Setting = TypeVar("Setting")

NOMINAL: Final = "nominal"
MISMATCHED: Final = "mismatched"
"""Name that stands for all worlds of a study but the nominal one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class World(Generic[Setting]):
    """A world that trials are computed in.

    Attributes:
        setting: what the trials make of it: the true world.
        differs: in what it differs from what the estimator assumes, with numbers; "": in nothing.
        source: where a difference of this size is seen: data sheet, standard, paper, or a measurement of
            ours.
    """

    setting: Setting
    differs: str = ""
    source: str = ""


def chosen_worlds(asked: Sequence[str], worlds: Mapping[str, World[Any]]) -> tuple[str, ...]:
    """Names of the worlds that a user asks for, each once, in the order of `worlds`.

    Args:
        asked: names; `MISMATCHED` stands for all but the nominal one.
        worlds: of the study.

    Raises:
        PlanError: a name is unknown, or there is none.
    """
    known = {MISMATCHED: [name for name in worlds if name != NOMINAL], **{name: [name] for name in worlds}}
    for name in asked:
        if name not in known:
            raise PlanError(f"`world` {name!r} is not accepted; accepted are {', '.join(sorted(known))}")
    chosen = {found for name in asked for found in known[name]}
    if not chosen:
        raise PlanError(f"`world` is empty; accepted are {', '.join(sorted(known))}")
    return tuple(name for name in worlds if name in chosen)


def described(world: World[Any]) -> dict[str, str]:
    """Entries of `summary.json` about a world, beside its figures."""
    return {"differs": world.differs, "source": world.source} if world.differs else {}
