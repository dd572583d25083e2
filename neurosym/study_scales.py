"""How large each study is at each scale: fields of `Study` to replace."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

#: `quick` finishes within 15 minutes on two cores, a study; `paper` has the paper's sizes and seeds.
SCALES: Mapping[str, Mapping[str, Mapping[str, Any]]] = MappingProxyType({"quick": {}, "paper": {}})
