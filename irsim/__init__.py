"""irsim renders infrared scenes from YAML and records frames with exact truth.

scenario = irsim.load("scenarios/examples/sky.yaml")
for frame, truth in irsim.frames(scenario):
    ...
recording = irsim.open_recording("sky.mcap")
"""

from __future__ import annotations

from irsim.errors import lazy_exports

__version__ = "0.1.0"

# Public name -> its module, imported on first use: `irsim --help` imports no numpy.
_PUBLIC = {
    "Box": "irsim.types",
    "Frame": "irsim.types",
    "Input": "irsim.types",
    "Pose": "irsim.types",
    "Source": "irsim.types",
    "TargetTruth": "irsim.types",
    "Truth": "irsim.types",
    "homography": "irsim.geometry.projection",
    "InputError": "irsim.errors",
    "IrsimError": "irsim.errors",
    "Scenario": "irsim.scenario.model",
    "dumps": "irsim.scenario.loader",
    "find": "irsim.scenario.catalog",
    "build": "irsim.scenario.loader",
    "load": "irsim.scenario.loader",
    "loads": "irsim.scenario.loader",
    "change": "irsim.scenario.loader",
    "read_part": "irsim.scenario.loader",
    "scalar": "irsim.config.yaml_text",
    "Variations": "irsim.scenario.sampling",
    "sample": "irsim.scenario.sampling",
    "variations": "irsim.scenario.sampling",
    "Expectation": "irsim.scenario.expectation",
    "ErrorBelow": "irsim.scenario.expectation",
    "HonestWhileHidden": "irsim.scenario.expectation",
    "NeverLost": "irsim.scenario.expectation",
    "ReacquiredWithin": "irsim.scenario.expectation",
    "PdAtLeast": "irsim.scenario.expectation",
    "SwitchesAtMost": "irsim.scenario.expectation",
    "FalseTracksAtMost": "irsim.scenario.expectation",
    "FalseAlarmsAtMost": "irsim.scenario.expectation",
    "Rendering": "irsim.render.stream",
    "frames": "irsim.render.stream",
    "Twins": "irsim.render.twins",
    "Moments": "irsim.render.moments",
    "Detectability": "irsim.render.detectability",
    "TargetBounds": "irsim.types",
    "FrameBounds": "irsim.render.bounds",
    "bounds": "irsim.render.bounds",
    "Mask": "irsim.render.masks",
    "masks": "irsim.render.masks",
    "Recording": "irsim.recording",
    "open_recording": "irsim.recording",
    "record": "irsim.recording",
    "TrackHeader": "irsim.recording",
    "TrackState": "irsim.recording",
    "read_tracks": "irsim.recording",
    "write_tracks": "irsim.recording",
    "open_source": "irsim.render.sources",
    "unheeded": "irsim.lint.warnings",
    "warnings": "irsim.lint.warnings",
    "is_recording": "irsim.config.paths",
    "Fit": "irsim.calibration.fit",
    "fit": "irsim.calibration.fit",
    "measure_noise": "irsim.calibration",
    "measure_realism": "irsim.calibration",
    "measured_bounds": "irsim.calibration.measured_bounds",
    "export_dataset": "irsim.datasets",
    "import_frames": "irsim.recording.importers",
    "LiveServer": "irsim.live",
    "Overlay": "irsim.live",
}

__all__ = sorted(_PUBLIC)

__getattr__, __dir__ = lazy_exports(__name__, _PUBLIC)
