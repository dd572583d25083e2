"""How large each study is at each scale: fields of `Study` to replace."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

# 10,000 pictures of words: with batches of 64, as the paper's, and larger steps, the paper's networks need far fewer
# epochs than its 5,000 (98 tiles: 30 epochs of `tcn-paper+hungarian` read 99.9% of the letters), and ours fewer still.
_WORDS = {"batch": 64, "rate": 1e-3}
_OURS = {"epochs": 25, "least_steps": 0, "rate": 4e-3}

_QUICK: dict[str, dict[str, Any]] = {
    "scrabble": {
        "sizes": (6, 26, 50, 74, 98),
        "train": {
            "tcn-paper+hungarian": {**_WORDS, "epochs": 30},
            "sinkhorn-paper": {**_WORDS, "epochs": 30},
            "sinkhorn": _OURS,
        },
    },
}

_PAPER: dict[str, dict[str, Any]] = {
    # "repeated 20 times for models trained using different random seeds" (Sec. IV-A)
    "tower": {"seeds": 20},
    "tower-by-sequence": {"seeds": 20},
    # The paper says "increasing numbers"; ours go on to all that a split has to train on.
    "unseen": {"sizes": (25, 50, 100, 150, 200, 300, 400, 480), "seeds": 20},
    "variable": {
        "sizes": (50, 100, 200, 300, 400, 600, 800, 1000, 1300),
        "test": lambda _: {"variant": "heights"},
        "seeds": 20,
    },
    # 10,000 pictures to learn from and 5,000 to test; "an increasingly large subset of the full tile set" (Sec. IV-E)
    "scrabble": {
        "sizes": (*range(6, 97, 5), 98),
        "test": lambda n: {"tiles": n, "count": 5_000},
        "train": {"tcn-paper+hungarian": _WORDS, "sinkhorn-paper": _WORDS, "sinkhorn": _OURS},
    },
}

#: `quick` finishes within 15 minutes on two cores, a study; `paper` has the paper's sizes and seeds.
SCALES: Mapping[str, Mapping[str, Mapping[str, Any]]] = MappingProxyType({"quick": _QUICK, "paper": _PAPER})
