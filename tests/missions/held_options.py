"""Options of a mission from fields by name, be they its own or of options that it holds."""

from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar

T = TypeVar("T")


def with_fields(options: T, **values: Any) -> T:
    """The same options with other values, given by the names of their fields."""
    changes = {each.name: values.pop(each.name) for each in fields(options) if each.name in values}
    for holder in fields(options):
        held = getattr(options, holder.name)
        names = {each.name for each in fields(held)} if is_dataclass(held) else set()
        inner = {name: values.pop(name) for name in names & set(values)}
        if inner:
            changes[holder.name] = replace(held, **inner)
    assert not values, f"no such field: {', '.join(values)}"
    return replace(options, **changes)  # type: ignore[type-var]
