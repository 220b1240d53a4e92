"""Identifiability: what the robot's structure allows, and what a study's manoeuvres, sensors and priors allow."""

from bayesid.identifiability.base_parameters import Base, BaseParameters, base_parameters, standard_names

__all__ = ["Base", "BaseParameters", "base_parameters", "standard_names"]
