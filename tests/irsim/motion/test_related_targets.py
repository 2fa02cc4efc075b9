"""Targets that refer to each other, absent targets, and the errors of both."""

from __future__ import annotations

import numpy as np
import pytest

from irsim import InputError, loads
from irsim.render.frame import Renderer

HEAD = """
frames: 24
camera: {size: [64, 48], netd_mk: 0}
background: {kind: ground, spread_k: 0}
targets:
"""
JET = "  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [10, 20], speed: 1.0}}\n"


def row(name: str, path: str) -> str:
    return f"  - {{id: {name}, shape: {{kind: point}}, path: {{{path}}}}}\n"


def test_absent_target_is_neither_drawn_nor_in_truth() -> None:
    always = Renderer(loads(HEAD + JET))
    absent = Renderer(loads(HEAD + JET.replace("}}\n", "}, absent: [[5, 14], [20, 20]]}\n")))
    empty = Renderer(loads(HEAD + JET, overrides=["without=[jet]"]))
    assert [frame for frame in range(24) if not absent.scene(frame)[1].targets] == [*range(5, 15), 20]
    np.testing.assert_array_equal(absent.scene(8)[0], empty.scene(8)[0])
    np.testing.assert_array_equal(absent.scene(15)[0], always.scene(15)[0])
    assert absent.scene(15)[1] == always.scene(15)[1]


def test_disabled_target_can_still_be_followed() -> None:
    text = HEAD + JET + row("shadow", "kind: follow, target: jet, lag_frames: 3, offset_px: [4, 5]")
    both, alone = Renderer(loads(text)), Renderer(loads(text, overrides=["without=[jet]"]))
    (shadow,) = alone.scene(9)[1].targets
    assert shadow.id == "shadow"
    assert shadow.center == both.scene(9)[1].targets[1].center
    assert shadow.center == pytest.approx((10 + 6 + 4, 20 + 5))


CROSSES = "kind: crosses, target: jet, speed: 1, at_frame: "


@pytest.mark.parametrize(
    ("targets", "line"),
    [
        (JET + row("b", "kind: follow, target: jey"), "targets.b.path.target: there is no 'jey'"),
        (row("a", "kind: follow, target: a"), "targets.a.path.target: a refers to itself"),
        (
            row("a", "kind: follow, target: b") + row("b", "kind: crosses, target: a, at_frame: 3"),
            "targets.b.path.target: a, b refer to each other in a circle",
        ),
        (JET.replace("}}\n", "}, absent: [[9, 3]]}\n"), "absent.0: frame 3 is before frame 9"),
        (JET + row("b", f"{CROSSES}24"), "b.path.at_frame: there is no frame 24; allowed: 0 to 23"),
        (JET + row("b", f"{CROSSES}9, miss_px: 90"), "b.path.at_frame: b is outside the picture in frame 9"),
        (JET + row("b", f"{CROSSES}9, angle_deg: 0"), "angle_deg: at this speed and angle it never separates from jet"),
    ],
)
def test_impossible_relations_are_one_line(targets: str, line: str) -> None:
    with pytest.raises(InputError) as caught:
        loads(HEAD + targets)
    assert line in str(caught.value)
    assert str(caught.value).count("\n") == 0
