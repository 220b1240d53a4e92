"""Commands, study files and what they name, turned into objects."""
