"""What lens and pixels make of a point's light: a Gaussian blur, or diffraction and defocus beside it."""

from irsim.optics.lens import Lens
from irsim.optics.lens_spread import LensSpread
from irsim.optics.spread import GaussianSpread, PointSpread
from irsim.optics.wings import reaching

__all__ = ["GaussianSpread", "Lens", "LensSpread", "PointSpread", "reaching"]
