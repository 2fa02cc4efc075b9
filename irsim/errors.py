"""The one exception family of irsim; its text is what a user sees."""

from __future__ import annotations

from typing import NamedTuple


class IrsimError(Exception):
    """Anything irsim raises on purpose. ``str(error)`` is ready to be shown to a user."""


class InputError(IrsimError):
    """What the user gave is wrong: a scenario, a recording, an option (exit status 2).

    The text is one line for each thing that is wrong, each with its place.
    """


class Notice(NamedTuple):
    """Something legal that may not be meant: its place in the tree, and what to say of it."""

    at: tuple[str | int, ...]
    what: str
