"""Planted trackers: each breaks one property and no other."""

from __future__ import annotations

import planted_contract as contract
import planted_following as following
import planted_honesty as honesty
import planted_pictures as pictures
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
    "shift": pictures.Rooted,
    "flip": pictures.Leans,
    "transpose": pictures.Wide,
    "offset": pictures.Absolute,
    "gain": pictures.Stretched,
    "polarity": pictures.Hot,
    "depth": pictures.Shallow,
    "distractor": pictures.Distracted,
    "follows": following.Lags,
    "rests": following.Creeps,
    "size": following.Swells,
    "start_place": following.Faithful,
    "start_size": following.Tailored,
    "duplicates": following.Stutters,
    "drops": following.Impatient,
    "reacquires": following.Resentful,
    "velocity": following.Backwards,
    "says_seen": honesty.Timid,
    "says_hidden": honesty.Proud,
    "says_gone": honesty.Stubborn,
    "says_empty": honesty.Ghosts,
    "score": honesty.Inverted,
    "nees": honesty.Certain,
    "noise": honesty.LovesNoise,
    "hiding": honesty.LovesHiding,
}
