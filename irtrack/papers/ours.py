"""Which trackers stand in the tables that compare: all of ours, those that go beyond their papers, and the peers."""

from __future__ import annotations

from irtrack.external import PEERS
from irtrack.registry.table import TRACKERS

OF_PAPERS = (
    "grey_pf",
    "cascade_pf",
    "product_pf",
    "mean_shift",
    "mean_shift_kalman",
    "mean_shift_pf",
    "background_restrained_pf",
    "template",
    "kalman",
    "ekf",
    "optical_flow",
    "camshift_kalman",
    "fusion_wspf",
    "svd_pf",
)
"""Trackers that a paper describes or compares with."""

BETTER = {name: name for name in TRACKERS if name not in OF_PAPERS}
"""The others: variants of no paper's making, which stand beside the papers' own for the goals that these may miss."""

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
