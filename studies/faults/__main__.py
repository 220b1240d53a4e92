"""Write the report: ``python -m studies.faults --full``."""

from studies.faults import main

main()
