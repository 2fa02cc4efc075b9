"""The exceptions of irtrack are irsim's: whoever runs a tracker opens sources, and one ``except`` catches both.

IrtrackError  anything raised on purpose; ``str(error)`` is ready to be shown to a user
InputError    what the user gave is wrong: a tracker's name, a parameter, a box, a recording (exit status 2)
"""

from irsim.errors import InputError
from irsim.errors import IrsimError as IrtrackError

__all__ = ["InputError", "IrtrackError"]
