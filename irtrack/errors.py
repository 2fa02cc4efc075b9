"""The one exception family of irtrack; its text is what a user sees."""

from __future__ import annotations


class IrtrackError(Exception):
    """Anything irtrack raises on purpose. ``str(error)`` is ready to be shown to a user."""


class InputError(IrtrackError):
    """What the user gave is wrong: a tracker's name, a parameter, a box (exit status 2)."""
