"""Priors learned from pictures of finished work: Sinkhorn, temporal and plain networks, and their training.

Importing this package loads nothing; names resolve on first use (PEP 562), so that a command which needs no
network does not wait for torch.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
