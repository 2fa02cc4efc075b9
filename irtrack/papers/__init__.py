"""Reproduced experiments of the papers: printed figures and claims beside the results of irtrack."""

from irtrack.papers.page import write_papers

__all__ = ["write_papers"]
