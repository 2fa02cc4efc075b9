"""Report of a results file: one offline HTML page, or the same figures as JSON, CSV or Markdown."""

from irtrack.report.figure_data import SeverityFigures, severity_figures
from irtrack.report.formats import severity_values
from irtrack.report.write import FORMATS, write_report

__all__ = ["FORMATS", "SeverityFigures", "severity_figures", "severity_values", "write_report"]
