"""Notebook display: small cards of HTML for scenarios, sources and tables, in any theme."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape

import cv2
import numpy as np

from irsim.errors import counted
from irsim.types import Box, Image, Source

PICTURE_PX = 320
"""Largest width of a displayed picture, px."""

SAVED_PX = 640
"""Largest width of a stored picture, px: notebooks stay small."""

LINE = "1px solid rgba(128, 128, 128, .4)"


def card(title: str, facts: Mapping[str, object], picture: str = "") -> str:
    """Return a card: a title, named facts, and a picture as markup on the right. Texts are escaped."""
    rows = "".join(
        f'<tr style="background: none"><th style="text-align: left; padding: 1px 12px 1px 0">{escape(name)}</th>'
        f'<td style="text-align: left; padding: 1px 0">{escape(str(value))}</td></tr>'
        for name, value in facts.items()
    )
    words = f'<div><b>{escape(title)}</b><table style="border: 0; margin: 6px 0 0">{rows}</table></div>'
    style = f"display: flex; flex-wrap: wrap; gap: 16px; padding: 10px 14px; border: {LINE}; border-radius: 6px"
    return f'<div style="{style}; width: fit-content">{words}{picture}</div>'


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a table; the first two columns are left-aligned, the others right. Texts are escaped."""

    def line(cells: Sequence[object], tag: str) -> str:
        sides = ["left" if column < 2 else "right" for column in range(len(cells))]
        return "".join(
            f'<{tag} style="text-align: {side}; padding: 2px 8px">{escape(str(cell))}</{tag}>'
            for side, cell in zip(sides, cells, strict=True)
        )

    body = "".join(f"<tr>{line(row, 'td')}</tr>" for row in rows)
    return f"<table><thead><tr>{line(head, 'th')}</tr></thead><tbody>{body}</tbody></table>"


def source_line(source: Source, truth: str) -> str:
    """Return a source on one line; `truth` describes its ground truth."""
    columns, rows = source.size
    facts = f"{counted(len(source), 'frame')} at {source.rate_hz:g} Hz, {columns} x {rows} px, {source.bits} bits"
    return f"{type(source).__name__}({source.file or source.name}: {facts}, {truth})"


def source_card(source: Source) -> str:
    """Return the card of a source: its facts, and its middle frame with the true boxes."""
    columns, rows = source.size
    length = len(source)
    index = length // 2
    truth = next(iter(source.truths(index, index + 1)), None) if source.has_truth and length else None
    seen = ", ".join(target.id for target in truth.targets) if truth else "none"
    facts: dict[str, object] = {
        "frames": f"{length} at {source.rate_hz:g} Hz, {columns} × {rows} px, {source.bits} bits",
        "truth": seen or "no target in the frame shown",
    }
    if source.seed is not None:
        facts["seed"] = source.seed
    if source.file is not None:
        facts["file"] = source.file
    if not length:
        return card(source.name, facts)
    boxes = [target.box for target in truth.targets] if truth else []
    return card(source.name, facts, framed(source.frame(index, "display").image, boxes, f"frame {index}"))


def framed(image: Image, boxes: Sequence[Box], caption: str) -> str:
    """Return a display picture (rows, cols) uint8 with boxes over it and a caption."""
    rows, cols = image.shape
    scale = min(1.0, SAVED_PX / cols)
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    saved = cv2.imencode(".jpg", np.ascontiguousarray(small), [cv2.IMWRITE_JPEG_QUALITY, 85])[1].tobytes()
    marks = "".join(
        f'<rect x="{box.left:.1f}" y="{box.top:.1f}" width="{box.w:.1f}" height="{box.h:.1f}" '
        'vector-effect="non-scaling-stroke"/>'
        for box in boxes
    )
    return (
        f'<figure style="margin: 0"><svg viewBox="-0.5 -0.5 {cols} {rows}" '
        f'style="display: block; width: {PICTURE_PX}px; max-width: 100%">'
        f'<image x="-0.5" y="-0.5" width="{cols}" height="{rows}" '
        f'href="data:image/jpeg;base64,{base64.b64encode(saved).decode()}"/>'
        f'<g fill="none" stroke="#e69f00" stroke-width="1.5">{marks}</g></svg>'
        f'<figcaption style="font-size: 85%; opacity: .7">{escape(caption)}</figcaption></figure>'
    )
