"""The layers of imports: docs/architecture.md numbers the rooms, and the code imports downwards only."""

from __future__ import annotations

import ast
import importlib.metadata
import itertools
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from graphlib import TopologicalSorter
from pathlib import Path
from types import ModuleType

import pytest

import irsim
import irtrack

ROOT = Path(__file__).parents[2]
PLAN = (ROOT / "docs" / "architecture.md").read_text()
PACKAGES = ("irsim", "irtrack")
SHARED = ("types", "errors", "rng", "notebook", "strategies", "_native", "config")
"""Rooms of irsim that irtrack may use beside irsim's public names."""
SHARED_MODULES = ("irsim.cli.terminal", "irsim.render.interrupts", "irsim.recording.output")
"""Single modules of irsim that irtrack may use too."""
ADDRESSED = {"Generator", "BitGenerator", "SFC64", "SeedSequence"}
"""Names of numpy.random that hold no global state."""


def table(title: str) -> list[list[str]]:
    """Return the rows of the table under a heading, without its head and without code marks."""
    section = re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", PLAN, re.M | re.S)
    assert section, f"docs/architecture.md has no section '{title}'"
    lines = [line for line in section[1].splitlines() if line.startswith("|")]
    return [[cell.strip().replace("`", "") for cell in line.strip("|").split("|")] for line in lines[2:]]


def layers(package: str) -> dict[str, int]:
    """Return the layer of each room: 0 imports nothing but layer 0."""
    return {room: int(row[0]) for row in table(f"Rooms of {package}") for room in re.findall(r"\w+", row[1])}


def files(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


@dataclass(frozen=True)
class Import:
    """`from module import name`, or `import module` (name None)."""

    place: str
    source: str
    module: str
    name: str | None
    at_top: bool

    def __str__(self) -> str:
        return f"{self.place}: {self.module} {self.name or ''}"

    @property
    def top(self) -> str:
        return self.module.split(".")[0]

    @property
    def target(self) -> str:
        """Return the imported module: `from irsim import rng` imports irsim.rng."""
        inner = f"{self.module}.{self.name}"
        return inner if self.name and inner in modules() else self.module


@lru_cache
def modules() -> frozenset[str]:
    return frozenset(module_of(path) for package in PACKAGES for path in files(package))


@lru_cache
def imports(package: str) -> tuple[Import, ...]:
    return tuple(found for path in files(package) for found in imports_of(path))


def imports_of(path: Path) -> Iterator[Import]:
    tree = ast.parse(path.read_text(), str(path))
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            place = f"{path.relative_to(ROOT)}:{node.lineno}"
            for alias in node.names:
                if isinstance(node, ast.Import):
                    yield Import(place, module_of(path), alias.name, None, node in tree.body)
                else:
                    assert node.level == 0, f"{place}: relative import; write it in full"
                    yield Import(place, module_of(path), node.module or "", alias.name, node in tree.body)


def room(module: str) -> str:
    """Return 'motion' for irsim.motion.curves, '' for irsim itself."""
    return ".".join(module.split(".")[1:2])


@pytest.mark.parametrize("package", PACKAGES)
def test_the_plan_names_every_room(package: str) -> None:
    found = {room(module) for module in modules() if module.split(".")[0] == package} - {""}
    assert sorted(layers(package)) == sorted(found)


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_go_to_lower_layers(package: str) -> None:
    layer = layers(package)
    wrong = []
    for item in imports(package):
        here, there = room(item.source), room(item.target)
        if item.top == package and here and there and here != there:
            allowed = layer[there] < layer[here] or layer[here] == layer[there] == 0
            if not allowed:
                wrong.append(str(item))
    assert not wrong


@pytest.mark.parametrize("package", PACKAGES)
def test_no_circle_of_imports(package: str) -> None:
    graph: dict[str, set[str]] = {}
    for item in imports(package):
        if item.at_top and item.top == package and item.target not in {item.source, package}:
            graph.setdefault(item.source, set()).add(item.target)
    TopologicalSorter(graph).prepare()  # raises CycleError


def test_irsim_does_not_import_irtrack() -> None:
    assert not [str(item) for item in imports("irsim") if item.top == "irtrack"]


def test_irtrack_uses_public_names_of_irsim() -> None:
    public = {None, "__version__", *irsim.__all__}
    wrong = [
        str(item)
        for item in imports("irtrack")
        if item.top == "irsim"
        and room(item.target) not in SHARED
        and item.target not in SHARED_MODULES
        and not (item.module == "irsim" and item.name in public)
    ]
    assert not wrong


def test_only_the_command_line_imports_the_papers() -> None:
    rooms = {room(item.source) for item in imports("irtrack") if room(item.target) == "papers"} - {"papers"}
    assert rooms <= {"cli"}


@pytest.mark.parametrize("package", [irsim, irtrack], ids=PACKAGES)
def test_public_names_exist(package: ModuleType) -> None:
    for name in package.__all__:
        assert getattr(package, name) is not None


def test_libraries_stay_in_their_rooms() -> None:
    rows = table("Libraries in one room")
    allowed = {name: re.findall(r"[a-z_.]+", row[1]) for row in rows for name in re.findall(r"\w+", row[0])}
    assert {"mcap", "matplotlib", "yaml"} <= set(allowed)
    both = (*imports("irsim"), *imports("irtrack"))
    wrong = [item for item in both if item.top in allowed]
    wrong = [item for item in wrong if not any(f"{item.source}.".startswith(f"{each}.") for each in allowed[item.top])]
    assert not list(map(str, wrong))


def test_every_library_is_declared() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = (extra for name, extra in project["optional-dependencies"].items() if name != "dev")
    declared = [*project["dependencies"], *itertools.chain.from_iterable(extras)]
    names = {re.split(r"[<>=\[; ]", text)[0].lower() for text in declared}
    names.add("pydantic_core" if "pydantic" in names else "")  # pydantic pins its own core
    # Extras may not be installed where the tests run.
    providers = {"sklearn": ["scikit-learn"], **importlib.metadata.packages_distributions()}
    both = {item.top for package in PACKAGES for item in imports(package)}
    foreign = both - set(sys.stdlib_module_names) - set(PACKAGES)
    undeclared = {top for top in foreign if not names & {name.lower() for name in providers.get(top, [])}}
    assert not undeclared, "imported but not declared in pyproject.toml"


def dotted(node: ast.expr) -> str:
    if isinstance(node, ast.Attribute):
        return f"{dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


@pytest.mark.parametrize("package", PACKAGES)
def test_no_global_random_state(package: str) -> None:
    """Streams come from irsim.rng; only a worker seeds the global state, for other people's trackers."""
    wrong = [
        str(item)
        for item in imports(package)
        if item.top in {"random", "secrets"} or (item.module == "numpy.random" and item.name not in ADDRESSED)
    ]
    for path in files(package):
        for node in ast.walk(ast.parse(path.read_text())):
            taken = re.fullmatch(
                r"(?:np|numpy)\.random\.(\w+)", dotted(node) if isinstance(node, ast.Attribute) else ""
            )
            if taken and taken[1] not in ADDRESSED and (room(module_of(path)), taken[1]) != ("runner", "seed"):
                wrong.append(f"{path.relative_to(ROOT)}: {taken[0]}")
    assert not wrong
