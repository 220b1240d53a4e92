"""Write the report: ``python -m studies.ets7_drift --full``."""

from studies.ets7_drift import main

main()
