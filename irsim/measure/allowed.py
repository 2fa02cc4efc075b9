"""How far a figure may go by variances that a likelihood allows, none of them below 0."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irsim.types import Bools, Floats

_LEAST = -1e-9
"""A variance that is no less, as a share of the greatest, is 0 but for rounding."""


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
        found = [float(function @ self.variances)]
        for kept, centre, lacks, covariance in self._faces:
            if lacks > room:
                continue
            way = covariance @ function[kept]
            step = way * np.sqrt((room - lacks) / max(float(function[kept] @ way), 1e-300))
            for there in (centre - step, centre + step):
                if (there >= _LEAST * np.abs(there).max(initial=0)).all():
                    found.append(float(function[kept] @ there))
        return min(found), max(found)

    @cached_property
    def _faces(self) -> list[tuple[Bools, Floats, float, Floats]]:
        return list(self._each())

    def _each(self) -> Iterator[tuple[Bools, Floats, float, Floats]]:
        """Which variances are not 0 by decree, their likeliest values then, what is lacking there, their covariance."""
        linear = self.slopes - 2 * self.information @ self.variances
        none = float(self.variances @ self.information @ self.variances - self.slopes @ self.variances)
        for taken in itertools.product((False, True), repeat=len(self.variances)):
            kept = np.array(taken)
            covariance = np.linalg.pinv(self.information[np.ix_(kept, kept)], hermitian=True)
            centre = -covariance @ linear[kept] / 2
            yield kept, centre, none + float(linear[kept] @ centre) / 2, covariance
