"""neurosym: plan in which order things go together or come apart.

Symbols say what an action needs and changes; geometry answers whether it is physically possible; a prior,
learned from pictures of finished work, says what to try first::

    import neurosym as ns

    problem = ns.load_domain("soma").problem(17)
    guided = ns.solve(problem, planner="best-first", prior="sinkhorn")
    print(guided.plan, guided.iterations)

Public names are resolved when first used: importing this package loads no heavy dependency.
"""

import lazy_loader

__getattr__, _, _names = lazy_loader.attach_stub(__name__, __file__)
__version__ = "0.2.0"
__all__ = [*_names, "__version__"]


def __dir__() -> list[str]:
    return __all__
