"""What is told where there is none of a name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from irsim.config.base import suggestion

_MANY = 8
"""Names from which on those that are like the word stand first."""
_LIKE = 0.6
"""How much alike (`difflib`'s ratio) a word and a name are that are held for like each other."""


def no_such(word: object, allowed: Iterable[str], none: str = "nothing") -> str:
    """'there is no 'jat'; allowed: jet, far; did you mean 'jet'?': of many names those first that are most like it,
    the others in the order in which they are given."""
    known = list(dict.fromkeys(allowed))
    if len(known) > _MANY:
        sought = str(word).lower()
        likeness = {name: difflib.SequenceMatcher(None, sought, name.lower()).ratio() for name in known}
        known.sort(key=lambda name: -likeness[name] if likeness[name] >= _LIKE else 0.0)
    within = next((f"; did you mean '{each}'?" for each in known if each.endswith(f".{word}")), None)
    return f"there is no '{word}'; allowed: {', '.join(known) or none}{within or suggestion(word, known)}"
