"""``python -m studies.base_body``."""

from studies.base_body import main

main()
