"""Faults of the noise: how each is tested, measured and put into a model; the model of the noise that they make up."""

from bayesid.diagnosis.noise.encoder_fault import EncoderFault
from bayesid.diagnosis.noise.noise_fault import NoiseFault, SensorFault, noise_faults, register_fault
from bayesid.diagnosis.noise.sensor_faults import ColouredNoise, Outliers, Quantisation, UnderstatedNoise

__all__ = [
    "ColouredNoise",
    "EncoderFault",
    "NoiseFault",
    "Outliers",
    "Quantisation",
    "SensorFault",
    "UnderstatedNoise",
    "noise_faults",
    "register_fault",
]
