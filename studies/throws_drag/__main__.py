"""Write the report: ``python -m studies.throws_drag --full``."""

from studies.throws_drag import main

main()
