"""The report of a bench: one offline HTML file, or the same figures as JSON, CSV or Markdown."""

from irtrack.report.write import FORMATS, write_report

__all__ = ["FORMATS", "write_report"]
