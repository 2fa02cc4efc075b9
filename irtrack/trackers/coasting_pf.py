"""`coasting_pf`: grey levels and velocity as a product, for targets that are hidden or drown in clutter."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from irtrack.trackers.base import Deviation, Ratio
from irtrack.trackers.product_pf import ProductPF


class CoastingPF(ProductPF):
    """`product_pf` with a straight line in place of principal axes, which waits for unseen targets on it.

    A variant of M. Xue, G. Yuan, K. Xie 2011, of no paper's making. Its parts are switches of
    `cascade_pf` and `product_pf`: the velocity by least squares over ten frames (`velocity`, `k`);
    particles carried along it, so that they need not spread so wide (`carried`, `radius`); an unseen
    target goes on along its line and is not learned from (`coast`, `update`); eight bins, which 25
    pixels can fill; and the frame itself, since the high-pass takes from a small target what tells it
    from bright cloud (`high_pass`). The values were found on scenes made for the purpose and on seeds
    from 1000 on of the rebuilt scenes of that paper.
    """

    source: ClassVar[str] = "after Xue, Yuan, Xie 2011"

    bins: int = Field(default=8, ge=2, le=256)
    """Grey levels of the histogram."""
    high_pass: Literal["none", "ring", "full"] = "none"
    """What histograms are taken of: the frame, or what it stands above a predicted background."""
    particles: int = Field(default=60, ge=2, le=100_000)
    """N."""
    k: int = Field(default=10, ge=3, le=100)
    """Frames of the trajectory; until there are so many, grey levels count alone."""
    velocity: Literal["lambda", "sqrt_lambda", "least_squares"] = "least_squares"
    """What the velocity says of a place: see `product_pf`."""
    carried: bool = True
    """Whether particles spread about where the trajectory's line leads from their place."""
    coast: bool = True
    """Whether an unseen target is taken to go on along the trajectory's line."""
    radius: Deviation = 5.0
    """Radius of the particles' spread, px."""
    sigma_grey: Ratio = 0.25
    """sigma of eq. 5."""
    update: Literal["always", "seen", "never"] = "seen"
    """When the reference follows the target."""
