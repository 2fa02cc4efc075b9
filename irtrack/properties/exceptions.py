"""What shipped trackers are excused from, and why: tracker -> property -> reason."""

from __future__ import annotations

EXCEPTIONS: dict[str, dict[str, str]] = {
    "template": {"distractor": "it searches the whole frame, where a perfect like is as good as the target"},
}
