"""`neurosym demos` and `neurosym train`: write demonstrations, and train a prior on them."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from neurosym.commands import common
from neurosym.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from neurosym.language.demonstrations import Demonstrations
    from neurosym.language.problem import Problem
    from neurosym.planning.prior import Prior

#: Problems on which a trained prior is compared with none.
WORTH = 20


def demos(
    domain: common.DomainName,
    out: Annotated[Path, typer.Option(metavar="FILE", help="Where to write them: a file in .npz.")],
    recipe: Annotated[str, typer.Option(metavar="full|paper", help="Which labels.")] = "full",
    part: Annotated[str, typer.Option(metavar="train|test|all", help="Of which problems.")] = "train",
    split: common.Split = 0,
    pictures: common.PictureStyle = "clean",
    seed: Annotated[int, typer.Option(min=0, help="Of the pictures.")] = 0,
    option: common.FamilyOptions = None,
) -> None:
    """Write demonstrations of a domain: pictures, orders and shares of valid orders."""
    _check_suffix(out, ".npz")
    made = _demonstrations(domain, part, split, recipe, pictures, seed, common.family_options(option))
    made.save(out)
    m, views, height, width, _ = made.pictures.shape
    shares = "with" if made.marginals is not None else "without"
    sizes = f"{views} views of {height} x {width}"
    print(f"{out}: {m} demonstrations of {len(made.actions)} actions, {sizes}, {shares} shares of valid orders")


def train(
    domain: common.DomainName,
    prior: Annotated[str, typer.Option(metavar="Q", help="sinkhorn, tcn, sinkhorn-paper or tcn-paper.")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The weights: a file in .safetensors.")],
    demos_file: Annotated[
        Path | None, typer.Option("--demos", metavar="FILE", help="Demonstrations of your own; default the domain's.")
    ] = None,
    split: common.Split = 0,
    seed: Annotated[int, typer.Option(min=0, metavar="K", help="Of the pictures and the training.")] = 0,
    pictures: common.PictureStyle = "clean",
    epochs: Annotated[int | None, typer.Option(min=1, help="Default the recipe's.")] = None,
    encoder: Annotated[
        str | None, typer.Option(metavar="NAME", help="small (default) or paper, the paper's CNN.")
    ] = None,
    device: Annotated[str, typer.Option(help="cpu or cuda.")] = "cpu",
    option: common.FamilyOptions = None,
    held_out: Annotated[
        float, typer.Option(min=0.0, max=0.9, metavar="SHARE", help="Of the problems, kept from training and measured.")
    ] = 0.1,
    resume: Annotated[bool, typer.Option("--resume/--no-resume", help="Go on from a run that was killed.")] = True,
) -> None:
    """Train a prior, with early figures, and say what it saves; a run that was killed goes on where it was."""
    from neurosym.registry import load_domain, load_prior

    _check_suffix(out, ".safetensors")
    load_domain(domain)
    if demos_file is not None and (split or option or pictures != "clean"):
        raise InputError("Expected --split, --pictures and --option only without --demos, whose file has it all.")
    learner: Any = load_prior(prior, **({"encoder": encoder} if encoder else {}))
    if not (hasattr(learner, "fit") and hasattr(learner, "save")):
        raise InputError(f"Expected a prior that can be trained; {prior!r} cannot (it has no fit and save).")
    if demos_file is not None:
        from neurosym.language.demonstrations import Demonstrations

        given = Demonstrations.load(demos_file)
    else:
        recipe = getattr(learner, "labels", "full")
        given = _demonstrations(domain, "train", split, recipe, pictures, seed, common.family_options(option))
    checkpoint = out.with_suffix(".checkpoint")
    if checkpoint.exists():
        common.say(f"Going on from {checkpoint}." if resume else f"Starting over; {checkpoint} is replaced.")
    out.parent.mkdir(parents=True, exist_ok=True)
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_, **__: common.say(f"Note: {message}")
        settings = common.taken_by(learner.fit, {"settings": {"held_out": held_out}} if held_out else {})
        _fit(learner, given, seed=seed, epochs=epochs, device=device, checkpoint=checkpoint, resume=resume, **settings)
    made_here = {"split": split, "pictures": pictures, "seed": seed, **common.family_options(option)}
    learner.save(out, notes=made_here if demos_file is None else {"file": demos_file.name})
    checkpoint.unlink(missing_ok=True)
    figures = learner.header.get("training", {}) if hasattr(learner, "header") else {}
    took = f" in {figures['seconds']:.1f} s" if "seconds" in figures else ""
    print(f"{out}: {prior}, trained on {len(given)} demonstrations{took}, {out.stat().st_size / 1024:.0f} KiB")
    problems = load_domain(domain).problems("test", split=split, **common.family_options(option))[:WORTH]
    common.say(worth(learner, problems))


def worth(prior: Prior, problems: Sequence[Problem]) -> str:
    """Refusals with a prior and without one, on problems that it was not trained on, in a sentence that warns."""
    from neurosym.pipeline import solve
    from neurosym.planning.budget import Budget

    try:
        results = [[solve(p, prior=q, rng=0, budget=Budget(attempts=1000)) for p in problems] for q in (None, prior)]
    except InputError as error:  # of other actions, or without pictures
        return f"Note: what the prior saves was not measured: {error}"
    without, guided = (sum(r.iterations for r in some) / max(len(some), 1) for some in results)
    solved = [sum(r.solved for r in some) for some in results]
    figures = f"{guided:.2f} refusals a plan, without a prior {without:.2f}"
    saved = f"On {len(problems)} problems kept from training: {figures}"
    if guided > without or solved[1] < solved[0]:
        lost = f" ({solved[1]} are solved, without a prior {solved[0]})" if solved[1] < solved[0] else ""
        return f"Warning: this prior makes planning worse. {saved}{lost}. Train longer, or on more demonstrations."
    return f"{saved}: {without - guided:.2f} saved."


def _fit(learner: Any, given: Demonstrations, **options: Any) -> None:
    with common.progress_bars(transient=False) as bars:
        task = bars.add_task("the first epoch", total=None)

        def show(now: Any) -> None:
            held = "" if now.held_out_loss is None else f", held out {now.held_out_loss:.4f}"
            if now.held_out_whole_order_accuracy is not None:
                held += f" ({100 * now.held_out_whole_order_accuracy:.0f}% of orders right)"
            text = f"loss {now.train_loss:.4f}{held}"
            bars.update(task, completed=now.epoch, total=now.epochs, description=text)
            # Where there is no terminal, a line at every tenth of the way.
            if bars.disable and (now.epoch * 10) // now.epochs > ((now.epoch - 1) * 10) // now.epochs:
                common.say(f"epoch {now.epoch}/{now.epochs}: {text}")

        learner.fit(given, progress=show, **options)


def _demonstrations(
    domain: str, part: str, split: int, recipe: str, pictures: common.Style, seed: int, options: dict[str, Any]
) -> Demonstrations:
    from neurosym.registry import load_domain

    family = load_domain(domain)
    strange = sorted(set(options) - set(common.taken_by(family.demonstrations, options)))
    if strange:
        raise InputError(f"Expected options that demonstrations of {domain!r} take; got {', '.join(strange)}.")
    with common.progress_bar("demonstrations") as progress:
        return family.demonstrations(
            part, split=split, recipe=recipe, style=pictures, seed=seed, progress=progress, **options
        )


def _check_suffix(path: Path, suffix: str) -> None:
    """Said before the work, not after it."""
    if path.suffix != suffix:
        raise InputError(f"Expected a file name that ends in {suffix}; got {path.name!r}.")
