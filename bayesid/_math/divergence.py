"""Fits that diverge, as one error with a remedy in place of what numerical libraries raise."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from bayesid._io.errors import InputError

__all__ = ["DivergenceError", "divergence_named"]

# what libraries say, in errors of no type of their own, of numbers that are not finite
NOT_FINITE = ("returned NaN", "must not contain infs", "not finite", "x0` is infeasible", "index 0 is out of bounds")


class DivergenceError(InputError):
    """The recordings contradict the simulation so far that no fit of it is finite.

    Parameters
    ----------
    detail : str
        What failed.
    """

    def __init__(self, detail: str) -> None:
        super().__init__(
            f"the recordings contradict the simulation so strongly that no fit is finite ({detail})",
            remedy="Run `bayesid check` to examine units, axes and joints, and verify that the robot's file describes "
            "the recorded robot",
        )


@contextmanager
def divergence_named() -> Iterator[None]:
    """Raise `DivergenceError` for the errors of linear algebra, optimiser and sampler that a diverging fit causes."""
    try:
        yield
    except InputError:
        raise
    except (np.linalg.LinAlgError, FloatingPointError) as error:
        raise DivergenceError(str(error)) from error
    except (ValueError, IndexError) as error:
        if not any(sign in str(error) for sign in NOT_FINITE):
            raise
        raise DivergenceError(str(error)) from error
