"""Memory of large arrays returns to the system as soon as they are freed."""

from __future__ import annotations

import subprocess
import sys

import pytest

HELD = """
import resource, sys
import numpy as np
from bayesid._math.memory import take_large_arrays_singly

def held():
    with open("/proc/self/statm", encoding="ascii") as stream:
        return int(stream.read().split()[1]) * resource.getpagesize()

if sys.argv[1] == "singly":
    take_large_arrays_singly()
for _ in range(2):  # the library learns from the first arrays that are freed
    before = held()
    large, small = [], []
    for _ in range(40):
        large.append(np.ones(1_000_000))
        small.append(np.ones(10_000))
    full = held()
    del large
    left = held()
print((left - before) / (full - before))
"""


@pytest.mark.skipif(
    sys.platform != "linux", reason="the C library is that of Linux, as is the file that says what is held"
)
def test_large_arrays_between_small_ones_are_given_back() -> None:
    """Of 320 MB next to nothing stays; of arrays in the heap all would that lie before the last small one."""
    left = {}
    for how in ("usual", "singly"):
        done = subprocess.run([sys.executable, "-c", HELD, how], capture_output=True, text=True, check=True)
        left[how] = float(done.stdout)
    assert left["singly"] < 0.05
    assert left["usual"] > 0.5
