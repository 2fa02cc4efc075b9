"""Ids in scenarios: what is used twice or not there is told at once, each where the user wrote it."""

from __future__ import annotations

from scenario_text import TEXT, errors_of


def test_several_ids_that_are_not_there_are_told_at_once() -> None:
    text = TEXT.replace("follow: jet", "follow: jat\nwithout: [jeet, far, fog]")
    assert [line.split("; ")[0] for line in errors_of(text)] == [
        "f.yaml:25:9: follow: there is no 'jat'",
        "f.yaml:26:11: without.0: there is no 'jeet'",
        "f.yaml:26:22: without.2: there is no 'fog'",
    ]


def test_ids_that_are_used_twice_and_those_that_are_not_there_are_told_at_once() -> None:
    third = "  - {id: jet, shape: {kind: point}, path: {kind: straight, start: [1, 1]}}\n"
    text = TEXT.replace("id: far", "id: jet").replace("occluders:\n", third + "occluders:\n")
    text = text.replace("follow: jet", "follow: jat")
    assert [line.split("; ")[0] for line in errors_of(text)] == [
        "f.yaml:20:9: targets.1.id: the id 'jet' is used twice, also by targets.0",
        "f.yaml:23:10: targets.2.id: the id 'jet' is used twice, also by targets.0",
        "f.yaml:26:9: follow: there is no 'jat'",
    ]


def test_an_id_that_the_preset_or_a_default_has_is_told_where_the_user_wrote_it() -> None:
    """The camera's parts come after the targets, but nobody wrote them."""
    noise = "  noise:" + TEXT.split("  noise:")[1].split("  motion:")[0]
    unwritten = TEXT.replace(noise, "")
    assert errors_of(unwritten.replace("id: far", "id: white")) == [
        "f.yaml:17:9: targets.white.id: the id 'white' is used twice, also by camera.noise of the defaults; "
        "allowed: each id once"
    ]
    preset = unwritten.replace("camera:\n", "camera:\n  preset: uncooled_lwir\n")
    assert errors_of(preset.replace("id: far", "id: level")) == [
        "f.yaml:18:9: targets.level.id: the id 'level' is used twice, also by camera.noise of the preset "
        "'uncooled_lwir'; allowed: each id once"
    ]
    assert errors_of(TEXT.replace("id: far", "id: flicker")) == [
        "f.yaml:9:23: camera.noise.flicker.id: the id 'flicker' is used twice, also by targets.flicker; "
        "allowed: each id once"
    ]


def test_an_id_that_two_parts_of_the_background_have_is_told_at_the_second() -> None:
    clouds = "frames: 3\nbackground:\n  kind: sky\n  clouds:\n    - {id: low}\n    - {id: low}\n"
    assert errors_of(clouds) == [
        "f.yaml:6:12: background.clouds.1.id: the id 'low' is used twice, also by background.clouds.0; "
        "allowed: each id once"
    ]


def test_unknown_keys_and_unknown_ids_are_told_at_once() -> None:
    text = TEXT.replace("netd_mk", "netd_k").replace("speed: 2", "sped: 2").replace("follow: jet", "follow: jat")
    assert [line.split("; ")[0] for line in errors_of(text)] == [
        "f.yaml:6:3: camera.netd_k: unknown key",
        "f.yaml:19:47: targets.jet.path.sped: unknown key",
        "f.yaml:25:9: follow: there is no 'jat'",
    ]


def test_ids_below_an_unknown_key_are_missed_by_nobody() -> None:
    """Who misspells `targets` has one thing to mend."""
    (line,) = errors_of(TEXT.replace("targets:", "target:"))
    assert line.startswith("f.yaml:16:1: target: unknown key; ")
