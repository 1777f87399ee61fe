"""Compiles a function where numba is installed, and leaves it as it is elsewhere: the same numbers, bit for bit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])

try:
    import numba

    COMPILED = not vars(numba.config)["DISABLE_JIT"]
except ImportError:  # an extra: everything works without, slower
    COMPILED = False


def jit(function: Function) -> Function:
    """Return the function compiled, without any freedom to reorder its arithmetic."""
    if not COMPILED:
        return function
    compiled: Any = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    return cast("Function", compiled)
