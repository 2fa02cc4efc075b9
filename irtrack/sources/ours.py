"""Which trackers stand in the tables that compare: all of ours, those that go beyond their papers, and the peers."""

from __future__ import annotations

from irtrack.peers import PEERS
from irtrack.trackers import TRACKERS

BETTER = {name: name for name in ("coasting_pf",)}
"""Variants of no paper's making, which stand beside the papers' own where these miss a goal."""

OURS = {name: name for name in TRACKERS} | {
    "template window": "template:window=20",
    "kalman ncc": "kalman:measurement=ncc",
    "kalman mean shift": "kalman:measurement=mean_shift",
}

CONTEXT = 3
THEIRS = {name: name for name in PEERS} | {f"{name} {CONTEXT}x": f"{name}:context={CONTEXT}" for name in PEERS}
"""The peers with the tight box, and with one of CONTEXT times its sides: tight boxes make some give up at once."""


def is_peer(spec: str) -> bool:
    """Whether a spec names a peer."""
    return spec.partition(":")[0] in PEERS
