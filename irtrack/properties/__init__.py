"""Properties of any tracker, and the check that tries them: `irtrack check`."""

from __future__ import annotations

from irtrack.properties.checking import check, check_tracker
from irtrack.properties.examining import Outcome, Profile
from irtrack.properties.exceptions import EXCEPTIONS
from irtrack.properties.table import PROPERTIES, Property

__all__ = ["EXCEPTIONS", "PROPERTIES", "Outcome", "Profile", "Property", "check", "check_tracker"]
