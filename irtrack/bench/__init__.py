"""Bench: runs of every tracker on every scenario or recording with every seed, kept in a results file."""

from irtrack.bench.export import export
from irtrack.bench.records import Key, Run, RunRecord, SourceRow
from irtrack.bench.remote import cluster
from irtrack.bench.results import Results
from irtrack.bench.run import run_bench
from irtrack.bench.spec import Entry, SourceEntry, parse_tracker_spec, parse_trackers
from irtrack.bench.suite import Suite, is_suite, load_suite
from irtrack.bench.summary import ALL_SOURCES, Pair, SummaryRow, difference, distinct, pairs, summary, value

__all__ = [
    "ALL_SOURCES",
    "Entry",
    "Key",
    "Pair",
    "Results",
    "Run",
    "RunRecord",
    "SourceEntry",
    "SourceRow",
    "Suite",
    "SummaryRow",
    "cluster",
    "difference",
    "distinct",
    "export",
    "is_suite",
    "load_suite",
    "pairs",
    "parse_tracker_spec",
    "parse_trackers",
    "run_bench",
    "summary",
    "value",
]
