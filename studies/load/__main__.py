"""Write the report: ``python -m studies.load --full``."""

from studies.load import main

main()
