"""How large each study is at each scale: fields of `Study` to replace."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

# 10,000 pictures of words: with batches of 64, as the paper's, and larger steps, the paper's networks need far fewer
# epochs than its 5,000 (98 tiles: 30 epochs of `tcn-paper+hungarian` read 99.9% of the letters).
_WORDS = {"batch": 64, "rate": 1e-3}
# A tower's picture is read better after more updates than 150 epochs of 200 demonstrations make: of the paper's recipes
# with the small encoder, `sinkhorn-paper` got 34% of hard towers right after 1,050 updates, 41% after 4,000.
_FIVE, _TWO, _OTHER_TWO = (
    {name: {"least_steps": 4_000} for name in names}
    for names in (
        ("bc", "bc+hungarian", "tcn-paper", "tcn-paper+hungarian", "sinkhorn-paper"),
        ("tcn-paper", "sinkhorn-paper"),
        ("tcn-paper+hungarian", "sinkhorn-paper"),
    )
)

_QUICK: dict[str, dict[str, Any]] = {
    "tower": {"train": _FIVE},
    "tower-by-sequence": {"train": _FIVE},
    "unseen": {"train": _TWO},
    "variable": {"train": _OTHER_TWO},
    "scrabble": {
        "sizes": (6, 26, 50, 74, 98),
        "train": {
            "tcn-paper+hungarian": {**_WORDS, "epochs": 30},
            # Five samples of 98 columns: an epoch takes four times as long, and the loss hardly falls after the tenth.
            "sinkhorn-paper": {**_WORDS, "epochs": 12},
        },
    },
}

_PAPER: dict[str, dict[str, Any]] = {
    # "repeated 20 times for models trained using different random seeds" (Sec. IV-A)
    "tower": {"seeds": 20, "train": _FIVE},
    "tower-by-sequence": {"seeds": 20, "train": _FIVE},
    # The paper says "increasing numbers"; ours go on to all that a split has to train on.
    "unseen": {"sizes": (25, 50, 100, 150, 200, 300, 400, 480), "seeds": 20, "train": _TWO},
    "variable": {
        "sizes": (50, 100, 200, 300, 400, 600, 800, 1000, 1300),
        "test": lambda _: {"variant": "heights"},
        "seeds": 20,
        "train": _OTHER_TWO,
    },
    # 10,000 pictures to learn from and 5,000 to test; "an increasingly large subset of the full tile set" (Sec. IV-E)
    "scrabble": {
        "sizes": (*range(6, 97, 5), 98),
        "test": lambda n: {"tiles": n, "count": 5_000},
        "train": {"tcn-paper+hungarian": _WORDS, "sinkhorn-paper": _WORDS},
    },
}

#: `quick` finishes within 15 minutes on two cores, a study; `paper` has the paper's sizes and seeds.
SCALES: Mapping[str, Mapping[str, Mapping[str, Any]]] = MappingProxyType({"quick": _QUICK, "paper": _PAPER})
