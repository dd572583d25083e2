"""Conformance suites, for the authors of domains, planners and priors to run on their own plug-ins.

Each raises `ContractError` with what was expected and what came; nothing is returned.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
