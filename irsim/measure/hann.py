"""What a Hann window w does to a power spectrum.

It is sin^2 over the samples, so that the means of w, w^2 and w^4 are 1/2, 3/8 and 35/128.
"""

from __future__ import annotations

HANN_GAIN = (1 / 2) ** 2 / (3 / 8)
"""(sum w)^2 / (N sum w^2): what is of one frequency stands above white noise by so much of what it would without a
window; 1 over the equivalent noise bandwidth, 1.5 (F. J. Harris, Proc. IEEE 66, 51 (1978), table I)."""

HANN_FREEDOM = 35 / 128 / (3 / 8) ** 2
"""N sum w^4 / (sum w^2)^2, 1.94: a sum over frequencies has so many times fewer degrees of freedom than without a
window, an axis, for neighbouring frequencies are then no longer independent."""
