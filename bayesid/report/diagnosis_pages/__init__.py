"""Pages of a diagnosis report, one file each."""
