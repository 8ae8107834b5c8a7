"""Small faults in a source file: where one can be, and the text with it.

A fault is found in the syntax tree and put into the text, so that all other lines stay as they are. Left alone is what
computes nothing: annotations, decorators, docstrings, messages, logging, imports, addresses to fetch ahead.
"""

from __future__ import annotations

import ast
import copy
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["KINDS", "Fault", "faults_of"]

KINDS = ("operator", "term", "sign", "constant", "range", "index", "comparison", "accumulation", "bound", "connective")
"""Operators exchanged, terms dropped, signs flipped, constants less a fifth, ranges one short, neighbours' components,
comparisons negated, sums accumulated with the other sign or not at all, min for max, and for or."""

_SCALE = 0.8
_OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
_COMPARISONS = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
}
_BOUNDS = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum"}
_SKIPPED = (ast.Raise, ast.Assert, ast.Import, ast.ImportFrom, ast.JoinedStr)
_MESSENGERS = ("_log", "InputError", "NumericalStop", "RuntimeError", "ValueError", "prefetch")


@dataclass(frozen=True)
class Fault:
    """One fault: its kind, the line (from 1) and bytes of the source that it replaces, the text before and after."""

    kind: str
    line: int
    begin: int
    end: int
    before: str
    after: str

    def applied(self, source: str) -> str:
        """The source with the fault in it."""
        data = source.encode()
        return (data[: self.begin] + self.after.encode() + data[self.end :]).decode()

    def __str__(self) -> str:
        return f"line {self.line}: {' '.join(self.before.split())} -> {' '.join(self.after.split())}"


@cache
def faults_of(source: str) -> tuple[Fault, ...]:
    """All faults that can be put into a module's source, in the order of the text."""
    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    tree = ast.parse(source)
    data, found = source.encode(), []
    for node in _computing(tree):
        for kind, changed in _changes(node):
            if ast.dump(changed) == ast.dump(node):
                continue
            begin = starts[node.lineno - 1] + node.col_offset
            end = starts[node.end_lineno - 1] + node.end_col_offset
            before, text = data[begin:end].decode(), ast.unparse(changed)
            after = f"({text})" if isinstance(changed, (ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare)) else text
            found.append(Fault(kind, node.lineno, begin, end, before, after))
    return tuple(sorted(found, key=lambda fault: (fault.begin, fault.end, fault.kind, fault.after)))


def _computing(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes below one that compute something."""
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "bases"):
            continue
        if isinstance(node, ast.Subscript) and name == "slice":  # rows of scratch: neighbours are faults of the index
            continue
        for child in value if isinstance(value, list) else [value]:
            if not isinstance(child, ast.AST) or _computes_nothing(child):
                continue
            yield child
            yield from _computing(child)


def _computes_nothing(node: ast.AST) -> bool:
    if isinstance(node, _SKIPPED):
        return True
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):  # a docstring
        return True
    if isinstance(node, ast.Call):
        return ast.unparse(node.func).split(".")[0] in _MESSENGERS
    if isinstance(node, ast.If):
        return ast.unparse(node.test) == "TYPE_CHECKING"
    if isinstance(node, ast.Assign):
        return ast.unparse(node.targets[0]) == "__all__"
    return False


def _changes(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """Kind and faulty node of every fault in one node, less those below it."""
    if isinstance(node, ast.BinOp) and not _is_text(node.left) and not _is_text(node.right):
        if (other := _OPERATORS.get(type(node.op))) is not None:
            yield "operator", _with(node, op=other())
        if isinstance(node.op, (ast.Add, ast.Sub)):
            yield "term", node.left
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        yield "sign", node.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, float) and node.value != 0.0:
        yield "constant", ast.Constant(node.value * _SCALE)
    elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARISONS:
        yield "comparison", _with(node, ops=[_COMPARISONS[type(node.ops[0])]()])
    elif isinstance(node, ast.BoolOp):
        yield "connective", _with(node, op=ast.Or() if isinstance(node.op, ast.And) else ast.And())
    elif isinstance(node, ast.AugAssign):
        if (other := _OPERATORS.get(type(node.op))) is not None:
            yield "accumulation", _with(node, op=other())
            yield "accumulation", ast.Pass()
    elif isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant) and type(node.slice.value) is int:
        yield "index", _with(node, slice=ast.Constant(max(node.slice.value - 1, 1 - node.slice.value)))
    elif isinstance(node, ast.Call):
        yield from _changed_calls(node)


def _changed_calls(node: ast.Call) -> Iterator[tuple[str, ast.AST]]:
    name = ast.unparse(node.func)
    if name in ("range", "prange", "numba.prange", "np.arange") and node.args:
        place = 0 if len(node.args) == 1 else 1
        last = ast.BinOp(node.args[place], ast.Sub(), ast.Constant(1))
        yield "range", _with(node, args=[*node.args[:place], last, *node.args[place + 1 :]])
    owner, _, function = name.rpartition(".")
    if function in _BOUNDS and owner in ("", "np") and not node.keywords:
        other = f"{owner}.{_BOUNDS[function]}" if owner else _BOUNDS[function]
        yield "bound", _with(node, func=ast.parse(other, mode="eval").body)


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def _with(node: ast.AST, **changes: object) -> ast.AST:
    other = copy.copy(node)
    for name, value in changes.items():
        setattr(other, name, value)
    return other
