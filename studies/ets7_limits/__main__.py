"""Write the report: ``python -m studies.ets7_limits``."""

from studies.ets7_limits import main

main()
