"""Which AGC showed counts as pictures: fitted to both."""

from irsim.displayed.choice import FittedDisplay, fit_display
from irsim.displayed.fitted import FITS
from irsim.displayed.knobs import KNOBS, Path
from irsim.displayed.pairs import Pairs, paired
from irsim.displayed.search import Tolerance

__all__ = ["FITS", "KNOBS", "FittedDisplay", "Pairs", "Path", "Tolerance", "fit_display", "paired"]
