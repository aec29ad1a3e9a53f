"""Conditions on a log's messages: `GLOBAL_POSITION_INT.relative_alt > 20000 and HEARTBEAT.custom_mode == 4`.

As in MAVProxy's and pymavlink's tools, a condition names message fields in wire units and uses the newest
value before (or in) a message. It is parsed, never evaluated as Python.
"""

import ast
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.errors import BridgeError
from estimators.messages import field_name

_ACCEPTED: Final = (
    "accepted: MESSAGE.field, MESSAGE.field[index], numbers, 'texts', + - * / % & |, comparisons, and, or, "
    "not, abs(), ()"
)
_MAX_LENGTH: Final = 1000
_MAX_DEPTH: Final = 50

_ARITHMETIC: Final[Mapping[type[ast.operator], Callable[[Any, Any], Any]]] = MappingProxyType(
    {
        ast.Add: operator.add,
        ast.Sub: operator.sub,
        ast.Mult: operator.mul,
        ast.Div: operator.truediv,
        ast.Mod: np.mod,
        ast.BitAnd: lambda a, b: _whole(a) & _whole(b),
        ast.BitOr: lambda a, b: _whole(a) | _whole(b),
    }
)
_COMPARISONS: Final[Mapping[type[ast.cmpop], Callable[[Any, Any], Any]]] = MappingProxyType(
    {
        ast.Lt: operator.lt,
        ast.LtE: operator.le,
        ast.Gt: operator.gt,
        ast.GtE: operator.ge,
        ast.Eq: operator.eq,
        ast.NotEq: operator.ne,
    }
)


class ConditionError(BridgeError, ValueError):
    """A condition can't be parsed, or names an unknown field; the message names it and what is accepted."""


class _Table(Protocol):
    """The part of a log's table that is needed here; see `estimators.logs.log.Table`."""

    @property
    def order(self) -> NDArray[np.int64]: ...
    @property
    def fields(self) -> tuple[str, ...]: ...
    def __getitem__(self, field: str) -> NDArray[Any]: ...


Find = Callable[[str], "list[_Table]"]
"""Returns all tables of a message name that apply to the examined messages."""


@dataclass(frozen=True, slots=True)
class Field:
    """A field that a condition names.

    Attributes:
        message: "ATTITUDE".
        field: "roll".
        index: element of an array; None: a scalar.
    """

    message: str
    field: str
    index: int | None = None


class Condition:
    """A parsed condition.

    Args:
        text: at most 1000 characters.

    Attributes:
        text: the text that was given.
        fields: the fields that it names.

    Raises:
        ConditionError: it can't be read.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        found: dict[Field, None] = {}
        if len(text) > _MAX_LENGTH:
            raise ConditionError(f"a condition of {len(text)} characters is too long; at most {_MAX_LENGTH}")
        try:
            tree = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise ConditionError(f"condition {text!r} can't be read; {_ACCEPTED}") from error
        self._evaluate = self._compile(tree, found, 0)
        self.fields = tuple(found)
        if not found:
            raise ConditionError(f"condition {text!r} names no message; {_ACCEPTED}")

    @property
    def messages(self) -> frozenset[str]:
        """Names of the messages that are needed to evaluate the condition."""
        return frozenset(field.message for field in self.fields)

    def mask(self, order: NDArray[np.int64], find: Find) -> NDArray[np.bool_]:
        """Evaluate the condition at the given positions.

        Args:
            order: (n,) positions in the log of the examined messages, ascending.
            find: tables of a message by name; their `order` gives the positions of the messages.

        Returns:
            (n,) booleans, False before the first message of each named kind.

        Raises:
            ConditionError: a named message has no such field, or a text is compared with a number.
        """
        known = np.ones(len(order), dtype=np.bool_)
        values: dict[Field, NDArray[Any]] = {}
        for field in self.fields:
            values[field], there = _newest(field, order, find(field.message), self.text)
            known &= there
        try:
            with np.errstate(all="ignore"):
                result = np.asarray(self._evaluate(values))
        except (TypeError, np.exceptions.DTypePromotionError) as error:
            raise ConditionError(f"condition {self.text!r} compares a text with a number") from error
        if result.dtype.kind not in "biuf":
            raise ConditionError(f"condition {self.text!r} is neither true nor false; {_ACCEPTED}")
        return known & np.broadcast_to(result.astype(np.bool_), known.shape)

    def _compile(self, node: ast.expr, found: dict[Field, None], depth: int) -> Callable[[Any], Any]:
        if depth > _MAX_DEPTH:
            raise ConditionError(f"condition {self.text!r} is nested more than {_MAX_DEPTH} deep")

        def part(child: ast.expr) -> Callable[[Any], Any]:
            return self._compile(child, found, depth + 1)

        match node:
            case ast.Constant(value=value) if isinstance(value, (bool, int, float, str)):
                constant = value.encode() if isinstance(value, str) else value
                return lambda values: constant
            case ast.Attribute(value=ast.Name(id=message), attr=name):
                return self._field(Field(message, name), found)
            case ast.Subscript(
                value=ast.Attribute(value=ast.Name(id=message), attr=name), slice=ast.Constant(value=index)
            ) if isinstance(index, int) and not isinstance(index, bool):
                return self._field(Field(message, name, index), found)
            case ast.BoolOp(op=op, values=children):
                parts = [part(child) for child in children]
                combine = np.logical_and if isinstance(op, ast.And) else np.logical_or
                return lambda values: combine.reduce(
                    np.broadcast_arrays(*(np.asarray(item(values), dtype=np.bool_) for item in parts))
                )
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                inner = part(operand)
                return lambda values: np.logical_not(inner(values))
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                inner = part(operand)
                return lambda values: -_number(inner(values))
            case ast.BinOp(left=left, op=sign, right=right) if type(sign) in _ARITHMETIC:
                first, second, compute = part(left), part(right), _ARITHMETIC[type(sign)]
                return lambda values: compute(_number(first(values)), _number(second(values)))
            case ast.Call(func=ast.Name(id="abs"), args=[argument], keywords=[]):
                inner = part(argument)
                return lambda values: np.abs(_number(inner(values)))
            case ast.Compare(left=left, ops=ops, comparators=rights) if all(
                type(o) in _COMPARISONS for o in ops
            ):
                return self._chain([part(item) for item in (left, *rights)], ops)
        shown = ast.get_source_segment(self.text.strip(), node) or self.text
        raise ConditionError(f"{shown!r} in condition {self.text!r} is not possible; {_ACCEPTED}")

    def _field(self, field: Field, found: dict[Field, None]) -> Callable[[Any], Any]:
        found[field] = None
        return lambda values: values[field]

    def _chain(self, parts: list[Callable[[Any], Any]], ops: list[ast.cmpop]) -> Callable[[Any], Any]:
        """A chain such as `a < b < c`, with Python's meaning."""

        def compare(values: Any) -> Any:
            items = [part(values) for part in parts]
            result: Any = True
            for left, op, right in zip(items, ops, items[1:], strict=False):
                if _is_text(left) != _is_text(right):
                    raise TypeError
                result = np.logical_and(result, _COMPARISONS[type(op)](left, right))
            return result

        return compare


def _newest(
    field: Field, order: NDArray[np.int64], tables: "list[_Table]", text: str
) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Value of a field at each position, and whether a value existed by then."""
    parts = [(table.order, _column(field, table, text)) for table in tables]
    if not parts:
        return np.zeros(len(order)), np.zeros(len(order), dtype=np.bool_)
    came = np.concatenate([part[0] for part in parts])
    column = np.concatenate([part[1] for part in parts])
    sorting = np.argsort(came, kind="stable")
    at = np.searchsorted(came[sorting], order, side="right") - 1
    return column[sorting][np.maximum(at, 0)], at >= 0


def _column(field: Field, table: _Table, text: str) -> NDArray[Any]:
    names = {field_name(name): name for name in table.fields} | {name: name for name in table.fields}
    if field.field not in names:
        raise ConditionError(
            f"{field.message} has no field {field.field!r} (condition {text!r}); "
            f"it has {', '.join(table.fields)}"
        )
    column = table[names[field.field]]
    if column.ndim == 1 and field.index is None:
        return column
    if column.ndim == 2 and field.index is not None and 0 <= field.index < column.shape[1]:
        return column[:, field.index]
    size = f"an array of {column.shape[1]}: give an index from 0" if column.ndim == 2 else "not an array"
    raise ConditionError(f"{field.message}.{field.field} is {size} (condition {text!r})")


def _is_text(value: Any) -> bool:
    return bool(np.asarray(value).dtype.kind in "SU")


def _number(value: Any) -> Any:
    """Convert to 64 bits, so that small unsigned fields don't wrap around."""
    array = np.asarray(value)
    if array.dtype.kind == "f":
        return array.astype(np.float64)
    if array.dtype.kind in "iu" and array.dtype != np.uint64:
        return array.astype(np.int64)
    if array.dtype.kind == "u":
        return (
            array.astype(np.float64)
            if bool((array > np.iinfo(np.int64).max).any())
            else array.astype(np.int64)
        )
    if array.dtype.kind == "b":
        return array.astype(np.int64)
    raise TypeError


def _whole(value: Any) -> Any:
    array = np.asarray(value)
    if array.dtype.kind == "f":
        raise TypeError
    return array
