"""Run the study from the command line."""

from studies.conventions import main

main()
