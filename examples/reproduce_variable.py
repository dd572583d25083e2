"""The paper's third experiment: towers of two to six blocks, so a model must tell, too, where to stop.

It shows the share of whole colour sequences, and of right heights, against the number of demonstrations. The same as
`neurosym reproduce variable`; a run that was killed goes on where it was.

    python examples/reproduce_variable.py
"""

from pathlib import Path

from neurosym.experiments.imitation import Results, Study, reproduce_study, study


def main(given: Study, out: str = "out/reproduce-variable", **options) -> Results:
    found = reproduce_study(given, Path(out), say=print, **options)
    for n in given.sizes:
        for method in given.methods:
            right, height = (found.mean("hard", method, n, m) for m in ("whole_sequence", "stop_accuracy"))
            print(f"{n:>4} demonstrations, {method:<20}: {right:.2f} of them right, {height:.2f} of the heights")
    print(f"{out}: report.md, results.csv and figures")
    return found


if __name__ == "__main__":
    main(study("variable"), workers=None)  # as many processes as processors
