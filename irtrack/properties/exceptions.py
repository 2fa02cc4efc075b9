"""What shipped trackers are excused from, and why: tracker -> property -> reason."""

from __future__ import annotations

EXCEPTIONS: dict[str, dict[str, str]] = {}
