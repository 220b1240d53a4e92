"""classifiers.py RAN ABSENT: compare the versions of Python that pyproject.toml names with those that ran.

Each argument is a list of versions, such as "3.11 3.12". Only a version that the machine lacks may be named without.
"""

import re
import sys
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
classified = re.findall(r"Programming Language :: Python :: (3\.\d+)", "\n".join(project["classifiers"]))
ran, absent = (set(argument.split()) for argument in sys.argv[1:])
if unnamed := sorted(ran - set(classified)):
    raise SystemExit(f"no classifier of pyproject.toml names Python {', '.join(unnamed)}, on which commands ran")
if untried := sorted(set(classified) - ran - absent):
    raise SystemExit(f"classifiers of pyproject.toml name Python {', '.join(untried)}, on which nothing ran")
