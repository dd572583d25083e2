"""What is registered, in words, without loading it: learned priors would make whoever asks wait for their libraries."""

import ast
import importlib.util
import itertools
from importlib.metadata import EntryPoint
from pathlib import Path

from neurosym.errors import NeurosymError
from neurosym.planning.weights_header import read_header


def summary(entry: EntryPoint) -> str:
    """The first paragraph of the docstring of what an entry point names, read from its source; else where it is."""
    source = _source(entry.module)
    if source is None:
        return entry.value
    try:
        tree = ast.parse(source.read_text(encoding="utf-8"))
    except (OSError, ValueError, SyntaxError):
        return entry.value
    text = _docstring(tree, entry.attr)
    return " ".join(text.split("\n\n")[0].split()) if text else entry.value


def _docstring(tree: ast.Module, name: str) -> str | None:
    """Of a function or class, or the text that stands below an assignment."""
    for node, following in itertools.zip_longest(tree.body, tree.body[1:]):
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
            return ast.get_docstring(node)
        if isinstance(node, ast.Assign) and name in {getattr(target, "id", None) for target in node.targets}:
            text = getattr(getattr(following, "value", None), "value", None)
            return text if isinstance(text, str) else None
    return None


def weights_beside(entry: EntryPoint) -> dict[str, list[str]]:
    """Domain -> names of the priors with weights for it, in the folder ``weights`` of the package of an entry point."""
    source = _source(entry.module)
    found: dict[str, set[str]] = {}
    for path in () if source is None else sorted((source.parent / "weights").glob("*.safetensors")):
        try:
            header = read_header(path)
        except NeurosymError:
            continue  # not ours: whoever loads it is told
        found.setdefault(str(header.get("domain")), set()).add(str(header.get("prior")))
    return {domain: sorted(names) for domain, names in sorted(found.items())}


def _source(module: str) -> Path | None:
    try:
        spec = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        return None
    return None if spec is None or spec.origin is None or not spec.has_location else Path(spec.origin)
