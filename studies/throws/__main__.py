"""Write the report: ``python -m studies.throws --full``."""

from studies.throws import main

main()
