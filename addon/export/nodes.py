"""Follows links of a shader node tree to the node that a value really comes from, through groups and reroutes."""

from collections.abc import Iterable
from typing import Any, NamedTuple, TypeAlias

import bpy

Node: TypeAlias = Any
"""A `bpy.types.Node`. What one has depends on its kind, which Blender's type stubs cannot tell."""
Socket: TypeAlias = Any
"""A `bpy.types.NodeSocket`, likewise."""
Path = tuple[Node, ...]
"""The group nodes one is inside of, outermost first."""


class End(NamedTuple):
    """Where the links into a socket end: at a node's output, or (node is None) at an unlinked input's own value."""

    node: Node | None
    socket: Socket
    path: Path


def node_tree(owner: Any) -> bpy.types.NodeTree | None:
    """The node tree that a material, world or light uses, or None. From 5.0 on a tree that is there is used."""
    used = bpy.app.version >= (5, 0) or owner.use_nodes
    return owner.node_tree if used else None


def output_node(tree: bpy.types.NodeTree, kind: str) -> Node | None:
    """The active node of a type such as 'OUTPUT_WORLD', or the first one, or None."""
    nodes = [node for node in tree.nodes if node.type == kind and not node.mute]
    return next((node for node in nodes if getattr(node, "is_active_output", False)), nodes[0] if nodes else None)


def follow(socket: Socket, path: Path = ()) -> End:
    """The end of the links into an input socket."""
    while socket.is_linked and not socket.is_output:
        link = socket.links[0]
        if link.is_muted or not link.is_valid:
            break
        onward = _through(link.from_node, link.from_socket, path)
        if onward is None:
            return End(link.from_node, link.from_socket, path)
        socket, path = onward
    return End(None, socket, path)


def _through(node: Node, output: Socket, path: Path) -> tuple[Socket, Path] | None:
    """The input that a node passes on to `output` unchanged, with the path it lies on; None for a real node."""
    if node.mute:
        passed = next((link.from_socket for link in node.internal_links if link.to_socket == output), None)
        return None if passed is None else (passed, path)
    if node.type == "REROUTE":
        return node.inputs[0], path
    if node.type == "GROUP" and node.node_tree is not None:
        inner = output_node(node.node_tree, "GROUP_OUTPUT")
        return None if inner is None else (_same(inner.inputs, output), (*path, node))
    if node.type == "GROUP_INPUT" and path:
        return _same(path[-1].inputs, output), path[:-1]
    return None


def _same(sockets: Iterable[Socket], wanted: Socket) -> Socket:
    """The socket with the identifier of `wanted`, which is how a group's outside and inside match."""
    return next(socket for socket in sockets if socket.identifier == wanted.identifier)


def constant(socket: Socket, path: Path = ()) -> Any | None:
    """The value that reaches an input if it is the same everywhere: a float or (r, g, b, a). None if it varies."""
    end = follow(socket, path)
    if end.node is None:
        return _plain(end.socket.default_value)
    if end.node.type in {"RGB", "VALUE"}:
        return _plain(end.socket.default_value)
    return None


def _plain(value: Any) -> Any:
    return value if isinstance(value, (int, float)) else tuple(value)


def as_float(value: Any) -> float:
    """A socket's value as a number; of a colour its luminance (Rec.709), as Blender converts."""
    if isinstance(value, (int, float)):
        return float(value)
    return 0.2126 * value[0] + 0.7152 * value[1] + 0.0722 * value[2]


def as_color(value: Any) -> tuple[float, float, float]:
    """A socket's value as a colour; of a number a grey, as Blender converts."""
    if isinstance(value, (int, float)):
        return (float(value),) * 3
    return (float(value[0]), float(value[1]), float(value[2]))
