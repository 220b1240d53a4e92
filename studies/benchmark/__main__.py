"""``python -m studies.benchmark``."""

from studies.benchmark.report import main

main()
