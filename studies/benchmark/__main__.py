"""Run the benchmark: ``python -m studies.benchmark [--full] [--output FILE]``."""

from studies.benchmark.report import main

main()
