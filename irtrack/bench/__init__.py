"""Many runs: scenes by trackers by seeds, kept in a results file."""

from irtrack.bench.asked import SourceEntry
from irtrack.bench.cell import Cell, Key, Run, SourceRow
from irtrack.bench.exporting import export
from irtrack.bench.pairs import Pair, difference, distinct, pairs, value
from irtrack.bench.remote import cluster
from irtrack.bench.results import Results
from irtrack.bench.specs import Entry, parse_tracker_spec, parse_trackers
from irtrack.bench.suite import Suite, is_suite, load_suite
from irtrack.bench.sweep import run_bench
from irtrack.bench.table import ALL_SOURCES, SummaryRow, summary

__all__ = [
    "ALL_SOURCES",
    "Cell",
    "Entry",
    "Key",
    "Pair",
    "Results",
    "Run",
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
