"""The house: no module needs, at run time, one that needs it. That rooms import downwards is a contract."""

import ast
from pathlib import Path

import networkx as nx
import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("neurosym", "domains", "planners", "learned_priors")
AT_THE_TOP = {"__init__", "cli", "errors", "pipeline", "registry"}


def imported_at_run_time(tree: ast.AST) -> set[str]:
    """Names that a module imports when it runs: at any depth of it, but not for types only."""
    names: set[str] = set()
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            waiting += node.orelse
            continue
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
        waiting += ast.iter_child_nodes(node)
    return names


def import_graph(sources: dict[str, str]) -> nx.DiGraph:
    """Module -> the modules among `sources` that it imports at run time."""
    graph = nx.DiGraph()
    graph.add_nodes_from(sources)
    for name, source in sources.items():
        wanted = imported_at_run_time(ast.parse(source)) & sources.keys() - {name}
        # A package's own module is imported with any of its modules; that binds nobody.
        graph.add_edges_from((name, other) for other in wanted if not name.startswith(f"{other}."))
    return graph


def circles(graph: nx.DiGraph) -> list[list[str]]:
    return [sorted(group) for group in nx.strongly_connected_components(graph) if len(group) > 1]


def product() -> dict[str, str]:
    sources = {}
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            if name != "neurosym":  # its public names are looked up when they are asked for
                sources[name] = path.read_text(encoding="utf-8")
    return sources


def test_a_circle_is_seen():
    looks_back = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from a import x\n"
    assert circles(import_graph({"a": "import b", "b": "import c", "c": "def f():\n    from a import x\n"}))
    assert not circles(import_graph({"a": "import b", "b": looks_back}))


def test_no_module_needs_one_that_needs_it():
    assert circles(import_graph(product())) == []


def test_only_the_flow_lies_at_the_top():
    assert {path.stem for path in (ROOT / "neurosym").glob("*.py")} == AT_THE_TOP


@pytest.mark.parametrize("room", sorted(p.parent.name for p in (ROOT / "neurosym").glob("*/__init__.py")))
def test_every_room_says_what_it_answers(room):
    assert ast.get_docstring(ast.parse((ROOT / "neurosym" / room / "__init__.py").read_text(encoding="utf-8")))


def test_modules_are_read_in_one_go():
    lengths = sorted(source.count("\n") for source in product().values())
    assert lengths[len(lengths) // 2] <= 125
    assert lengths[-1] <= 320
