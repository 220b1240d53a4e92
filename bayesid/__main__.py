"""Run the command line as ``python -m bayesid``."""

from bayesid.app.command_line import main

main()
