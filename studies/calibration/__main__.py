"""``python -m studies.calibration``."""

from studies.calibration import main

main()
