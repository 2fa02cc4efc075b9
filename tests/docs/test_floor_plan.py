"""The floor plan: docs/architecture.md says which room may import which, and the code does just that.

A room is a module or a package right inside irsim or irtrack. The tables of the document are read
as they stand, so the plan that people read is the plan that is checked.
"""

from __future__ import annotations

import ast
import importlib.metadata
import itertools
import re
import sys
import tomllib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType

import pytest

import irsim
import irtrack

ROOT = Path(__file__).parents[2]
PLAN = (ROOT / "docs" / "architecture.md").read_text()
PACKAGES = ("irsim", "irtrack")
SHARED = (
    *("compiled", "types", "rng", "quantities", "kinds", "errors", "lazy", "files", "cards", "interrupts", "signals"),
    *("terminal", "wording", "strategies"),
)
SHARED_ROOMS = {f"irsim.{room}" for room in SHARED}
LONG = 300


def table(title: str) -> list[list[str]]:
    """The rows of the table under a heading, without its head; code marks taken off."""
    section = re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", PLAN, re.M | re.S)
    assert section, f"docs/architecture.md has no section '{title}'"
    lines = [line for line in section[1].splitlines() if line.startswith("|")]
    return [[cell.strip().replace("`", "") for cell in line.strip("|").split("|")] for line in lines[2:]]


def words(cell: str) -> set[str]:
    return set(re.findall(r"[A-Za-z_0-9]+", cell))


def plan(package: str) -> dict[str, set[str]]:
    """Room -> rooms of its own package that it imports, from the lowest floor up."""
    return {row[0]: words(row[2]) for row in table(f"Rooms of {package}")}


def files(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def room_of(path: Path) -> str:
    """'irsim.motion' for irsim/motion/pan.py; 'irsim' for irsim/__init__.py."""
    package, *inner = path.relative_to(ROOT).with_suffix("").parts
    return package if inner == ["__init__"] else f"{package}.{inner[0]}"


@lru_cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(), str(path))


@dataclass(frozen=True)
class Import:
    """`from module import name`, or `import module` (name None), in a room; inside functions too."""

    place: str
    room: str
    module: str
    name: str | None

    def __str__(self) -> str:
        return f"{self.place}: {self.module} {self.name or ''}"

    @property
    def top(self) -> str:
        return self.module.split(".")[0]

    @property
    def reached(self) -> str:
        """The room: 'from irsim import rng' and 'import irsim.rng' both reach irsim.rng."""
        parts = [*self.module.split("."), *([self.name] if self.name else [])]
        package = ROOT / parts[0]
        if len(parts) > 1 and ((package / f"{parts[1]}.py").exists() or (package / parts[1]).is_dir()):
            return f"{parts[0]}.{parts[1]}"
        return parts[0]


@lru_cache
def imports(package: str) -> tuple[Import, ...]:
    return tuple(found for path in files(package) for found in imports_of(path))


def imports_of(path: Path) -> Iterator[Import]:
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            place = f"{path.relative_to(ROOT)}:{node.lineno}"
            for alias in node.names:
                if isinstance(node, ast.Import):
                    yield Import(place, room_of(path), alias.name, None)
                else:
                    assert node.level == 0, f"{place}: relative import; write it in full"
                    yield Import(place, room_of(path), node.module or "", alias.name)


@pytest.mark.sampled
@pytest.mark.parametrize("package", PACKAGES)
def test_rooms_import_what_the_plan_says(package: str) -> None:
    found: dict[str, set[str]] = {room_of(path): set() for path in files(package)}
    for item in imports(package):
        if item.top == package and item.reached != item.room:
            found[item.room].add(item.reached.removeprefix(f"{package}."))
    del found[package]  # the front door imports by name, lazily
    inner = {room.removeprefix(f"{package}."): reached for room, reached in found.items()}
    planned = plan(package)
    assert sorted(inner) == sorted(planned), "rooms in the code (left) and in docs/architecture.md (right)"
    for room, imported in inner.items():
        imported.discard(package)  # `from irsim import __version__`; another test forbids more
        only_code, only_plan = sorted(imported - planned[room]), sorted(planned[room] - imported)
        assert not only_code, f"{package}.{room} imports {only_code}, docs/architecture.md does not say so"
        assert not only_plan, f"{package}.{room} no longer imports {only_plan}, docs/architecture.md says so"


@pytest.mark.parametrize("package", PACKAGES)
def test_the_plan_goes_downwards(package: str) -> None:
    below: set[str] = set()
    for room, imported in plan(package).items():
        higher = sorted(imported - below)
        assert not higher, f"{package}.{room} imports {higher}, which does not stand above it in the table"
        below.add(room)


def test_irsim_does_not_know_irtrack() -> None:
    assert not [str(item) for item in imports("irsim") if item.top == "irtrack"]


@pytest.mark.parametrize("package", PACKAGES)
def test_inside_nobody_goes_through_the_front_door(package: str) -> None:
    """`import irsim` inside irsim would hide which room is meant."""
    through = [item for item in imports(package) if item.reached == package and item.name != "__version__"]
    assert not [str(item) for item in through]


def test_irtrack_uses_only_public_names_of_irsim() -> None:
    public = {None, "__version__", *irsim.__all__}
    guilty = [
        str(item)
        for item in imports("irtrack")
        if item.top == "irsim"
        and item.reached not in SHARED_ROOMS
        and not (item.module == "irsim" and item.name in public)
    ]
    assert not guilty


@pytest.mark.parametrize("package", [irsim, irtrack], ids=PACKAGES)
def test_public_names_exist(package: ModuleType) -> None:
    for name in package.__all__:
        assert getattr(package, name) is not None


def test_libraries_stay_in_their_rooms() -> None:
    allowed = {row[0]: set(re.findall(r"[a-z_]+\.[a-z_]+", row[1])) for row in table("Libraries that one room knows")}
    assert {"mcap", "matplotlib", "yaml"} <= set(allowed)
    both = (*imports("irsim"), *imports("irtrack"))
    assert not [str(item) for item in both if item.top in allowed and item.room not in allowed[item.top]]


def test_every_library_is_declared() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = (extra for name, extra in project["optional-dependencies"].items() if name != "dev")
    declared = [*project["dependencies"], *itertools.chain.from_iterable(extras)]
    names = {re.split(r"[<>=\[; ]", text)[0].lower() for text in declared}
    names.add("pydantic_core" if "pydantic" in names else "")  # pydantic pins its own core
    providers = importlib.metadata.packages_distributions()
    both = {item.top for package in PACKAGES for item in imports(package)}
    foreign = both - set(sys.stdlib_module_names) - set(PACKAGES)
    undeclared = {top for top in foreign if not names & {name.lower() for name in providers.get(top, [])}}
    assert not undeclared, "imported but not declared in pyproject.toml"


ADDRESSED = {"Generator", "BitGenerator", "SFC64", "SeedSequence"}
"""Names of numpy.random that hold no global state and draw nothing unseeded."""

RESEEDED = ("beginning.py", "seed")
"""Other people's trackers may draw from the global state, which workers, copies of one process, must not share."""


def dotted(node: ast.expr) -> str:
    if isinstance(node, ast.Attribute):
        return f"{dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else ""


@pytest.mark.sampled
@pytest.mark.parametrize("package", PACKAGES)
def test_randomness_is_addressed(package: str) -> None:
    """Nothing draws from a global state or from an unnamed seed: streams come from irsim.rng."""
    guilty = [
        str(item)
        for item in imports(package)
        if item.top in {"random", "secrets"} or (item.module == "numpy.random" and item.name not in ADDRESSED)
    ]
    for path in files(package):
        for node in ast.walk(tree(path)):
            name = dotted(node) if isinstance(node, ast.Attribute) else ""
            taken = re.fullmatch(r"(?:np|numpy)\.random\.(\w+)", name)
            if taken and taken[1] not in ADDRESSED and (path.name, taken[1]) != RESEEDED:
                guilty.append(f"{path.relative_to(ROOT)}: {name}")
    assert not guilty


def test_long_files_are_listed() -> None:
    for package in (*PACKAGES, "tests"):
        for path in files(package):
            lines = len(path.read_text().splitlines())
            if lines > LONG:
                warnings.warn(f"{path.relative_to(ROOT)} has {lines} lines, more than {LONG}", stacklevel=1)
