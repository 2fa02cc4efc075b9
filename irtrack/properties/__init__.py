"""Properties that every tracker should have, and their check: `irtrack check`."""

from __future__ import annotations

from irtrack.properties.check import Outcome, Profile, check, check_tracker
from irtrack.properties.table import EXCEPTIONS, PROPERTIES, Property

__all__ = ["EXCEPTIONS", "PROPERTIES", "Outcome", "Profile", "Property", "check", "check_tracker"]
