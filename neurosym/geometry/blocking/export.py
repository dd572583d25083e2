"""An assembly as a graph, for other programs: what blocks what along which direction, and what touches what."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path

import networkx as nx

from neurosym.errors import InputError
from neurosym.geometry.blocking.graph import BlockingGraph
from neurosym.geometry.contact.contacts import TABLE, Contact, areas_between
from neurosym.geometry.step_motion import GROUND
from neurosym.support.files import write_text

#: Of the JSON file. Raise it when a reader of the old one would go wrong.
SCHEMA = 1


def assembly_graph(blocking: BlockingGraph, contacts: Iterable[Contact]) -> nx.MultiDiGraph:
    """Nodes are parts (``fixed``), and the ground where there is one (``ground``). Edges are of two kinds:

    * ``kind="blocks"``: the first, moved along ``direction`` (in words; its numbers are ``x``, ``y``, ``z``), hits the
      second.
    * ``kind="touches"``: a contact of so much ``area``, once a pair, and an edge either way is meant.
    """
    assembly = blocking.assembly
    graph = nx.MultiDiGraph(units=assembly.units or "")
    for name in assembly.names:
        graph.add_node(name, fixed=name in assembly.fixed, ground=False)
    if assembly.has_table:
        if GROUND in assembly.index:
            raise InputError(f"Expected no part of the name {GROUND!r}, which stands for the ground. Rename it.")
        graph.add_node(GROUND, fixed=True, ground=True)
    for d, (x, y, z) in enumerate(blocking.vectors):
        sentence = {"kind": "blocks", "direction": blocking.describe(d), "x": x, "y": y, "z": z}
        for part, mask in enumerate(blocking.by_part[d]):
            for other in assembly.in_mask(mask):
                graph.add_edge(assembly.names[part], other, **sentence)
            if blocking.into_table[d]:
                graph.add_edge(assembly.names[part], GROUND, **sentence)
    for (a, b), areas in areas_between(assembly, contacts).items():
        other = GROUND if b == TABLE else assembly.names[b]
        graph.add_edge(assembly.names[a], other, kind="touches", area=sum(areas))
    return graph


def write_graph(graph: nx.MultiDiGraph, path: Path) -> None:
    """Write a graph, whole or not at all: GraphML, DOT or JSON (networkx's node-link form), by the file's ending."""
    write = FORMATS.get(path.suffix.lower())
    if write is None:
        raise InputError(f"Expected a file that ends in {', '.join(FORMATS)}; got {path}.")
    write_text(path, write(graph))


def _graphml(graph: nx.MultiDiGraph) -> str:
    return "\n".join(nx.generate_graphml(graph)) + "\n"


def _json(graph: nx.MultiDiGraph) -> str:
    return json.dumps({"schema": SCHEMA, **nx.node_link_data(graph, edges="edges")}, indent=1) + "\n"


def _dot(graph: nx.MultiDiGraph) -> str:
    lines = ["digraph assembly {"]
    for name, facts in graph.nodes(data=True):
        lines.append(f"  {_quoted(name)} [shape={'box' if facts['fixed'] else 'ellipse'}];")
    for a, b, facts in graph.edges(data=True):
        if facts["kind"] == "blocks":
            look = f"label={_quoted(facts['direction'])}"
        else:
            look = f'dir=none, style=dashed, label="{facts["area"]:.4g}"'
        lines.append(f"  {_quoted(a)} -> {_quoted(b)} [{look}];")
    return "\n".join([*lines, "}"]) + "\n"


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


FORMATS: dict[str, Callable[[nx.MultiDiGraph], str]] = {".graphml": _graphml, ".dot": _dot, ".json": _json}
