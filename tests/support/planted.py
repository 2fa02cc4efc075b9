"""Planted trackers: each breaks one property and no other."""

from __future__ import annotations

import planted_contract as contract
import planted_following as following
import planted_images as images
import planted_status as status
from sound_tracker import Sound

PLANTED: dict[str, type[Sound]] = {
    "legal": contract.Illegal,
    "deterministic": contract.Random,
    "final": contract.Rewrites,
    "elsewhere": contract.Hashes,
    "causal": contract.Peeks,
    "pure": contract.Counts,
    "resumes": contract.Forgets,
    "alone": contract.Shares,
    "gentle": contract.Scribbles,
    "layout": contract.Contiguous,
    "timeless": contract.Clock,
    "bounded": contract.Hoards,
    "shift": images.Rooted,
    "flip": images.Leans,
    "transpose": images.Wide,
    "offset": images.Absolute,
    "gain": images.Stretched,
    "polarity": images.Hot,
    "depth": images.Shallow,
    "distractor": images.Distracted,
    "follows": following.Lags,
    "rests": following.Creeps,
    "size": following.Swells,
    "start_place": following.Faithful,
    "start_size": following.Tailored,
    "duplicates": following.Stutters,
    "drops": following.Impatient,
    "reacquires": following.Resentful,
    "velocity": following.Backwards,
    "says_seen": status.Timid,
    "says_hidden": status.Proud,
    "says_gone": status.Stubborn,
    "says_empty": status.Ghosts,
    "score": status.Inverted,
    "nees": status.Certain,
    "noise": status.LovesNoise,
    "hiding": status.LovesHiding,
}
