"""Search of a scenario's ranges for a scene in which a tracker breaks a rule; what is found is made small and kept."""

from irtrack.falsify.falsification import Failure, Luck, Nearest, find_failure
from irtrack.falsify.regressions import KEPT, Kept, Revisited, kept_failures, revisit
from irtrack.falsify.search import SEARCHES

__all__ = [
    "KEPT",
    "SEARCHES",
    "Failure",
    "Kept",
    "Luck",
    "Nearest",
    "Revisited",
    "find_failure",
    "kept_failures",
    "revisit",
]
