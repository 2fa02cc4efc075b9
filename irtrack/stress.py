"""The stress suite for any tracker: each cause of failure alone, from harmless to severe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from irsim.kinds import suggestion
from irtrack.bench import Entry, Suite, load_suite
from irtrack.errors import InputError

SUITE = "suites/stress-suite"
"""All stress scenarios at all of their severities."""


def stress_suite(trackers: Sequence[Entry], seeds: int, causes: Sequence[str] = ()) -> Suite:
    """The shipped suite for these trackers, of the causes named, or of all where none is; InputError for no cause."""
    suite = load_suite(SUITE)
    by_cause = {each.name: each.family for each in suite.sources}
    known = list(dict.fromkeys(by_cause.values()))
    for cause in causes:
        if cause not in known:
            raise InputError(f"cause '{cause}': allowed: {', '.join(known)}{suggestion(cause, known)}")
    sources = [each for each in suite.sources if not causes or by_cause[each.name] in causes]
    return replace(suite, sources=sources, trackers=list(trackers), seeds=seeds)
