"""``python -m studies.load``."""

from studies.load import main

main()
