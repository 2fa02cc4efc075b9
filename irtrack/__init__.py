"""irtrack replays infrared recordings into trackers, measures where they break, and reports it.

track = irtrack.run("grey_pf", "sky.mcap")
with irtrack.bench(["sky", "ground"], ["grey_pf", "kalman"], seeds=10, results="irtrack.db") as results:
    irtrack.report(results, "report.html")
"""

from __future__ import annotations

import importlib
from typing import Any

# Public name -> its module, imported on first use: `irtrack --help` must not wait for numpy.
_PUBLIC = {
    "Estimate": "irtrack.types",
    "Track": "irtrack.types",
    "Tracker": "irtrack.types",
    "InputError": "irtrack.errors",
    "IrtrackError": "irtrack.errors",
    "make": "irtrack.trackers",
    "run": "irtrack.replay",
    "Reference": "irtrack.metrics",
    "Score": "irtrack.metrics",
    "score": "irtrack.metrics",
    "run_bench": "irtrack.bench",
    "summary": "irtrack.bench",
    "Results": "irtrack.bench",
    "write_report": "irtrack.report",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'irtrack' has no attribute {name!r}")
    value = getattr(importlib.import_module(_PUBLIC[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*globals(), *__all__]
