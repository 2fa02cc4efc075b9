"""irtrack replays infrared recordings into trackers, measures where they break, and reports it.

track = irtrack.run("grey_pf", "sky")
print(irtrack.score(track, "sky").lost)
with irtrack.run_bench(["sky", "ground"], ["grey_pf", "kalman"], seeds=10, results="irtrack.db") as results:
    irtrack.write_report(results, "report.html")
"""

from __future__ import annotations

from irsim.errors import lazy_exports

# Public name -> its module, imported on first use: `irtrack --help` must not wait for numpy.
_PUBLIC = {
    "Box": "irsim.types",
    "Estimate": "irtrack.types",
    "Track": "irtrack.types",
    "Tracker": "irtrack.types",
    "InputError": "irtrack.errors",
    "IrtrackError": "irtrack.errors",
    "TrackerError": "irtrack.errors",
    "WorkerError": "irtrack.errors",
    "make": "irtrack.registry.table",
    "run": "irtrack.replay.replay",
    "run_many": "irtrack.replay.many",
    "run_detector": "irtrack.replay.many",
    "make_detector": "irtrack.detectors",
    "Detections": "irtrack.types",
    "DetectionSet": "irtrack.tracks",
    "TrackFrame": "irtrack.tracks",
    "TrackSet": "irtrack.tracks",
    "write_track_set": "irtrack.bench.track_files",
    "read_track_set": "irtrack.bench.track_files",
    "write_detections": "irtrack.bench.track_files",
    "run_anchors": "irtrack.metrics.vot",
    "Reference": "irtrack.metrics",
    "Score": "irtrack.metrics",
    "score": "irtrack.metrics.score",
    "vot": "irtrack.metrics",
    "run_bench": "irtrack.bench",
    "Entry": "irtrack.bench",
    "SourceEntry": "irtrack.bench",
    "summary": "irtrack.bench",
    "load_suite": "irtrack.bench",
    "export": "irtrack.bench",
    "Results": "irtrack.bench",
    "compare": "irtrack.bench.compare",
    "write_report": "irtrack.report",
    "check": "irtrack.properties",
    "check_tracker": "irtrack.properties",
    "explain_loss": "irtrack.explain",
    "find_failure": "irtrack.falsify",
    "kept_failures": "irtrack.falsify",
}

__all__ = sorted(_PUBLIC)

__getattr__, __dir__ = lazy_exports(__name__, _PUBLIC)
