"""The paper's last experiment: words of three to six tiles from a set that grows to 98.

It shows the share of letters, and of whole words, that each model has right, against the number of tiles. The same as
`neurosym reproduce scrabble`; a run that was killed goes on where it was.

    python examples/reproduce_scrabble.py
"""

from pathlib import Path

from neurosym.experiments.imitation import Results, Study, reproduce_study, study


def main(given: Study, out: str = "out/reproduce-scrabble", **options) -> Results:
    found = reproduce_study(given, Path(out), say=print, **options)
    for n in given.sizes:
        for method in given.methods:
            letters, words = (found.mean("easy", method, n, m) for m in ("per_step", "whole_sequence"))
            print(f"{n:>2} tiles, {method:<20}: {letters:.3f} of the letters right, {words:.3f} of the words")
    print(f"{out}: report.md, results.csv and figures")
    return found


if __name__ == "__main__":
    main(study("scrabble"), workers=None)  # as many processes as processors
