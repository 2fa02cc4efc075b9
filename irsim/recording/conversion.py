"""Other people's pictures and labels made into recordings."""

from irsim.recording.importing import ACCURACY_PX, import_frames, name_of

__all__ = ["ACCURACY_PX", "import_frames", "name_of"]
