"""Write the report: ``python -m studies.planning --full``."""

from studies.planning import main

main()
