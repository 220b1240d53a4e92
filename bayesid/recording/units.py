"""Units in which telemetry comes, as factors to those of the format: rad, rad/s, m/s2, s."""

from __future__ import annotations

import math

__all__ = ["ANGLES", "STANDARD_GRAVITY", "TIMES", "UNITS"]

STANDARD_GRAVITY = 9.80665
"""Standard gravity [m/s2]."""

ANGLES = {"rad": 1.0, "deg": math.pi / 180.0, "mrad": 1e-3, "arcsec": math.pi / 648000.0, "rev": 2.0 * math.pi}
"""Units of angles [rad]."""

UNITS = {
    "rate": {f"{name}/s": factor for name, factor in ANGLES.items()}
    | {"mdeg/s": 1e-3 * ANGLES["deg"], "deg/h": ANGLES["deg"] / 3600.0, "rpm": math.pi / 30.0},
    "accel": {
        "m/s2": 1.0,
        "g": STANDARD_GRAVITY,
        "mg": 1e-3 * STANDARD_GRAVITY,
        "ug": 1e-6 * STANDARD_GRAVITY,
        "mm/s2": 1e-3,
        "cm/s2": 1e-2,
    },
}
"""Units of the base's sensors [rad/s, m/s2]."""

TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}
"""Units of times [s]."""
