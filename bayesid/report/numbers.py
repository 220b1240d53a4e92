"""Numbers as reports print them: rounded to their uncertainty, with true minus signs and raised powers of ten."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

__all__ = [
    "NO_VALUE",
    "format_fixed",
    "format_number",
    "format_p_value",
    "format_percent",
    "format_probability",
    "format_quantity",
    "format_range",
    "format_signed",
    "format_text",
    "format_unit",
    "format_vector",
    "relation",
]

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

NO_VALUE = "–"
"""Cell of a table that has no number."""

LARGEST, SMALLEST = 6, -3  # exponents from which on, and down to which, a number is written with its power of ten
SMALLEST_P = 1e-12  # p-value below which only the bound is printed
LEAST_PROBABILITY = 0.001  # probability below which only the bound is printed, and the same from one
NEARLY_ALL = 0.995  # ratio from which on a percentage has three digits, because two would round it to 100 %


def format_quantity(mean: float, sd: float) -> str:
    """Return ``mean ± sd`` with the standard deviation to two significant digits.

    Parameters
    ----------
    mean, sd : float
        Value and standard deviation in the same unit. A standard deviation of zero stands for an exact value.

    Returns
    -------
    str
        Text such as ``640.00 ± 0.50`` or ``(1.230 ± 0.012) × 10⁻⁵``, or ``not finite`` where either number is not.
    """
    if not (math.isfinite(mean) and math.isfinite(sd)):
        return "not finite"
    if sd <= 0.0:
        return format_number(mean, 6)
    rounded = float(f"{sd:.1e}")
    power = max(_power(mean), _power(rounded)) if mean else _power(rounded)
    decimals = 1 - _power(rounded)
    if SMALLEST < power < LARGEST and not (power < -1 and decimals > 6):
        return f"{format_fixed(mean, decimals)} ± {format_fixed(rounded, decimals)}"
    places, unit = decimals + power, 10.0**power
    return f"({format_fixed(mean / unit, places)} ± {format_fixed(rounded / unit, places)}) × 10{_raise(power)}"


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


def format_fixed(value: float, decimals: int) -> str:
    """Return a number to so many decimals, rounded to tens and hundreds where they are negative; zero has no sign."""
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    return _minus(text if float(text) else text.lstrip("-"))


def format_signed(value: float, decimals: int = 1) -> str:
    """Return a number to so many decimals with its sign, plus or minus; what rounds to zero has none."""
    text = f"{value:+.{decimals}f}"
    return _minus(text if float(text) else text[1:])


def format_percent(ratio: float, digits: int | None = None) -> str:
    """Return a ratio in percent to so many significant digits; where left out, to two, or three from 99.5 % on."""
    if digits is None:
        digits = 2 if ratio < NEARLY_ALL else 3
    return f"{format_number(100.0 * ratio, digits)} %"


def format_p_value(value: float) -> str:
    """Return a p-value to two digits, or the bound that it stays below."""
    return "< 10⁻¹²" if value < SMALLEST_P else format_number(value, 2)


def format_probability(value: float) -> str:
    """Return a probability to two decimals, to three within 0.05 of zero and one, or the bound beyond."""
    if value < LEAST_PROBABILITY:
        return f"< {LEAST_PROBABILITY:g}"
    if value > 1.0 - LEAST_PROBABILITY:
        return f"> {1.0 - LEAST_PROBABILITY:g}"
    return format_fixed(value, 2 if 0.05 <= value <= 0.95 else 3)


def relation(number: str) -> str:
    """Return a printed number as it follows a symbol in a sentence: ``= 0.3``, or the bound itself."""
    return number if number.startswith(("<", ">")) else f"= {number}"


def format_range(values: Iterable[float], digits: int = 3) -> str:
    """Return the smallest and the largest of some values as ``low to high``, or one number where they print alike."""
    known = list(values)
    low, high = format_number(min(known), digits), format_number(max(known), digits)
    return low if low == high else f"{low} to {high}"


def format_vector(values: Iterable[float], digits: int = 3) -> str:
    """Return a vector as ``(x, y, z)``."""
    return f"({', '.join(format_number(float(value), digits) for value in values)})"


def format_unit(unit: str) -> str:
    """Return a unit with raised exponents, ``kg m²`` for ``kg m2``; a pure number, ``1``, has none."""
    return "" if unit == "1" else re.sub(r"(?<=[A-Za-z])-?\d+", lambda match: _raise(int(match[0])), unit)


def format_text(text: str) -> str:
    """Return a sentence with numbers and units in it as reports print them: ``kg/m³`` and ``3.6 × 10⁻¹²``."""
    units = re.sub(r"(?<![A-Za-z])(kg|m|s)([23])(?![0-9A-Za-z])", lambda match: match[1] + _raise(int(match[2])), text)
    return re.sub(r"(?<=\d)e([-+]?\d+)", lambda match: f" × 10{_raise(int(match[1]))}", units)


def _power(value: float) -> int:
    return math.floor(math.log10(abs(value))) if value else 0


def _minus(text: str) -> str:
    return text.replace("-", "−")


def _raise(power: int) -> str:
    return str(power).translate(_RAISED)
