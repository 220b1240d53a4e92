"""Command line of the manual."""

from studies.manual import main

main()
