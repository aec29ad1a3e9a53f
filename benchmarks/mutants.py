"""Mutants: small, deliberate faults in the flight code, made with cosmic-ray's operators."""

import random
import re
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import unified_diff
from pathlib import Path
from typing import Any, Final

import parso
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.provider import OperatorProvider

ROOT: Final = Path(__file__).resolve().parent.parent
PACKAGES: Final = (
    "autopilot_bridge/control",
    "autopilot_bridge/navigation",
    "autopilot_bridge/commander",
    "autopilot_bridge/services",
)
KERNEL_PACKAGE: Final = "estimators"
"""Of this package only the modules with kernels are mutated."""

OPERATORS: Final = (
    "ReplaceBinaryOperator_Add_Sub",
    "ReplaceBinaryOperator_Sub_Add",
    "ReplaceBinaryOperator_Mul_Div",
    "ReplaceBinaryOperator_Div_Mul",
    "ReplaceBinaryOperator_FloorDiv_Mul",
    "ReplaceBinaryOperator_Mod_Mul",
    "ReplaceBinaryOperator_Pow_Mul",
    "ReplaceBinaryOperator_RShift_LShift",
    "ReplaceBinaryOperator_LShift_RShift",
    "ReplaceBinaryOperator_BitOr_BitAnd",
    "ReplaceBinaryOperator_BitAnd_BitOr",
    "ReplaceComparisonOperator_Eq_NotEq",
    "ReplaceComparisonOperator_NotEq_Eq",
    "ReplaceComparisonOperator_Lt_LtE",
    "ReplaceComparisonOperator_Lt_GtE",
    "ReplaceComparisonOperator_LtE_Lt",
    "ReplaceComparisonOperator_LtE_Gt",
    "ReplaceComparisonOperator_Gt_GtE",
    "ReplaceComparisonOperator_Gt_LtE",
    "ReplaceComparisonOperator_GtE_Gt",
    "ReplaceComparisonOperator_GtE_Lt",
    "ReplaceComparisonOperator_Is_IsNot",
    "ReplaceComparisonOperator_IsNot_Is",
    "ReplaceUnaryOperator_Delete_USub",
    "ReplaceUnaryOperator_Delete_Not",
    "AddNot",
    "ReplaceTrueWithFalse",
    "ReplaceFalseWithTrue",
    "ReplaceAndWithOr",
    "ReplaceOrWithAnd",
    "ReplaceBreakWithContinue",
    "ReplaceContinueWithBreak",
    "ExceptionReplacer",
    "NumberReplacer",
    "ZeroIterationForLoop",
)
"""Left out: replacements that no type checker would pass (`+` by `>>`), and removed decorators."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutant:
    """One fault: an operator of cosmic-ray at one of its places in a module."""

    path: str
    operator: str
    occurrence: int
    line: int
    column: int

    @property
    def key(self) -> str:
        return f"{self.path}:{self.line}:{self.column} {self.operator} {self.occurrence}"

    @property
    def module(self) -> str:
        return self.path.removesuffix(".py").replace("/", ".")

    def source(self) -> str:
        """The module's text with the fault."""
        operator = OperatorProvider()[self.operator]()
        text = mutate_code((ROOT / self.path).read_text(encoding="utf-8"), operator, self.occurrence)
        if text is None:
            raise ValueError(f"{self.key}: no such place; was the source changed after the sample was drawn?")
        return str(text)

    def in_function(self) -> bool:
        """Not executed at import."""
        tree = parso.parse((ROOT / self.path).read_text(encoding="utf-8"))
        leaf = tree.get_leaf_for_position((self.line, self.column))
        return leaf.search_ancestor("funcdef", "lambdef") is not None

    def diff(self) -> list[str]:
        """The changed lines."""
        before = (ROOT / self.path).read_text(encoding="utf-8").splitlines()
        lines = list(unified_diff(before, self.source().splitlines(), n=0, lineterm=""))
        return [line for line in lines[2:] if not line.startswith("@@")]


def modules() -> list[str]:
    """Paths of the modules that are mutated, relative to the project."""
    found = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    found += filter(_has_kernels, (ROOT / KERNEL_PACKAGE).rglob("*.py"))
    return sorted(str(path.relative_to(ROOT)) for path in found)


def is_plain(path: str) -> bool:
    """Whether a module is tested without Numba: kernels, and the modules of constants beside them that they
    are made of. Numba would compile a mutant of these for longer than the tests take."""
    module = ROOT / path
    if _PUBLIC.search(module.read_text(encoding="utf-8")):
        return _has_kernels(module)
    return any(map(_has_kernels, module.parent.glob("*.py")))


_PUBLIC: Final = re.compile(r"^(class|def (?!_))", re.MULTILINE)
"""A module without public classes and functions consists of constants."""


def _has_kernels(module: Path) -> bool:
    return "\n@kernel\n" in module.read_text(encoding="utf-8")


def mutants_of(path: str) -> Iterator[Mutant]:
    """All mutants of a module, without those in annotations, decorators and imports for type checkers."""
    tree = parso.parse((ROOT / path).read_text(encoding="utf-8"))
    nodes = list(_walk(tree))
    provider = OperatorProvider()
    for name in OPERATORS:
        operator = provider[name]()
        occurrence = 0
        for node in nodes:
            for (line, column), _ in operator.mutation_positions(node):
                if _counts(tree.get_leaf_for_position((line, column)), name):
                    yield Mutant(path=path, operator=name, occurrence=occurrence, line=line, column=column)
                occurrence += 1


def _walk(node: Any) -> Iterator[Any]:
    yield node
    for child in getattr(node, "children", ()):
        yield from _walk(child)


_BINARY_PARENTS: Final = {"arith_expr", "term", "power", "expr", "and_expr", "shift_expr"}


def _counts(leaf: Any, operator: str) -> bool:
    if operator.startswith("ReplaceBinary") and leaf.parent.type not in _BINARY_PARENTS:
        return False  # the star of a signature or a call
    if leaf.value == "TYPE_CHECKING":
        return False
    child, node = leaf, leaf.parent
    while node is not None:
        if node.type in ("decorator", "tfpdef"):
            return False
        if node.type == "annassign" and child is node.children[1]:
            return False
        if node.type == "funcdef" and child is node.annotation:
            return False
        child, node = node, node.parent
    return True


def sample(size: int, seed: int) -> list[Mutant]:
    """Mutants in random order; each has the same chance, so the first of them are a random sample, too."""
    everything = [mutant for path in modules() for mutant in mutants_of(path)]
    random.Random(seed).shuffle(everything)
    return everything[:size]
