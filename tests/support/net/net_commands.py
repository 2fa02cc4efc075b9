"""Captures of the commands: help, schema, lint lines, exit statuses, calibration."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from net_values import SCRATCH, Item, Words, command, digest, document, leaves

DOUBTFUL: dict[str, Sequence[str]] = {
    "misspelt_key": ["camera.netd=3"],
    "misspelt_in_list": ["targets.jte.path.speed=3"],
    "below_limit": ["camera.netd_mk=-1"],
    "wrong_type": ["camera.rate_hz=fast"],
    "key_of_number": ["camera.bits.x=3"],
    "broken_yaml": ["camera.bits=[1"],
    "unknown_kind": ["targets.jet.path={kind: weav}"],
    "missing_key": ["targets.jet.path={kind: straight, start: [1, 2]}"],
    "foreign_code": ["background.kind=os:path"],
    "several_errors": ["camera.netd_mk=-1", "camera.bits=99", "camera.size=[3, 4]", "frames=0"],
    "unknown_without": ["without=[wite]"],
    "unknown_follow": ["follow=jat"],
    "unknown_band": ["camera.band=swir"],
    "no_severities": ["severity=2"],
    "twice_one_id": ["targets=[{id: a, shape: {kind: point}}, {id: a, shape: {kind: point}}]"],
    "bad_vary": ["vary={targets.jet.path.sped: {kind: uniform, low: 0, high: 1}}"],
    "bad_expect": ["expect=[{kind: error_below, px: -1}]"],
    "no_height": ["frames=1e9"],
    "outside_at_start": ["targets.jet.path={kind: straight, start: [-500, 30], speed: 0, range_m: 3000}"],
    "too_fast": ["targets.jet.path.speed=200"],
    "too_large": ["targets.jet.path.range_m=3"],
    "too_far": ["targets.jet.path.range_m=300000"],
    "range_cuts": ["camera.range_k=[283, 284]"],
    "noisy": ["camera.netd_mk=8000"],
    "unheeded_netd": ["camera.detector={kind: electrons}", "camera.netd_mk=80"],
    "saturated": ["camera.agc={kind: fixed, low: 0, high: 3}"],
    "dead_pixels": ["camera.noise=[{kind: bad_pixels, dead: 0.9}]"],
    "optics_coarse": ["camera.optics={f_number: 40, pitch_um: 2}"],
    "unlike": ["background={kind: sky, horizon_k: 260, zenith_k: 290}", "like=cloud"],
    "blurred": ["camera.psf_px=9"],
    "drop_all": ["camera.faults=[{kind: drop, rate: 1}]"],
}
"""Overrides of scenarios/examples/sky.yaml that are wrong or doubtful."""
TEXTS: dict[str, str] = {
    "tabs": "about: x\ncamera:\n\tbits: 8\n",
    "twice": "seed: 1\nseed: 2\n",
    "not_a_mapping": "- 1\n- 2\n",
    "empty": "",
    "unclosed": "camera: {bits: 8\n",
    "anchors": "camera: &c {bits: 8}\nbackground: *d\n",
    "misspelt_deep": "background: {kind: sky, horzon_k: 280}\ntargets:\n  - {id: a, shape: {kind: figter}}\n",
    "wrong_numbers": "frames: -3\ncamera: {size: [1, 2, 3], range_k: [300, 200]}\n",
    "control": "about: 'a\x07b'\n",
    "nothing_seen": "background: {kind: sky}\ncamera: {netd_mk: 0, noise: []}\n",
    "point_cold": "background: {kind: sky, horizon_k: 280, zenith_k: 279}\ntargets:\n  - id: p\n    shape: "
    "{kind: point, temperature_k: 280}\n    path: {kind: straight, start: [9, 9], speed: 0.1, range_m: 9000}\n",
    "severities_uneven": "severities: {camera.netd_mk: [1, 2], camera.bits: [8]}\ncamera: {netd_mk: 1, bits: 8}\n",
}
"""YAML texts that are wrong or doubtful."""
WRONG: dict[str, tuple[str, ...]] = {
    "no_command": ("irsim", "rendr"),
    "no_option": ("irsim", "show", "sky", "--frame", "3"),
    "no_scenario": ("irsim", "info", "nosuch"),
    "bad_number": ("irsim", "render", "sky", "--jobs", "0"),
    "bad_range": ("irsim", "show", "sky", "--frames", "9:3"),
    "bad_region": ("irsim", "noise", "sky", "--region", "1,2"),
    "no_argument": ("irtrack", "run"),
    "no_tracker": ("irtrack", "run", "kalmn", "sky"),
    "no_parameter": ("irtrack", "run", "kalman:gat=3", "sky"),
    "no_target": ("irtrack", "run", "kalman", "sky", "--target", "jat", "frames=5"),
    "no_property": ("irtrack", "check", "kalman", "--only", "determinstic"),
    "no_results": ("irtrack", "report", "nosuch.db"),
    "no_metric": ("irtrack", "bench", "sky", "--trackers", "kalman", "--severities", "9"),
}
_LINE = re.compile(r"^(?:(?P<place>\d+:\d+): )?(?P<rest>.*)$")


def lint_lines(file: str, text: str) -> Iterator[Item]:
    """Yield of each line of `irsim check` its place, key, severity, guess and whether it says what is allowed."""
    found = []
    for line in text.splitlines():
        matched = _LINE.match(line.removeprefix("irsim: ").removeprefix(f"{file}:").strip())
        assert matched is not None
        key, colon, _ = matched["rest"].partition(": ")
        guess = re.search(r"did you mean (\S+)\?", line)
        found.append(
            [
                matched["place"],
                key if colon and re.fullmatch(r"(override )?[\w.-]+", key) else None,
                "warning" if "warning: " in line else "error",
                "allowed:" in line,
                guess and guess[1],
            ]
        )
    yield "lines", found
    yield "text", Words(text)


def lint(path: Path, overrides: Sequence[str] = ()) -> Iterator[Item]:
    status, out, err = command("irsim", "check", path, *overrides)
    yield "status", status
    yield "ok", out.splitlines()
    yield from lint_lines(str(path), err)


def lint_text(name: str) -> Iterator[Item]:
    path = SCRATCH / f"{name}.yaml"
    path.write_text(TEXTS[name])
    status, _, err = command("irsim", "check", path)
    yield "status", status
    yield from lint_lines(path.name, err)


def wrong(name: str) -> Iterator[Item]:
    status, out, err = command(*WRONG[name])
    yield "status", [status, len(out.splitlines()), len(err.splitlines())]
    yield "text", Words(out + err)


def help_of(program: str, name: str = "") -> Iterator[Item]:
    """Yield each argument, option and sub-command of a `--help` with what stands in brackets; the rest as words."""
    status, out, _ = command(program, *filter(None, [name]), "--help")
    usage, *sections = re.split(r"\n\n(?=\S)|\n\n  (?=\S)", out)
    yield "usage", [status, " ".join(usage.split())]
    for section in sections:
        title, _, body = section.partition("\n")
        if title not in ("Arguments:", "Options:", "Commands:"):
            yield "about", Words(" ".join(section.split()))
            continue
        for number, entry in enumerate(re.split(r"\n(?=  \S)", body)):
            head, *more = entry.splitlines()
            term, _, text = head.strip().partition("  ")
            words = " ".join(" ".join([text, *more]).split())
            names = {"Arguments:": f"{number}", "Commands:": term, "Options:": (term + " ").partition(" ")[0]}
            if title == "Options:" and term.startswith("-o, "):
                names[title] = "--output"
            key = f"{title[:-2].lower()}/{names[title]}"
            yield key, [term if title != "Commands:" else "", *re.findall(r"\[[^\]]*\]", words)]
            yield f"{key}/text", Words(words)


def sub_commands(program: str) -> list[str]:
    return re.findall(r"(?m)^  (\w+)  ", command(program, "--help")[1].partition("Commands:")[2])


def schema() -> Iterator[Item]:
    """Yield keys of the JSON Schema by path, with types, limits, choices, defaults; no names of classes."""
    status, out, _ = command("irsim", "schema")
    whole = json.loads(out)
    yield "status", status
    yield from _keys(whole, whole, "", ())


def _keys(node: dict[str, Any], whole: dict[str, Any], path: str, above: tuple[str, ...]) -> Iterator[Item]:
    reference = node.get("$ref")
    if reference is not None:
        if reference in above:
            return
        node, above = whole["$defs"][reference.rpartition("/")[2]], (*above, reference)
    nested = ("$defs", "properties", "items", "anyOf", "oneOf", "allOf", "prefixItems", "additionalProperties")
    own = {k: v for k, v in node.items() if k not in (*nested, "description", "title", "markdownDescription")}
    own |= {"open": False} if node.get("additionalProperties") is False else {}
    yield path or "root", own if len(json.dumps(own)) < 200 else digest(own)
    for key, each in node.get("properties", {}).items():
        yield from _keys(each, whole, f"{path}.{key}" if path else key, above)
    for word in ("anyOf", "oneOf", "allOf", "prefixItems"):
        for index, each in enumerate(node.get(word, ())):
            kind = each.get("if", {}).get("properties", {}).get("kind", {}).get("const")
            yield from _keys(each.get("then", each), whole, f"{path}{{{kind or index}}}", above)
    for word in ("items", "additionalProperties"):
        if isinstance(node.get(word), dict):
            yield from _keys(node[word], whole, f"{path}{{{word}}}", above)


def calibration(*words: str) -> Iterator[Item]:
    """Yield the figures of `irsim noise|fit|realism` of a rendered clip that stands still."""
    clip = SCRATCH / "clip.mcap"
    if not clip.exists():
        changes = ("frames=48", "camera.size=[96, 72]", "camera.motion=[]", "background.clouds.near.wind_mrad_s=[0, 0]")
        command("irsim", "render", "scenarios/examples/sky.yaml", *changes, "without=[jet]", "-o", clip)
    found = document("irsim", *words[:1], clip, *words[1:], "--json")
    for key, value in leaves(found):
        yield key, Words(str(value)) if "notes" in key or "unknown" in key else value


def info(source: str) -> Iterator[Item]:
    """Yield the numbers of `irsim info`; its sentences as words."""
    status, out, err = command("irsim", "info", source)
    out = re.sub(r"(?m)^(file|source|file hash) .*\n", "", out)
    yield "numbers", [status, *re.findall(r"\d[\d.]*", out)]
    yield "text", Words(out + err)


def tasks(scenarios: Sequence[Path]) -> Iterator[tuple[str, Any]]:
    """Yield (key, task) of all captures of commands."""
    for program in ("irsim", "irtrack"):
        yield f"help/{program}", partial(help_of, program)
        for name in sub_commands(program):
            yield f"help/{program}/{name}", partial(help_of, program, name)
    yield "schema", schema
    for path in scenarios:
        yield f"lint/{path.parent.name}/{path.stem}", partial(lint, path)
    for name, overrides in DOUBTFUL.items():
        yield f"doubt/{name}", partial(lint, Path("scenarios/examples/sky.yaml"), overrides)
    for name in TEXTS:
        yield f"text/{name}", partial(lint_text, name)
    for name in WRONG:
        yield f"wrong/{name}", partial(wrong, name)
    for words in (
        ("noise",),
        ("noise", "--region", "10,10,40,40"),
        ("fit",),
        ("realism",),
        ("realism", "--like", "cloud"),
    ):
        yield f"calibration/{'_'.join(words).replace('--', '')}", partial(calibration, *words)
    for source in ("examples/hiding.yaml", "examples/swarm.yaml"):
        yield f"info/{source}", partial(info, f"scenarios/{source}")
    yield "info/drone", partial(info, "recordings/reference/drone.mcap")
