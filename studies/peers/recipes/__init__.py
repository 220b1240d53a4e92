"""Recipes: what a user writes to identify the base of a robot in deep space, one file for each way.

Each file stands alone, imports nothing of the studies, and has ``identify(folder)``: the ten quantities of the base
(mass, centre of mass, inertia about it as xx, yy, zz, xy, xz, yz) with their standard deviations, from ``robot.urdf``
and ``manoeuvre-1.csv`` and so on. Blank lines, comments and docstrings are not counted as what the user writes.
"""
