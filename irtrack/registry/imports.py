"""Files that a module imports, directly or not; the code hash of a tracker covers them."""

from __future__ import annotations

import ast
import importlib
import importlib.util
import sys
from functools import cache
from importlib.machinery import ModuleSpec
from pathlib import Path

import irsim._native

_KERNELS = "irtrack._native"
"""Package of the C kernels, whose source files enter the hash, compiled or not."""


def with_imports(path: Path, module: str) -> set[Path]:
    """Return the files that make up the hash of a tracker: its own, and those that it imports, directly or not."""
    found = {path}
    waiting = [(path, module)]
    while waiting:
        path, module = waiting.pop()
        if path.suffix != ".py":
            continue
        package = module if path.name == "__init__.py" else module.rpartition(".")[0]
        for name in _imports(path.read_bytes(), package):
            file = counted_file(name, module)
            if file is not None and file not in found:
                found.add(file)
                waiting.append((file, name))
                if name == _KERNELS:
                    found.update(file.parent.glob("*.[ch]"))
                    found.update(Path(irsim._native.__file__).parent.glob("*.h"))
    return found


@cache
def _imports(source: bytes, package: str) -> tuple[str, ...]:
    """Return the names imported by a source text, to find the modules that enter the hash of a tracker."""
    found: list[str] = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package.split(".")[: 1 - node.level or None]) if node.level else ""
            origin = ".".join(part for part in (base, node.module) if part)
            found += [origin, *(f"{origin}.{alias.name}" for alias in node.names)]
    return tuple(found)


def counted_file(name: str, importer: str) -> Path | None:
    """Return the file of a module if it enters the hash of a tracker in module `importer`; None otherwise."""
    top = name.partition(".")[0]
    if top in sys.stdlib_module_names or top == "irsim":
        return None
    package = _spec(top)
    if package is None or (top not in ("irtrack", importer.partition(".")[0]) and _is_installed(package)):
        return None  # do not search its submodules, since the search would import it
    if name.startswith(f"{_KERNELS}."):
        return None  # its source file enters the hash, compiled here or not
    spec = package if name == top else _spec(name)
    if spec is None or spec.origin is None or not Path(spec.origin).is_file():
        return None
    return Path(spec.origin)


def _spec(name: str) -> ModuleSpec | None:
    """Return the import spec of a module, importing its parent packages; None where no such module exists."""
    parent = name.rpartition(".")[0]
    try:
        if parent and not hasattr(importlib.import_module(parent), "__path__"):
            return None  # `name` is defined in a module and is no module itself
        return importlib.util.find_spec(name)
    except Exception:  # an imported module need not exist, and may raise anything
        return None


def _is_installed(package: ModuleSpec) -> bool:
    """Return whether a package lies in a folder of pip (site-packages) or Debian (dist-packages)."""
    places = [*(package.submodule_search_locations or ()), package.origin or ""]
    return any(folder in Path(place).parts for place in places for folder in ("site-packages", "dist-packages"))
