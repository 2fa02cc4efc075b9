"""The experiments of the papers, repeated: their figures and claims beside what comes out here."""

from irtrack.papers.page import write_sources

__all__ = ["write_sources"]
