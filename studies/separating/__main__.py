"""Write the report: ``python -m studies.separating``."""

from studies.separating import main

main()
