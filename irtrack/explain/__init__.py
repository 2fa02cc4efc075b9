"""Explanation of lost tracks by twins: the same scene with causes removed."""

from irtrack.explain.explain import explain_loss, explain_losses
from irtrack.explain.explanation import CauseShare, Explanation

__all__ = ["CauseShare", "Explanation", "explain_loss", "explain_losses"]
