"""Commands of ``bayesid``, study files, and the conversion of a study into objects."""
