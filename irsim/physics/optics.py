"""What lens and pixels make of a point's light: a Gaussian blur, or diffraction and defocus beside it."""

from irsim.physics.diffraction import LensSpread
from irsim.physics.lens import Lens
from irsim.physics.psf import GaussianSpread, PointSpread
from irsim.physics.wings import reaching

__all__ = ["GaussianSpread", "Lens", "LensSpread", "PointSpread", "reaching"]
