"""Many runs: scenes by trackers by seeds, kept in a results file."""

from irtrack.bench.cell import Cell, Key, Run, SourceRow, Trace
from irtrack.bench.results import Results

__all__ = ["Cell", "Key", "Results", "Run", "SourceRow", "Trace"]
