"""``python -m studies.base_parameters``."""

from studies.base_parameters import main

main()
