"""Search of a scenario's ranges for a scene in which a tracker breaks a rule; shrinking; kept failures."""

from irtrack.falsify.falsification import Failure, NoFailure, SeedSensitivity
from irtrack.falsify.find import find_failure
from irtrack.falsify.regressions import KEPT, Kept, Regressions, check_kept, kept_failures
from irtrack.falsify.search import SEARCHES

__all__ = [
    "KEPT",
    "SEARCHES",
    "Failure",
    "Kept",
    "NoFailure",
    "Regressions",
    "SeedSensitivity",
    "check_kept",
    "find_failure",
    "kept_failures",
]
