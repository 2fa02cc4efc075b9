"""The report of a bench: one offline HTML file."""

from irtrack.report.page import page, write_report

__all__ = ["page", "write_report"]
