"""The paper's second experiment: six blocks of six colours; of all 720 towers, how many must be demonstrated?

It shows the share of steps that each model has right on all 720, beside a memoriser that knows every tower it was
shown and guesses the others. The same as `neurosym reproduce unseen`; a run that was killed goes on where it was.

    python examples/reproduce_unseen.py
"""

from pathlib import Path

from neurosym.experiments.imitation import Results, Study, reproduce_study, study


def main(given: Study, out: str = "out/reproduce-unseen", **options) -> Results:
    found = reproduce_study(given, Path(out), say=print, **options)
    for n in given.sizes:
        shares = {m: found.mean("hard", m, n, "per_step") for m in (*given.methods, "memoriser")}
        print(f"{n} demonstrations: " + ", ".join(f"{method} {share:.2f}" for method, share in shares.items()))
    print(f"{out}: report.md, results.csv and figures")
    return found


if __name__ == "__main__":
    main(study("unseen"), workers=None)  # as many processes as processors
