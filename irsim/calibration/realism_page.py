"""HTML page of a comparison with real clips: its table, and example patches side by side."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape

import cv2
import numpy as np

from irsim.calibration.patches import BURST, Patches
from irsim.calibration.realism_against import ClassRealism, interval_text

_ZOOM = 3
_GAP_PX = 4
_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:80rem;margin:2rem auto;padding:0 1rem}"
    "table{border-collapse:collapse}th,td{padding:.2rem .8rem;text-align:right;border-bottom:1px solid #ccc}"
    "th:first-child,td:first-child{text-align:left}img{max-width:100%;image-rendering:pixelated}"
)
_HEAD = (
    "AUC: .5 is a guess, 1 is always right. Intervals of 95 % by bootstrap over places and scenes. Real patches are "
)
_HEAD += "shown and used as they are."


def realism_page(found: Sequence[ClassRealism], title: str) -> str:
    """Return the page: figures of each class, then rows of real and of rendered patches, at one size and gain."""
    families = next((list(each.families) for each in found if each.families), [])
    names = ["class", "places", "scenes", "AUC", "real halves", "naive", "distance", *families]
    rows = "".join(
        f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in _cells(each, len(names)))}</tr>" for each in found
    )
    examples = "".join(_examples(each) for each in found)
    return (
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>{escape(title)}</title><style>{_STYLE}</style>"
        f"<h1>{escape(title)}</h1><p>{escape(_HEAD)}</p>"
        f"<table><tr>{''.join(f'<th>{escape(name)}</th>' for name in names)}</tr>{rows}</table>{examples}</html>\n"
    )


def _row(cells: Sequence[str]) -> str:
    return f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"


def _cells(each: ClassRealism, count: int) -> list[str]:
    head = [each.background, str(each.places), str(each.scenes)]
    if each.auc is None or each.floor is None or each.ceiling is None or each.families is None:
        return [*head, each.too_few or "", *[""] * (count - 4)]
    figures = [interval_text(value) for value in (each.auc, each.floor, each.ceiling)]
    return [*head, *figures, f"{each.distance:.2f}", *(interval_text(value) for value in each.families.values())]


def _examples(each: ClassRealism) -> str:
    if each.real is None or each.rendered is None:
        return ""
    rows = (("real", each.real), ("rendered", each.rendered))
    pictures = "".join(f"<p>{name}<br><img alt='{name} patches' src='{_image(patches)}'></p>" for name, patches in rows)
    return f"<h2>{escape(each.background)}</h2>{pictures}"


def _image(patches: Patches) -> str:
    """Return the middle frames of patches in a row, as the URL of a PNG."""
    gap = np.full((patches.shape[2], _GAP_PX), 255, np.uint8)
    row = np.hstack([part for patch in patches[:, BURST // 2] for part in (patch, gap)][:-1])
    _, data = cv2.imencode(".png", row.repeat(_ZOOM, axis=0).repeat(_ZOOM, axis=1))
    return f"data:image/png;base64,{b64encode(data.tobytes()).decode()}"
