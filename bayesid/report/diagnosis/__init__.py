"""The report of a diagnosis, page by page, and its sentences for the terminal."""
