"""Targets that refer to each other, absences, and the errors of both in a scenario."""

from __future__ import annotations

import numpy as np
import pytest

from irsim import InputError, loads
from irsim.render.frame import Renderer

HEAD = """
frames: 40
camera: {size: [64, 48], netd_mk: 0}
background: {kind: ground, spread_k: 0}
targets:
"""
JET = "  - {id: jet, shape: {kind: fighter}, path: {kind: straight, start: [10, 20], speed: 1.0}}\n"


def row(name: str, path: str, more: str = "") -> str:
    return f"  - {{id: {name}, shape: {{kind: point}}, path: {{{path}}}{more}}}\n"


def test_an_absent_target_is_neither_drawn_nor_in_the_truth() -> None:
    there = Renderer(loads(HEAD + JET))
    away = Renderer(loads(HEAD + JET.replace("}}\n", "}, absent: [[5, 14], [20, 20]]}\n")))
    empty = Renderer(loads(HEAD + JET, overrides=["without=[jet]"]))
    gone = [frame for frame in range(40) if not away.scene(frame)[1].targets]
    assert gone == [*range(5, 15), 20]
    np.testing.assert_array_equal(away.scene(8)[0], empty.scene(8)[0])
    np.testing.assert_array_equal(away.scene(15)[0], there.scene(15)[0])
    assert away.scene(15)[1] == there.scene(15)[1]


def test_one_that_refers_to_a_target_that_is_off_still_finds_its_way() -> None:
    text = HEAD + JET + row("shadow", "kind: follow, target: jet, lag_frames: 3, offset_px: [4, 5]")
    both, alone = Renderer(loads(text)), Renderer(loads(text, overrides=["without=[jet]"]))
    _, truth = alone.scene(9)
    assert [target.id for target in truth.targets] == ["shadow"]
    assert truth.targets[0].center == both.scene(9)[1].targets[1].center
    assert truth.targets[0].center == pytest.approx((10 + 6 + 4, 20 + 5))


@pytest.mark.parametrize(
    ("targets", "line"),
    [
        (JET + row("b", "kind: follow, target: jey"), "5:9: targets.b.path.target: there is no 'jey'"),
        (row("a", "kind: follow, target: a"), "targets.a.path.target: a refers to itself"),
        (
            row("a", "kind: follow, target: b") + row("b", "kind: crosses, target: a, at_frame: 3"),
            "targets.b.path.target: a, b refer to each other in a circle",
        ),
        (JET.replace("}}\n", "}, absent: [[9, 3]]}\n"), "absent.0: frame 3 is before frame 9"),
    ],
)
def test_what_cannot_be_is_one_line_with_its_place(targets: str, line: str) -> None:
    with pytest.raises(InputError) as caught:
        loads(HEAD + targets)
    assert line.split(": ", 1)[-1] in str(caught.value)
    assert str(caught.value).count("\n") == 0
