"""Run the study from the command line."""

from studies.cost import main

main()
