"""64-bit numbers of JAX for what this package computes, and for nothing else in the process.

JAX decides by a setting of each thread whether ``float`` has 64 bits, and truncates 64-bit arrays where it has not.
Compiled functions (`kept_jit`, `QuickJit`) and those that compute with JAX outside them therefore enter the setting
themselves. Effects and criteria are called from there.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

import jax

__all__ = ["in_double_precision"]

Given = ParamSpec("Given")
Result = TypeVar("Result")


def in_double_precision(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """Return a function during which JAX computes in 64 bits, in the thread that calls it."""

    @wraps(function)
    def precise(*args: Given.args, **kwargs: Given.kwargs) -> Result:
        with jax.enable_x64(True):
            return function(*args, **kwargs)

    return precise
