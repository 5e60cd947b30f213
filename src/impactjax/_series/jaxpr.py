"""Interpreter of a jaxpr with an arithmetic other than that of numbers."""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import jax.numpy as jnp
from jax.extend.core import Jaxpr, JaxprEqn, Literal, Var

Rule: TypeAlias = Callable[[JaxprEqn, list[Any]], Sequence[Any]]  # equation, operands -> outputs

_CALLS = ("jit", "pjit", "closed_call", "core_call", "custom_jvp_call", "custom_vjp_call")


def read(jaxpr: Jaxpr, consts: Sequence[Any], inputs: Sequence[Any], rule: Rule) -> list[Any]:
    """The outputs of a jaxpr whose equations follow `rule`; calls are entered."""
    values: dict[Any, Any] = dict(zip(jaxpr.constvars, map(jnp.asarray, consts), strict=True))
    values.update(zip(jaxpr.invars, inputs, strict=True))

    def value(atom: Var | Literal) -> Any:  # noqa: ANN401  whatever the arithmetic works on
        return jnp.asarray(atom.val) if isinstance(atom, Literal) else values[atom]

    for equation in jaxpr.eqns:
        operands = [value(atom) for atom in equation.invars]
        inner = equation.params.get("jaxpr", equation.params.get("call_jaxpr"))
        if equation.primitive.name in _CALLS and inner is not None:
            outputs = read(inner.jaxpr, inner.consts, operands, rule)
        else:
            outputs = rule(equation, operands)
        values.update(zip(equation.outvars, outputs, strict=True))
    return [value(atom) for atom in jaxpr.outvars]


def unchanged(equation: JaxprEqn, operands: list[Any]) -> list[Any]:
    """The outputs of an equation whose operands are numbers."""
    result = equation.primitive.bind(*operands, **equation.params)
    return list(result) if equation.primitive.multiple_results else [result]
