"""What the words of `irtrack bench` ask for: a suite, or sources with labels and changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from irtrack.errors import InputError

if TYPE_CHECKING:
    from irtrack.bench import Suite
    from irtrack.bench.asked import Asked


@dataclass(frozen=True)
class Words:
    """(label, source) of each source, the label None where none is given; and KEY=VALUE for all scenarios."""

    sources: tuple[tuple[str | None, str], ...]
    changes: tuple[str, ...]


def read_words(words: Sequence[str]) -> Words:
    """The words told apart: KEY=VALUE has a key of a scenario before its sign and no file behind it."""
    from irsim import Scenario

    sources: list[tuple[str | None, str]] = []
    changes: list[str] = []
    for word in words:
        before, equals, behind = word.partition("=")
        if not equals or Path(word).exists():
            sources.append((None, word))
        elif before.partition(".")[0] in Scenario.model_fields and not Path(behind).exists():
            changes.append(word)
        else:
            sources.append((before, behind))
    seeds = [change for change in changes if change.startswith("seed=")]
    if seeds:
        raise InputError(f"{seeds[0]}: a bench gives the scenes their seeds; allowed: --seeds N")
    if not sources:
        raise InputError(f"{' '.join(changes)}: no source; allowed: at least one scenario or recording")
    return Words(tuple(sources), tuple(changes))


def suite_of(words: Words, trackers: str | None, severities: str | None) -> Suite:
    """What is to be run: by the suite given, or by the sources and options."""
    from irtrack.bench import Suite, is_suite, load_suite, parse_trackers

    suites = [word for _, word in words.sources if is_suite(word)]
    if suites and len(words.sources) > 1:
        raise InputError(f"{suites[0]}: is a suite (by its name), which stands alone; allowed: one suite, or no suite")
    if suites:
        if words.changes:
            raise InputError(f"{words.changes[0]}: {suites[0]} says its changes itself, under the key `changes`")
        if severities is not None:
            raise InputError(f"--severities {severities}: {suites[0]} says which itself")
        suite = load_suite(suites[0])
        return suite if trackers is None else replace(suite, trackers=parse_trackers(trackers))
    levels = _severities(severities)
    opened = [each for label, word in words.sources for each in _asked(label, word, words.changes, levels)]
    if trackers is None:
        raise InputError("--trackers: is missing; allowed: names of irtrack list, e.g. --trackers grey_pf,kalman")
    return Suite("", opened, parse_trackers(trackers), 10, 1, "display", None)


def _asked(label: str | None, word: str, changes: Sequence[str], levels: Any) -> list[Asked]:
    """The source of that word; InputError where there is none, also of what reads like a change of something."""
    from irsim import Scenario
    from irsim.config.base import suggestion
    from irtrack.bench import SourceEntry
    from irtrack.bench.asked import asked

    try:
        return list(asked(SourceEntry(word, changes, severities=levels, name=label)))
    except InputError as error:
        if label is None or Path(word).exists():
            raise
        raise InputError(
            f"{label}={word}: {error}; KEY=VALUE is for a scenario's keys, a tracker's go to --trackers "
            f"NAME:KEY=VALUE{suggestion(label, Scenario.model_fields)}"
        ) from None


def _severities(text: str | None) -> Any:
    if text is None or text == "all":
        return text or ()
    try:
        return tuple(int(word) for word in text.split(","))
    except ValueError:
        raise InputError(f"--severities {text}: allowed: all, or whole numbers such as 0,3,5") from None
