# SPDX-License-Identifier: BSD-3-Clause
"""The files of the workspace, as the quality tests look at them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TOPS = ("src", "launch", "tests", "docs", ".ci")
PACKAGES = {path.parent.name: path.parent for path in sorted(ROOT.glob("src/*/package.xml"))} | {
    "fabric_bringup": ROOT / "launch",
    "fabric_tests": ROOT / "tests",
}
SHARED = {"arm_action", "camera_listener", "traffic"}
LEFT_OUT = {"__pycache__", ".hypothesis", ".pytest_cache", ".ruff_cache"}


def files(*suffixes: str, tops: tuple[str, ...] = TOPS) -> list[Path]:
    """Every file below the tops with one of these suffixes; all files if none is given."""
    found = [path for top in tops for path in sorted((ROOT / top).rglob("*")) if path.is_file()]
    return [
        path
        for path in found
        if not LEFT_OUT.intersection(path.parts) and (not suffixes or path.suffix in suffixes)
    ]


def is_node(path: Path) -> bool:
    """Nodes lie in a folder `nodes` or are named *_node; SHARED is the part they share."""
    return "nodes" in path.parts or path.stem.endswith("_node") or path.stem in SHARED


def core_modules(package: str) -> list[str]:
    """Dotted names of the importable modules of a package that are not nodes."""
    source = PACKAGES[package] / "src"
    names = []
    for path in sorted((source / package).rglob("*.py")):
        if not is_node(path) and not LEFT_OUT.intersection(path.parts):
            parts = path.relative_to(source).with_suffix("").parts
            names.append(".".join(parts[:-1] if parts[-1] == "__init__" else parts))
    return names


def imports(path: Path) -> Iterator[str]:
    """Dotted names that a Python file imports, wherever in the file."""
    for node in ast.walk(ast.parse(path.read_text(), str(path))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            yield node.module


def shown(path: Path) -> str:
    """The path as a reader of a failure wants it."""
    return str(path.relative_to(ROOT))
