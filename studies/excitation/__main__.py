"""Write the report: ``python -m studies.excitation --full``."""

from studies.excitation import main

main()
