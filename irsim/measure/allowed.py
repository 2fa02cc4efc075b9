"""How far a figure may go by variances that a likelihood allows, none of them below 0."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irsim.types import Bools, Floats

_LEAST = -1e-9
"""A variance that is no less, in its own standard errors, is 0 but for rounding."""


@dataclass(frozen=True)
class Allowed:
    """Twice a log likelihood about its greatest value where no variance is below 0, up to squares.

    variances   (N,) at the greatest
    slopes      (N,) of what it lacks there
    information (N, N) Fisher's, of the variances
    """

    variances: Floats
    slopes: Floats
    information: Floats

    def ends(self, function: Floats, room: float) -> tuple[float, float]:
        """Least and greatest `function` (N,) @ variances of those that lack at most `room`.

        Each end lies within some face of the orthant, those variances that are 0 taken away, and is its own there.
        """
        function = function / self._scale
        found = [float(function @ (self.variances * self._scale))]
        for kept, centre, lacks, covariance in self._faces:
            if lacks > room:
                continue
            way = covariance @ function[kept]
            step = way * np.sqrt((room - lacks) / max(float(function[kept] @ way), 1e-300))
            for there in (centre - step, centre + step):
                if (there >= _LEAST).all():
                    found.append(float(function[kept] @ there))
        return min(found), max(found)

    @cached_property
    def _scale(self) -> Floats:
        """(N,) by which variances are in units of their own errors: what walks and what stays differ by 10^12."""
        own = np.sqrt(np.diag(self.information))
        return np.where(own > 0, own, 1.0)

    @cached_property
    def _faces(self) -> list[tuple[Bools, Floats, float, Floats]]:
        return list(self._each())

    def _each(self) -> Iterator[tuple[Bools, Floats, float, Floats]]:
        """Which variances are not 0 by decree, their likeliest values then, what is lacking there, their covariance;
        variances in units of their errors."""
        scale = self._scale
        variances, slopes = self.variances * scale, self.slopes / scale
        information = self.information / np.outer(scale, scale)
        linear = slopes - 2 * information @ variances
        none = float(variances @ information @ variances - slopes @ variances)
        for taken in itertools.product((False, True), repeat=len(variances)):
            kept = np.array(taken)
            covariance = np.linalg.pinv(information[np.ix_(kept, kept)], hermitian=True)
            centre = -covariance @ linear[kept] / 2
            yield kept, centre, none + float(linear[kept] @ centre) / 2, covariance
