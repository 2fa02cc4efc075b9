"""irsim renders infrared scenes from YAML and records frames with exact truth.

scenario = irsim.load("scenarios/examples/sky.yaml")
for frame, truth in irsim.frames(scenario):
    ...
recording = irsim.open_recording("sky.mcap")
"""

from __future__ import annotations

from irsim.lazy import front_door

__version__ = "0.1.0"

# Public name -> its module, imported on first use: `irsim --help` must not wait for numpy.
_PUBLIC = {
    "Box": "irsim.types",
    "Frame": "irsim.types",
    "Input": "irsim.types",
    "Source": "irsim.types",
    "TargetTruth": "irsim.types",
    "Truth": "irsim.types",
    "InputError": "irsim.errors",
    "IrsimError": "irsim.errors",
    "Scenario": "irsim.scenario",
    "dumps": "irsim.loader",
    "find": "irsim.loader",
    "build": "irsim.loader",
    "load": "irsim.loader",
    "loads": "irsim.loader",
    "change": "irsim.loader",
    "read_part": "irsim.loader",
    "scalar": "irsim.yamlfile",
    "Variations": "irsim.space",
    "sample": "irsim.space",
    "variations": "irsim.space",
    "Expectation": "irsim.expectation",
    "ErrorBelow": "irsim.expectation",
    "HonestWhileHidden": "irsim.expectation",
    "NeverLost": "irsim.expectation",
    "ReacquiredWithin": "irsim.expectation",
    "Rendering": "irsim.simulate",
    "frames": "irsim.simulate",
    "Moments": "irsim.moments",
    "Mask": "irsim.masking",
    "masks": "irsim.masking",
    "Recording": "irsim.recording",
    "open_recording": "irsim.recording",
    "record": "irsim.recording",
    "TrackHeader": "irsim.recording",
    "TrackState": "irsim.recording",
    "read_tracks": "irsim.recording",
    "write_tracks": "irsim.recording",
    "open_source": "irsim.sources",
    "unheeded": "irsim.sources",
    "is_recording": "irsim.files",
    "Fit": "irsim.fitting",
    "fit": "irsim.fitting",
    "measure_noise": "irsim.measure",
    "measure_realism": "irsim.measure",
    "import_frames": "irsim.convert",
}

__all__ = sorted(_PUBLIC)

__getattr__, __dir__ = front_door(__name__, _PUBLIC)
