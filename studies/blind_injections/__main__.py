"""``python -m studies.blind_injections``."""

from studies.blind_injections import main

main()
