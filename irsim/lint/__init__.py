"""Lint: warnings about scenarios that are valid but doubtful, one file for each subject."""

from __future__ import annotations

from irsim.lint.registry import CHECKS, ineffective, lint

__all__ = ["CHECKS", "ineffective", "lint"]
