"""Summary of the page as plain values, from which the documents take their numbers (FOLDER/sources.json)."""

from __future__ import annotations

import shutil
import subprocess
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from irtrack.metrics import CentreFigures
from irtrack.papers.experiment import Paper
from irtrack.papers.growth import GrowthResult
from irtrack.papers.points import PointResult
from irtrack.papers.tables import Row
from irtrack.papers.verdicts import Verdict

WORDS = ("held", "not held", "no difference", "not decidable")


def commit() -> str | None:
    """Return the git commit of the code that runs, with '+' where files differ from it; None without git."""
    git = shutil.which("git")
    if git is None:
        return None
    folder = Path(__file__).parent

    def output(*words: str) -> str:
        return subprocess.run([git, "-C", folder, *words], capture_output=True, text=True, check=False).stdout.strip()

    found = output("rev-parse", "--short=12", "HEAD")
    return found + "+" * bool(output("status", "--porcelain", "--untracked-files=no", "--", ".")) if found else None


def counts(paper: Paper | None, verdicts: Sequence[Verdict]) -> dict[str, int]:
    """Return the number of claims by verdict; claims that no run decides are not decidable."""
    found: Counter[str] = Counter(each.judgement.word for each in verdicts)
    if paper is not None:
        found.update(each.word for each in paper.derived)
        found["not decidable"] += len(paper.untested)
    return {word: found[word] for word in WORDS}


def rows_summary(rows: Sequence[Row]) -> dict[str, dict[str, Any]]:
    """Return the figures of each tracker of an experiment that has runs, by label."""
    return {row.label: _row(row) for row in rows if not row.absent}


def _row(row: Row) -> dict[str, Any]:
    def mean(of: CentreFigures | None, name: str) -> float | None:
        value = None if of is None else getattr(of, name)
        return None if value is None else round(value, 3)

    return {
        "runs": row.runs,
        "lost": row.lost,
        "off": None if row.off is None else round(row.off, 4),
        "bounded_px": None if row.bounded is None else round(row.bounded, 3),
        "conditional_abs_px": [mean(row.kept, "abs_x"), mean(row.kept, "abs_y")],
    }


def growth_summary(result: GrowthResult) -> dict[str, Any]:
    """Return RMSE, its standard error and mean Neff by filter and number of particles."""
    table = {
        label: {
            str(n): [round(float(value), 3) for value in (each.rmse.mean(), each.error, each.neff.mean())]
            for n, each in by_n.items()
        }
        for label, by_n in result.by_particles.items()
    }
    return {"runs": result.runs, "rmse_error_neff": table, "verdicts": counts(None, result.verdicts())}


def points_summary(result: PointResult) -> dict[str, Any]:
    """Return the number of runs, rows of worlds and filters, and verdicts."""
    return {"runs": result.runs, "rows": result.rows(), "verdicts": verdict_list(result.verdicts())}


def verdict_list(verdicts: Sequence[Verdict]) -> list[dict[str, Any]]:
    """Return claim, scene and verdict, with the interval of the difference where the rule is paired."""
    found = []
    for each in verdicts:
        row: dict[str, Any] = {"claim": each.text, "scene": each.scene, "rule": each.words}
        row |= {"verdict": each.judgement.word, "seeds": [each.judgement.yes, each.judgement.decided]}
        if (difference := each.judgement.difference) is not None:
            row["difference_px"] = [round(value, 3) for value in (difference.mean, difference.low, difference.high)]
        found.append(row)
    return found
