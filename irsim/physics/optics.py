"""What lens and pixels make of a point's light: a Gaussian blur, or diffraction and defocus beside it."""

from irsim.physics.diffraction import LensPSF
from irsim.physics.lens import Lens
from irsim.physics.psf import PSF, GaussianPSF
from irsim.physics.wings import reaching

__all__ = ["PSF", "GaussianPSF", "Lens", "LensPSF", "reaching"]
