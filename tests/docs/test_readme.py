"""The documents: their commands and code run, their links, names and generated parts are valid."""

from __future__ import annotations

import ast
import importlib.util
import inspect
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import ModuleType

import pytest
from ready_commands import ready_commands

import irsim
import irtrack

ROOT = Path(__file__).parents[2]
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
BY_DAY = {"README.md"}
"""Documents whose commands `make test` runs; `make validate` runs those of all."""
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.M | re.S)


def blocks(path: Path) -> list[tuple[str, str]]:
    """(language, text) of each fenced block; blocks marked `text` are not run."""
    return BLOCK.findall(path.read_text())


@pytest.fixture(scope="module")
def footage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with my_frames/ and my_truth.csv, which the README makes and other documents use."""
    folder = tmp_path_factory.mktemp("footage")
    (making,) = (text for language, text in blocks(ROOT / "README.md") if language == "python" and "my_truth" in text)
    subprocess.run([sys.executable, "-c", making], cwd=folder, check=True)
    return folder


@pytest.fixture(scope="module")
def commands() -> Iterator[str]:
    """PATH of commands that are already imported, so that they start quickly."""
    with ready_commands() as path:
        yield path


@pytest.mark.parametrize(
    "document",
    [pytest.param(path, id=path.name, marks=() if path.name in BY_DAY else pytest.mark.slow) for path in DOCUMENTS],
)
def test_commands_and_code_of_documents_run(document: Path, tmp_path: Path, commands: str, footage: Path) -> None:
    """All blocks of a document run in order, in one folder, without a warning. The README needs no other files."""
    if document.name != "README.md":
        shutil.copytree(footage, tmp_path, dirs_exist_ok=True)
    for language, text in blocks(document):
        if language in {"sh", "python"}:
            command = ["sh", "-e", "-c", text] if language == "sh" else [sys.executable, "-c", text]
            done = subprocess.run(
                command, cwd=tmp_path, env={**os.environ, "PATH": commands}, capture_output=True, text=True, check=False
            )
            assert done.returncode == 0, f"{document.name}:\n{text}\n{done.stdout}\n{done.stderr}"
            assert "Traceback" not in done.stderr
            assert "warning: " not in done.stderr


def quoted(path: Path) -> list[str]:
    """Return the texts between back quotes outside of blocks."""
    return re.findall(r"`([^`\n]+)`", re.sub(BLOCK, "", path.read_text()))


def test_calls_in_the_text_fit_their_signatures() -> None:
    """Calls between back quotes fit; statements stand in blocks."""
    for text in (text for path in DOCUMENTS for text in quoted(path)):
        with suppress(SyntaxError):  # no Python
            found = ast.parse(text)
            for called in calls(found, irsim) + calls(found, irtrack):
                assert isinstance(found.body[0], ast.Expr), f"a block would be run: {text}"
                bind(called)


def test_links_lead_to_files() -> None:
    for path in DOCUMENTS:
        links = re.findall(r"\]\((?!https?:)([^)#]+)\)", path.read_text())
        assert not [link for link in links if not (path.parent / link).exists()], path.name


def test_the_readme_lists_every_document() -> None:
    listed = set(re.findall(r"\]\((?:docs/)?([^)/]+\.md)\)", (ROOT / "README.md").read_text()))
    assert listed == {path.name for path in DOCUMENTS} - {"README.md"}


def test_make_targets_of_the_documents_exist() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.M))
    named = {name for path in DOCUMENTS for name in re.findall(r"make ([a-z-]+)(?=`|\s+#)", path.read_text())}
    assert {"demo", "test"} <= named <= targets


def load_generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("generate", ROOT / "docs" / "generate.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_generated_parts_are_up_to_date() -> None:
    generator = load_generator()
    documents = {path: path.read_text() for path in DOCUMENTS}
    assert "<!-- generated: scenario keys -->" in documents[ROOT / "docs" / "scenarios.md"]
    stale = [path.name for path, text in documents.items() if generator.generated(text) != text]
    assert not stale, "run `make docs`"


def resolved(name: str) -> object:
    """Return the object of a dotted name; modules on the way are imported."""
    found: object = importlib.import_module(name.partition(".")[0])
    for end in (match.start() for match in re.finditer(r"\.|$", name)):
        if "." in name[:end]:
            step = name[:end].rpartition(".")[2]
            found = getattr(found, step) if hasattr(found, step) else importlib.import_module(name[:end])
    return found


PUBLIC_MODULES = {"irsim.calibration", "irsim.strategies", "irtrack.metrics", "irtrack.points", "irtrack.trackers"}
"""Modules, and a group of entry points, that documents may name; other names are functions or classes."""

TRAX_PROPERTIES = {"irtrack.seed", "irtrack.time"}
"""Properties of a protocol: no names in Python."""


def test_names_of_the_packages_exist() -> None:
    """Names between back quotes; pages for developers name modules, too."""
    for path in DOCUMENTS:
        names = {
            name
            for text in quoted(path)
            for name in re.findall(r"(?<![\w/.-])(?:irsim|irtrack)(?:\.[A-Za-z]\w*)+", text)
            if not name.endswith((".db", ".html", ".json"))
        }
        inner = path.name in {"architecture.md", "CONTRIBUTING.md"}
        for name in names - TRAX_PROPERTIES:
            assert not isinstance(resolved(name), ModuleType) or inner or name in PUBLIC_MODULES, (path.name, name)


def test_documents_are_short() -> None:
    """40,500 words in all, a third of them in generated tables."""
    assert sum(len(path.read_text().split()) for path in DOCUMENTS) < 40_500


def test_pictures_are_small() -> None:
    pictures = list((ROOT / "docs" / "img").glob("*"))
    assert pictures
    assert not [path.name for path in pictures if path.suffix != ".png" or path.stat().st_size > 300_000]


@pytest.mark.parametrize("package", [irsim, irtrack], ids=["irsim", "irtrack"])
def test_example_of_a_package_fits_its_signatures(package: ModuleType) -> None:
    """Each public name in the docstring exists and takes the arguments given there."""
    _, _, code = (package.__doc__ or "").partition("\n\n")
    found = calls(ast.parse(code), package)
    assert len(found) >= 3
    for call in found:
        bind(call)


def calls(code: ast.Module, package: ModuleType) -> list[ast.Call]:
    """Return the calls of a package's names, such as `irsim.load(...)`."""
    return [
        each
        for each in ast.walk(code)
        if isinstance(each, ast.Call) and ast.unparse(each.func).startswith(f"{package.__name__}.")
    ]


def bind(call: ast.Call) -> None:
    """Raise TypeError where the function takes no such arguments."""
    called = resolved(ast.unparse(call.func))
    assert callable(called)
    inspect.signature(called).bind(*call.args, **{keyword.arg: None for keyword in call.keywords if keyword.arg})
