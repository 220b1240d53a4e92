"""Kinds of causes: what each would change in the residual. The kinds of the package are registered here."""

from bayesid.diagnosis.candidates.cause_kind import register_kind
from bayesid.diagnosis.candidates.event_cause import EventCause
from bayesid.diagnosis.candidates.generic_cause import GenericCause
from bayesid.diagnosis.candidates.initial_rate import InitialRate
from bayesid.diagnosis.candidates.instant_cause import MassShiftCause
from bayesid.diagnosis.candidates.linear_cause import LinearCause
from bayesid.diagnosis.candidates.order_cause import OrderLineCause
from bayesid.diagnosis.candidates.pulses_cause import PulsesCause
from bayesid.diagnosis.candidates.vibration_cause import VibrationCause

_SHAPED = (VibrationCause(), MassShiftCause(), EventCause(), PulsesCause(), OrderLineCause())

for _kind in (LinearCause(), InitialRate(), *_SHAPED, GenericCause()):
    register_kind(_kind)
