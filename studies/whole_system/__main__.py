"""Write the report: ``python -m studies.whole_system --full``."""

from studies.whole_system import main

main()
