"""Data sets: clips of scenarios and recordings, split by scene and seed, in the formats of other programs, with a card.

A clip is one scene with one seed, or one recording. It belongs wholly to one split, as its frames are alike.
"""

from irsim.datasets.card import CARD
from irsim.datasets.export import export_dataset

__all__ = ["CARD", "export_dataset"]
