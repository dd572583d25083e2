"""Train a prior on pictures of some Soma cubes, and see whether it helps to take apart others.

It shows demonstrations, training, saving and loading, reading an order from pictures alone, and the figure that
counts: on how many cubes that were never shown does the predicted order bring something down?

    python examples/train_prior.py [--recipe paper|full] [--epochs 40] [--tested 40] [--out prior.safetensors]

The recipe `paper` learns from one order a cube (seconds); `full` from the shares of all valid orders in 48 poses
(a few minutes the first time, most of it taking pictures, which are kept).
"""

import argparse
import tempfile
from pathlib import Path

import neurosym as ns
from neurosym.experiments.baselines import order_fails


def main(recipe: str = "paper", epochs: int | None = 40, tested: int = 40, out: str | None = None) -> dict[str, float]:
    soma = ns.load_domain("soma")
    demonstrations = soma.demonstrations("train", recipe=recipe)
    prior = ns.load_prior("sinkhorn-paper" if recipe == "paper" else "sinkhorn")
    prior.fit(
        demonstrations,
        seed=0,
        epochs=epochs,
        progress=lambda p: p.epoch % 10 == 0 and print(f"epoch {p.epoch}/{p.epochs}: loss {p.train_loss:.4f}"),
    )
    with tempfile.TemporaryDirectory() as folder:
        weights = prior.save(out or Path(folder) / "prior.safetensors")
        prior = ns.load_prior(weights)

    problems = soma.observed(soma.problems("test")[:tested])
    print(f"from the pictures of {problems[0].name} alone: {' '.join(prior.read(problems[0].observation).names())}")

    failures = {}
    for name, asked in (("random", ns.load_prior("random")), ("trained", prior)):
        scores = asked.scores(problems)
        failed = [order_fails(p.ground(), s.order()) for p, s in zip(problems, scores)]
        failures[name] = sum(failed) / tested
        plans = [ns.solve(p, prior=s).iterations for p, s in zip(problems, scores)]
        print(f"{name:<8} first order collapses on {100 * failures[name]:.0f}% of {tested} unseen cubes;", end=" ")
        print(f"backtracking needs {sum(plans) / tested:.2f} iterations")
    return failures


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--recipe", default="paper", choices=["paper", "full"])
    options.add_argument("--epochs", type=int, default=40)
    options.add_argument("--tested", type=int, default=40)
    options.add_argument("--out", help="keep the weights here")
    given = options.parse_args()
    main(given.recipe, given.epochs, given.tested, given.out)
