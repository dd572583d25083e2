"""The paper's first experiment: from one picture, in which order was a tower of six blocks built?

It shows how often each model has the whole colour sequence right, and how often it takes a block twice. The same as
`neurosym reproduce tower`; a run that was killed goes on where it was.

    python examples/reproduce_tower.py
"""

from pathlib import Path

from neurosym.experiments.imitation import Results, Study, reproduce_study, study


def main(given: Study, out: str = "out/reproduce-tower", **options) -> Results:
    found = reproduce_study(given, Path(out), say=print, **options)
    for pictures in given.pictures:
        for method in given.methods:
            right, twice = (found.mean(pictures, method, given.sizes[-1], m) for m in ("whole_sequence", "re_use"))
            print(f"{pictures} pictures, {method:<20}: {right:.2f} of the towers right, {twice:.2f} use a block twice")
    print(f"{out}: report.md, results.csv and figures")
    return found


if __name__ == "__main__":
    main(study("tower"), workers=None)  # as many processes as processors
