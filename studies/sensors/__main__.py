"""``python -m studies.sensors``."""

from studies.sensors import main

main()
