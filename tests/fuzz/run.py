"""Fuzz for as long as is asked: python tests/fuzz/run.py [SECONDS] [SEED]. Ends with 1 where anything was wrong."""

from __future__ import annotations

import sys
import time

import documents
import verdicts


def main(seconds: float, seed: int) -> int:
    end = time.monotonic() + seconds
    wrong: list[object] = []
    broken = 0
    while not broken or time.monotonic() < end - seconds / 4:
        wrong += documents.run(200, seed + broken)
        broken += 200
        if broken >= 10_000:
            break
    outcome = verdicts.run(max(end - time.monotonic(), 1.0), seed)
    print(f"{broken:,} broken documents; " + ", ".join(f"{n:,} {what}" for what, n in sorted(outcome.asked.items())))
    wrong += outcome.wrong
    print(f"{len(wrong)} wrong, from seed {seed} on.", *wrong[:50], sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    given = [float(word) for word in sys.argv[1:]]
    sys.exit(main(given[0] if given else 60.0, int(given[1]) if len(given) > 1 else 0))
