"""Run the command line as ``python -m bayesid``."""

from bayesid.app.command_line import main

if __name__ == "__main__":
    main()
