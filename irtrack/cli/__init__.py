"""The command line of irtrack."""

from irtrack.cli.app import app, main

__all__ = ["app", "main"]
