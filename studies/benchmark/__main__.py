"""``python -m studies.benchmark``."""

from studies.benchmark import main

main()
