"""Numbers as a reader wants them: an uncertainty to two significant digits, powers of ten written out."""

from __future__ import annotations

import math
import re

__all__ = ["format_number", "format_quantity", "format_unit"]

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

LARGEST, SMALLEST = 6, -3
"""Powers of ten from which on, and down to which, a number is written with its power of ten."""


def format_quantity(mean: float, sd: float) -> str:
    """Return ``mean ± sd`` with the standard deviation to two significant digits.

    Parameters
    ----------
    mean, sd : float
        In the same unit. A standard deviation of zero stands for an exact value.

    Returns
    -------
    str
        Such as ``640.00 ± 0.50`` or ``(1.230 ± 0.012) × 10⁻⁵``; ``not finite`` where either is not.
    """
    if not (math.isfinite(mean) and math.isfinite(sd)):
        return "not finite"
    if sd <= 0.0:
        return format_number(mean, 6)
    rounded = float(f"{sd:.1e}")
    power = max(_power(mean), _power(rounded)) if mean else _power(rounded)
    decimals = 1 - _power(rounded)
    if SMALLEST < power < LARGEST and not (power < 0 and decimals > 6):
        return f"{_fixed(mean, decimals)} ± {_fixed(rounded, decimals)}"
    places, unit = decimals + power, 10.0**power
    return f"({_fixed(mean / unit, places)} ± {_fixed(rounded / unit, places)}) × 10{_raise(power)}"


def format_number(value: float, digits: int = 3) -> str:
    """Return a number to so many significant digits."""
    if not math.isfinite(value):
        return "not finite"
    if value == 0.0:
        return "0"
    power = _power(float(f"{value:.{digits - 1}e}"))
    if SMALLEST < power < LARGEST:
        return _minus(f"{float(f'{value:.{digits - 1}e}'):.10g}")
    mantissa = f"{value / 10.0**power:.{digits - 1}f}"
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return f"{_minus(mantissa)} × 10{_raise(power)}"


def format_unit(unit: str) -> str:
    """Raise the exponents of a unit: ``kg m2`` becomes ``kg m²``; a pure number has none."""
    return "" if unit == "1" else re.sub(r"(?<=[A-Za-z])-?\d+", lambda found: _raise(int(found[0])), unit)


def _power(value: float) -> int:
    return math.floor(math.log10(abs(value))) if value else 0


def _fixed(value: float, decimals: int) -> str:
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    return _minus(text if float(text) else text.lstrip("-"))


def _minus(text: str) -> str:
    return text.replace("-", "−")


def _raise(power: int) -> str:
    return str(power).translate(_RAISED)
