"""The notebooks are true: each runs from its first cell to its last in an empty folder, and is kept without outputs."""

from __future__ import annotations

import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

from irtrack import Results

DOCS = Path(__file__).parents[2] / "docs"
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))
LONG = {"bench_and_report", "find_failures", "your_own_tracker"}
"""Each of these tracks dozens of scenes, as README.md, falsify.md and trackers.md do by the same functions."""


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=pytest.mark.slow if path.stem in LONG else ()) for path in NOTEBOOKS],
    ids=lambda path: path.stem,
)
def test_it_runs_and_shows_something(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    (tmp_path / "work").mkdir()
    notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]  # nbformat leaves it untyped
    NotebookClient(
        notebook, kernel_name="python3", timeout=300, resources={"metadata": {"path": str(tmp_path / "work")}}
    ).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert not [output.text for output in outputs if output.get("name") == "stderr"]
    shown = [output.data["text/html"] for output in outputs if "text/html" in output.get("data", {})]
    for path in (tmp_path / "work").rglob("*.db"):
        with Results(path) as results:
            assert {cell.status for cell in results.cells()} == {"ok"}
    assert len(shown) >= 2 or "<table" in shown[0]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_it_is_kept_without_outputs_and_found_from_the_documents(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]  # nbformat leaves it untyped
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert code
    assert not any(cell.outputs or cell.execution_count for cell in code)
    texts = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
    assert all((path.parent / link).exists() for link in re.findall(r"\]\((?!https?:)([^)#]+)\)", texts))
    assert f"(notebooks/{path.name})" in (DOCS / "report.md").read_text()
