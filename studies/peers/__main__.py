"""Write the report: ``python -m studies.peers --full``."""

from studies.peers import main

main()
