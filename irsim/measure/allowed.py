"""How far a figure may go by variances that a likelihood allows, none of them below 0."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irsim.types import Floats

_LEAST = -1e-9
"""A variance that is no less, in its own standard errors, is 0 but for rounding."""


@dataclass(frozen=True)
class _Faces:
    """All choices of variances that are 0 by decree, F = 2^N; in units of their errors.

    centres     (F, N) the likeliest then
    lacks       (F,) what is lacking there
    covariances (F, N, N) of the others, 0 for those
    """

    centres: Floats
    lacks: Floats
    covariances: Floats


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
        here = float(function @ (self.variances * self._scale))
        within = self._faces.lacks <= room
        centres, left = self._faces.centres[within], room - self._faces.lacks[within]
        ways = self._faces.covariances[within] @ function
        steps = ways * np.sqrt(left / (ways @ function).clip(1e-300))[:, None]
        there = np.concatenate([centres - steps, centres + steps])
        found = there[(there >= _LEAST).all(axis=1)] @ function
        return float(found.min(initial=here)), float(found.max(initial=here))

    @cached_property
    def _scale(self) -> Floats:
        """(N,) by which variances are in units of their own errors: what walks and what stays differ by 10^12."""
        own = np.sqrt(np.diag(self.information))
        return np.where(own > 0, own, 1.0)

    @cached_property
    def _faces(self) -> _Faces:
        scale = self._scale
        variances, slopes = self.variances * scale, self.slopes / scale
        information = self.information / np.outer(scale, scale)
        linear = slopes - 2 * information @ variances
        none = float(variances @ information @ variances - slopes @ variances)
        kept = np.array(list(itertools.product((False, True), repeat=len(variances))))
        among = kept[:, :, None] & kept[:, None, :]
        covariances = np.linalg.pinv(np.where(among, information, 0.0), hermitian=True)
        centres = covariances @ linear / -2
        return _Faces(centres, none + centres @ linear / 2, covariances)
