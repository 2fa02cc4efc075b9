"""What is told where there is none of a name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from irsim.kinds import suggestion

_MANY = 8
"""Names from which on the nearest stand first."""


def no_such(word: object, allowed: Iterable[str], none: str = "nothing") -> str:
    """'there is no 'jat'; allowed: jet, far; did you mean 'jet'?': of many names those first that are most like it."""
    known = list(dict.fromkeys(allowed))
    if len(known) > _MANY:
        sought = str(word).lower()
        known.sort(key=lambda name: -difflib.SequenceMatcher(None, sought, name.lower()).ratio())
    within = next((f"; did you mean '{each}'?" for each in known if each.endswith(f".{word}")), None)
    return f"there is no '{word}'; allowed: {', '.join(known) or none}{within or suggestion(word, known)}"
