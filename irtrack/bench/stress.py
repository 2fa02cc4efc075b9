"""The stress suite for any tracker: each cause of failure alone, from harmless to severe."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from irsim.config.base import suggestion
from irtrack.bench import Entry, Suite, load_suite
from irtrack.errors import InputError

SUITE = "suites/stress-suite"
"""All causes of failure, a stress scenario each at all of its severities."""


def stress_suite(trackers: Sequence[Entry], seeds: int, causes: Sequence[str] = (), path: str = SUITE) -> Suite:
    """A suite of sources at severities for these trackers, of the causes named, or of all where none is.

    path   a suite's file, or the name of a shipped one;  causes  what it calls its sources

    InputError for no such cause, for a source at fewer than two severities, and as `load_suite`.
    """
    suite = load_suite(path)
    by_cause = {each.name: each.family for each in suite.sources}
    known = Counter(by_cause.values())
    for name, severities in known.items():
        if severities < 2:
            raise InputError(
                f"{path}: {name} is asked for at one severity at most; allowed: two of its `severities`, or more"
            )
    for cause in causes:
        if cause not in known:
            raise InputError(f"cause '{cause}': allowed: {', '.join(known)}{suggestion(cause, known)}")
    sources = [each for each in suite.sources if not causes or by_cause[each.name] in causes]
    return replace(suite, sources=sources, trackers=list(trackers), seeds=seeds)
