"""Print the oldest versions of the dependencies and of the extra ROS that pyproject.toml permits, for `pip -c`."""

import re
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
for requirement in [*project["dependencies"], *project["optional-dependencies"]["ros"]]:
    named = re.match(r"([\w-]+)>=([\w.]+)", requirement)
    if named is None:
        raise SystemExit(f"{requirement}: no lower bound")
    print(f"{named[1]}=={named[2]}")
