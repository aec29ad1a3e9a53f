"""Parameter tables of one firmware's vehicle classes: what they share stands in one of them."""

from collections.abc import Iterable

from autopilot_bridge.parameters import ParameterDefinition


def combined(
    base: Iterable[ParameterDefinition], own: Iterable[ParameterDefinition], *, without: tuple[str, ...]
) -> tuple[ParameterDefinition, ...]:
    """The table of another vehicle class: `base` with `own` rows in place of those of the same name.

    Args:
        base: the table of the class that has the shared rows.
        own: the additional and different rows of the other class; additional rows come last.
        without: names, or beginnings of names that end in `_`, that the other class does not have.
    """
    replaced = {definition.name: definition for definition in own}
    prefixes = tuple(name for name in without if name.endswith("_"))
    shared = [
        replaced.pop(definition.name, definition)
        for definition in base
        if not (definition.name in without or definition.name.startswith(prefixes))
    ]
    return (*shared, *replaced.values())
