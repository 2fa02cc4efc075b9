"""Trackers: one file a method, each a frozen `TrackerPart` with `init` and `step`; `irtrack.registry` names them."""
