"""`kalman`: a constant-velocity Kalman filter on one plain measurement of the target's place."""

from __future__ import annotations

from typing import ClassVar

from irtrack.trackers.place import PlacePart


class Kalman(PlacePart):
    """Constant-velocity Kalman filter, measured by a centroid in a gate, by correlation, or by mean shift.

    The baseline of J. Cheng et al. 2006, section 3 (their references 3, 4), which leave everything
    open but the name. Here: white-noise acceleration (Bar-Shalom et al. 2001, section 6.3.2), and
    three measurements to choose from, since what is measured decides how well the filter does: a
    centroid alone would be a straw man.
    """

    source: ClassVar[str] = "Cheng, Zhou, Cai, Yang 2006 (baseline); Bar-Shalom, Li, Kirubarajan 2001"
