"""The documents are true: their commands run, their code runs, their links and generated parts hold."""

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
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.M | re.S)


def blocks(path: Path) -> list[tuple[str, str]]:
    """(language, text) of each fenced block; blocks marked `text` are not run."""
    return BLOCK.findall(path.read_text())


@pytest.fixture(scope="module")
def footage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what other documents take as the reader's own, my_frames/ and my_truth.csv: the README makes it."""
    folder = tmp_path_factory.mktemp("footage")
    (making,) = (text for language, text in blocks(ROOT / "README.md") if language == "python" and "my_truth" in text)
    subprocess.run([sys.executable, "-c", making], cwd=folder, check=True)
    return folder


@pytest.fixture(scope="module")
def commands() -> Iterator[str]:
    """PATH with which commands need not import anew what all of them do."""
    with ready_commands() as path:
        yield path


LONG = {"stress.md", "report.md", "properties.md", "tutorial.md", "calibration.md"}
"""Each of these tracks dozens of scenes, or fits displays: half a minute and more."""


@pytest.mark.sampled
@pytest.mark.parametrize(
    "document",
    [pytest.param(path, marks=pytest.mark.slow if path.name in LONG else ()) for path in DOCUMENTS],
    ids=lambda path: path.name,
)
def test_commands_and_code_of_the_documents_run(document: Path, tmp_path: Path, commands: str, footage: Path) -> None:
    """All blocks of a document in their order, in one folder, as a reader would go through it: nothing is warned of.

    The README makes all that it takes. `test_cli_irsim` runs the commands that were installed.
    """
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


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_what_is_not_in_a_block_and_thus_not_run_calls_what_there_is(document: Path) -> None:
    """In text, between back quotes, stand names and single calls whose arguments fit. Statements stand in blocks."""
    for text in re.findall(r"`([^`\n]+)`", re.sub(BLOCK, "", document.read_text())):
        with suppress(SyntaxError):  # no Python
            found = ast.parse(text)
            for called in calls(found, irsim) + calls(found, irtrack):
                assert isinstance(found.body[0], ast.Expr), f"a block would be run: {text}"
                bind(called)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_somewhere(document: Path) -> None:
    links = re.findall(r"\]\((?!https?:)([^)#]+)\)", document.read_text())
    assert not [link for link in links if not (document.parent / link).exists()]


def test_the_readme_lists_every_document() -> None:
    listed = set(re.findall(r"^\| \[[^]]+\]\((?:docs/)?([^)]+)\)", (ROOT / "README.md").read_text(), re.M))
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
    """What a dotted name stands for: attributes, and modules that nobody has imported yet."""
    found: object = importlib.import_module(name.partition(".")[0])
    for end in (match.start() for match in re.finditer(r"\.|$", name)):
        if "." in name[:end]:
            step = name[:end].rpartition(".")[2]
            found = getattr(found, step) if hasattr(found, step) else importlib.import_module(name[:end])
    return found


TOLD_AS_MODULES = {"irsim.calibration", "irsim.strategies", "irtrack.metrics", "irtrack.trackers"}
"""What readers are told of as a module or a group of entry points; any other name is a function or a class."""

TRAX_PROPERTIES = {"irtrack.seed", "irtrack.time"}
"""What goes along with pictures in a foreign protocol: no names in Python."""


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_names_of_the_packages_exist(path: Path) -> None:
    """In text, between back quotes; blocks of code are run. Who works on the code is told of modules, too."""
    quoted = re.findall(r"`([^`\n]+)`", re.sub(BLOCK, "", path.read_text()))
    names = {
        name
        for text in quoted
        for name in re.findall(r"(?<![\w/.-])(?:irsim|irtrack)(?:\.[A-Za-z]\w*)+", text)
        if not name.endswith((".db", ".html", ".json"))
    }
    inner = path.name in {"architecture.md", "CONTRIBUTING.md"}
    for name in names - TRAX_PROPERTIES:
        assert not isinstance(resolved(name), ModuleType) or inner or name in TOLD_AS_MODULES, name


def test_pictures_are_small() -> None:
    pictures = list((ROOT / "docs" / "img").glob("*"))
    assert pictures
    assert not [path.name for path in pictures if path.suffix != ".png" or path.stat().st_size > 300_000]


@pytest.mark.parametrize("package", [irsim, irtrack], ids=["irsim", "irtrack"])
def test_the_example_of_a_package_calls_what_there_is(package: ModuleType) -> None:
    """Each public name in the docstring exists and takes the arguments that it is given there."""
    _, _, code = (package.__doc__ or "").partition("\n\n")
    found = calls(ast.parse(code), package)
    assert len(found) >= 3
    for call in found:
        bind(call)


def calls(code: ast.Module, package: ModuleType) -> list[ast.Call]:
    """The calls of a package's names: `irsim.load(...)`, `irsim.calibration.measure_noise(...)`."""
    return [
        each
        for each in ast.walk(code)
        if isinstance(each, ast.Call) and ast.unparse(each.func).startswith(f"{package.__name__}.")
    ]


def bind(call: ast.Call) -> None:
    """TypeError where what is called takes no such arguments."""
    called = resolved(ast.unparse(call.func))
    assert callable(called)
    inspect.signature(called).bind(*call.args, **{keyword.arg: None for keyword in call.keywords if keyword.arg})
