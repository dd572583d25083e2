"""Does torch work here? `neurosym doctor` asks, through the entry point group ``neurosym.checks``."""

from neurosym.errors import MissingDependencyError


def torch_works() -> str:
    """Solve a small least-squares problem by gradient descent; returns one line about it, raises where it fails."""
    try:
        import torch
    except ModuleNotFoundError as error:
        raise MissingDependencyError.of("torch", "trained priors need", "learned") from error

    # A generator of our own: no global seed is touched.
    inputs = torch.randn(64, 3, generator=torch.Generator().manual_seed(0))
    truth = torch.tensor([1.0, -2.0, 0.5])
    weights = torch.zeros(3, requires_grad=True)
    optimizer = torch.optim.AdamW([weights], lr=0.1, weight_decay=0.0)
    for _ in range(200):
        optimizer.zero_grad()
        loss = (inputs @ weights - inputs @ truth).square().mean()
        loss.backward()  # type: ignore[no-untyped-call]
        optimizer.step()
    off = float((weights.detach() - truth).abs().max())
    if not off < 1e-2:
        raise RuntimeError(f"gradient descent missed a known answer by {off:g}")
    cuda = torch.cuda.get_device_name(0) if torch.cuda.is_available() else "no CUDA device"
    return f"gradients reach a known answer; {torch.get_num_threads()} threads, {cuda}"
