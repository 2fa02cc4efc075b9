"""Properties that every tracker or detector should have, and their check: `irtrack check`."""

from __future__ import annotations

from irtrack.properties.check import Outcome, Profile, check, check_tracker
from irtrack.properties.table import EXCEPTIONS, PROPERTIES, PROPERTIES_OF, Property

__all__ = ["EXCEPTIONS", "PROPERTIES", "PROPERTIES_OF", "Outcome", "Profile", "Property", "check", "check_tracker"]
