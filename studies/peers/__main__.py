"""Write the report: ``python -m studies.peers --full``."""

from studies.peers.report import main

if __name__ == "__main__":
    main()
