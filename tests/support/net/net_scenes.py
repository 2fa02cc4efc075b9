"""Captures of scenes, recordings, trackers and public names, through the Python interface and the commands."""

from __future__ import annotations

import csv
import inspect
import itertools
import json
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from mcap.reader import make_reader
from net_values import SCRATCH, Item, clean, command, digest, document, lasting, leaves, plain, summary

import irsim
import irtrack

LATER = 8
"""The frame that is captured besides the first."""
SMALL = ("camera.size=[96, 72]", "frames=12")
VARIANTS: dict[str, tuple[str, Sequence[str]]] = {
    **{
        f"agc_{name}": ("sky", [*SMALL, f"camera.agc={{{text}}}"])
        for name, text in {
            "plateau": "kind: plateau",
            "slow_plateau": "kind: plateau, plateau: 0.01, gain_limit: 1, time_constant_frames: 4",
            "slow_linear": "kind: linear, time_constant_frames: 3, tails: [0.01, 0.02]",
            "fixed": "kind: fixed, low: 100, high: 9000",
            "clahe": "kind: clahe",
            "unsharp": "kind: unsharp",
        }.items()
    },
    **{
        f"noise_{name}": ("ground", [*SMALL, f"camera.noise=[{{{text}}}]"])
        for name, text in {
            "pattern": "kind: fixed_pattern, redrawn: true",
            "rows": "kind: ar1, ratio: 2, rho: 0.9, over: row",
            "slow": "kind: ar1, ratio: 2, time_constant_s: 0.5",
            "noise_3d": "kind: noise_3d, t: 0.5, v: 0.4, h: 0.3, tv: 0.2, th: 0.2, vh: 1, tvh: 1",
            "drift": "kind: drift",
            "odd_even": "kind: odd_even",
            "bad_pixels": "kind: bad_pixels",
        }.items()
    },
    "electrons": (
        "sky",
        [*SMALL, "camera.detector={kind: electrons}", "camera.noise=[{kind: shot}, {kind: fixed_pattern}]"],
    ),
    "blooming": ("glare", [*SMALL, "camera.bloom={}"]),
    "slow_response": (
        "treeline",
        [*SMALL, "camera.time_constant_ms=20", "camera.smear={time_ms: 9}"],
    ),
    "falloff": ("treeline", [*SMALL, "camera.falloff={}"]),
    "uncooled": ("ground", [*SMALL, "camera={preset: uncooled_lwir, size: [96, 72]}"]),
    "optics": ("sky", [*SMALL, "camera.optics={f_number: 3, pitch_um: 12, defocus_px: 0.5}"]),
    "without": ("platform", ["camera.size=[96, 72]", "without=[platform.sway, oak, fixed_pattern]"]),
    "faults": ("decoys", [*SMALL, "camera.faults=[{kind: drop, frames: [2, 5]}, {kind: duplicate, frames: [7]}]"]),
    "seed": ("sea", [*SMALL, "seed=7"]),
}
"""Scenes of kinds that no shipped scenario has: an example and its overrides."""
RECORDED = {"sky": ("sky", SMALL), "electrons": VARIANTS["electrons"], "faults": VARIANTS["faults"]}
PLAIN = (str, int, float, tuple, type(None))
TRACKERS = ("grey_pf", "kalman", "template", "mean_shift", "change_kalman")


def example(name: str) -> str:
    return f"scenarios/examples/{name}.yaml"


def scene(path: str | Path, overrides: Sequence[str] = ()) -> Iterator[Item]:
    """Yield pictures, truth, moments and masks of a scenario."""
    scenario, source = irsim.load(path, overrides), irsim.open_source(path, overrides)
    last = min(LATER, len(source) - 1)
    for index in (0, last):
        yield f"display/{index}", lambda k=index: summary(source.frame(k, "display").image)
        yield f"counts/{index}", lambda k=index: summary(source.frame(k).image)
        yield f"truth/{index}", lambda k=index: digest(source.truth(k))
    yield "frames", lambda: digest([plain(each) for each in source.frames("display", 0, 3)])
    names = ("hash", "size", "bits", "rate_hz", "follow", "seed", "agc", "camera", "has_truth", "name")
    for name in names:
        yield f"source/{name}", partial(getattr, source, name)
    yield "source/length", len(source)
    yield (
        "dumps",
        lambda: digest([yaml.safe_load(clean(irsim.dumps(scenario, short=short))) for short in (True, False)]),
    )
    truth, (columns, rows) = source.truth(last), source.size
    targets = list(truth.targets) if truth else []
    x, y = targets[0].center if targets else (columns / 2, rows / 2)
    region = (int(np.clip(x - 12, 0, columns - 24)), int(np.clip(y - 12, 0, rows - 24)), 24, 24)
    moments = irsim.Moments(scenario)
    yield "mean", lambda: summary(moments.mean(last, region))
    yield "variance", lambda: summary(moments.variance(last, region))
    yield "variance_temporal", lambda: summary(moments.variance(last, region, fixed=False))
    for each in targets[:2]:
        yield f"contribution/{each.id}", partial(_contribution, moments, last, each.id, region)
    yield "masks", lambda: digest(next(irsim.masks(scenario, last, last + 1)))
    if scenario.severities:
        yield "severity_3", lambda: irsim.load(path, [*overrides, "severity=3"]).hash
    if scenario.vary:
        yield from variations(scenario)


def _contribution(moments: irsim.Moments, index: int, name: str, region: tuple[int, int, int, int]) -> list[str]:
    return [summary(moments.contribution(index, name, shift, region)) for shift in ((0.0, 0.0), (0.3, -1.2))]


def variations(scenario: irsim.Scenario) -> Iterator[Item]:
    space = irsim.variations(scenario)
    yield "vary/keys", [[(each.key, plain(each.benign), len(each.severities)) for each in space.knobs]]
    yield "vary/nuisances", [each.key for each in space.nuisances]
    yield "vary/at", lambda: space.at([0.3] * len(space.knobs))
    yield "vary/at_severities", lambda: space.at_severities([1] * len(space.knobs))
    yield "vary/draw", lambda: space.draw(5)
    yield "vary/sample", lambda: [[each.hash, each.seed] for each in irsim.sample(scenario, 3, seed=2, start=1)]


def container(path: Path) -> Iterator[Item]:
    """Yield topics, schemas, messages, attachments and metadata of an MCAP file, read without irsim."""
    with path.open("rb") as file:
        reader = make_reader(file)
        held = reader.get_summary()
        assert held is not None
        for channel in held.channels.values():
            of = held.schemas[channel.schema_id]
            messages = list(reader.iter_messages([channel.topic]))
            data = [[m.sequence, m.log_time, m.publish_time, digest(m.data)] for _, _, m in messages]
            kept = [of.name, of.encoding, digest(of.data), channel.message_encoding, channel.metadata, len(data)]
            yield f"topic{channel.topic}", [*kept, digest(data)]
        yield "chunks", [[each.compression, each.message_start_time] for each in held.chunk_indexes]
        for attachment in reader.iter_attachments():
            yield f"attachment/{attachment.name}", [attachment.media_type, digest(attachment.data)]
        for record in reader.iter_metadata():
            yield from ((f"metadata/{record.name}/{k}", v) for k, v in lasting(dict(record.metadata)).items())


def read(path: Path, stop: int | None = None) -> Iterator[Item]:
    """Yield frames, truths and facts of a recording, read by irsim."""
    recording = irsim.open_recording(path)
    yield "counts", lambda: digest([plain(each) for each in recording.frames(stop=stop)])
    yield "display", lambda: digest([plain(each) for each in recording.frames("display", stop=stop)])
    yield "frame_alone", lambda: summary(recording.frame(5, "display").image)
    yield "truths", lambda: digest([plain(each) for each in recording.truths()])
    facts = {key: value for key, value in lasting(recording.info()).items() if key != "hash"}
    yield from ((f"info/{key}", value) for key, value in facts.items())
    for name in ("targets", "follow", "camera", "agc", "has_truth", "seed"):
        yield f"source/{name}", partial(getattr, recording, name)


def rerendered(path: Path) -> list[Any]:
    """Return the frames that `irsim render RECORDING` renders again, and whether they are those in it."""
    again = SCRATCH / f"again-{path.name}"
    status, _, err = command("irsim", "render", path, "--frames", "2:6", "-o", again)
    if status:
        raise RuntimeError(err)
    images = [each.image for each in irsim.open_recording(again).frames()]
    kept = [each.image for each in irsim.open_recording(path).frames(start=2, stop=6)]
    return [digest(images), [bool(np.array_equal(a, b)) for a, b in zip(images, kept, strict=True)]]


def written(name: str) -> Iterator[Item]:
    """Record a scene, read it back twice: by the MCAP library and by irsim."""
    path = SCRATCH / f"{name}.mcap"
    example_name, overrides = RECORDED[name]
    irsim.record(irsim.open_source(example(example_name), overrides), path)
    yield from container(path)
    yield from read(path)
    yield "rerendered", lambda: rerendered(path)


def kept_recording(path: Path) -> Iterator[Item]:
    yield "hash", lambda: irsim.open_recording(path).hash
    yield from read(path, LATER)
    yield "rerendered", lambda: rerendered(path)


def imported() -> Iterator[Item]:
    """Import frames of an array with truth; put a target of a scenario before them."""
    frames = (np.arange(12 * 48 * 64).reshape(12, 48, 64) * 7919 % 4093).astype(np.uint16)
    np.save(SCRATCH / "footage.npy", frames)
    (SCRATCH / "truth.csv").write_text(
        "frame,x,y,w,h,id,cls\n0,10,12,5,4,a,car\n1,11,12,5,4,a,car\n2,,,,,a,\n3,13,12,5,4,a,car\n"
    )
    words = ("--truth", SCRATCH / "truth.csv", "--rate", 25, "--bits", 12, "--accuracy", 2, "--agc", "plateau")
    path = SCRATCH / "footage.mcap"
    yield "status", lambda: command("irsim", "import", SCRATCH / "footage.npy", *words, "-o", path)[0]
    yield from container(path)
    yield from read(path)
    sizes = ("camera.size=[64, 48]", "camera.bits=12", "camera.rate_hz=25", "frames=12")
    changes = [*sizes, f"background.file={path}", "targets.drone.path.points=[[10, 20], [50, 30]]"]
    hidden = ("mean", "variance", "variance_temporal")  # refused: the noise of a recording is not known
    yield from ((f"footage/{k}", v) for k, v in scene("scenarios/new/recording.yaml", changes) if k not in hidden)


def tracked(tracker: str, source: str) -> Iterator[Item]:
    """Run a tracker; yield its score and every field of its estimates."""
    scenario = irsim.load(source, ["frames=36"]) if source.endswith(".yaml") else source
    track = irtrack.run(tracker, scenario, seed=3)
    yield from leaves(lasting(plain(irtrack.score(track, scenario))), "score")
    yield "estimates", lambda: digest([plain(each) for each in track.estimates])
    yield "config", lambda: track.config
    yield "start", lambda: [track.target, track.start, plain(track.start_box), track.source_hash]


def track_file() -> Iterator[Item]:
    path = SCRATCH / "track.mcap"
    words = ("--seed", 2, "--csv", SCRATCH / "track.csv", "-o", path, "frames=20", "--json")
    yield from leaves(document("irtrack", "run", "kalman", example("sky"), *words), "json")
    yield from container(path)
    rows = list(csv.DictReader((SCRATCH / "track.csv").open()))
    yield "csv", lambda: [list(rows[0]), digest(lasting(list(map(dict, rows))))]
    yield "read_tracks", lambda: digest(lasting(plain(irsim.read_tracks(path))))


def benched() -> Iterator[Item]:
    """Bench two trackers into a results file; yield the table, the exported rows, a comparison and the report."""
    sources, trackers = (example("sky"), "scenarios/stress/occlusion.yaml"), "kalman,template"
    db = SCRATCH / "net.db"
    words = ("bench", *sources, "--trackers", trackers, "--seeds", 2, "--results", db, "frames=80", "--json")
    yield from leaves(document("irtrack", *words, "--json", apart=True), "bench")
    command("irtrack", "export", db, "-o", SCRATCH / "net.csv")
    for number, row in enumerate(csv.DictReader((SCRATCH / "net.csv").open())):
        yield f"export/{number}", list(lasting(dict(row)).items())
    compared = document("irtrack", "compare", "kalman", "template", "--results", db, "--json")
    yield from leaves(compared, "compare")
    command("irtrack", "report", db, "-o", SCRATCH / "net-report.json")
    yield from leaves(lasting(json.loads((SCRATCH / "net-report.json").read_text())), "report")


def judged(tracker: str) -> Iterator[Item]:
    for each in document("irtrack", "check", tracker, "--json", apart=True)["document"]["properties"]:
        yield each["property"], [each["verdict"], each["drawn"]]


def failures() -> Iterator[Item]:
    """Replay kept failures; compare golden figures."""
    for kept in irtrack.kept_failures("scenarios/regressions"):
        names = ("label", "tracker", "parameters", "input", "broken", "how", "limit_s", "fault")
        yield f"{kept}/note", {name: getattr(kept, name) for name in names}
        yield f"{kept}/changes", lambda kept=kept: kept.changes()
    places = ("scenarios/regressions", "recordings/reference/golden-suite.yaml")
    yield from leaves(document("irtrack", "regress", *places, "--json", apart=True), "regress")


def falsified() -> Iterator[Item]:
    words = ["--tracker", "template", "--search", "sobol", "--budget", "6", "--fresh", "5", "--json", "-o"]
    changes = ("vary={camera.netd_mk: {kind: uniform, low: 40, high: 3000}}", "frames=40")
    scene_file = "scenarios/stress/noise.yaml"
    yield from leaves(document("irtrack", "falsify", scene_file, *changes, *words, SCRATCH / "found", apart=True))


def drawn(*words: str) -> Iterator[Item]:
    """Yield the pictures that a command writes, by file name."""
    folder = SCRATCH / "-".join(words[:2]).replace("/", "-")
    single = words[0] == "show"
    output = folder.with_suffix(".png") if single else folder
    yield "status", command("irsim", *words, "-o", output)[0]
    for path in [output] if single else sorted(folder.iterdir()):
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        yield path.name, summary(np.asarray(image))


def public(package: Any) -> Iterator[Item]:
    """Yield public names: parameters of functions, fields and members of classes."""
    for name in package.__all__:
        value = getattr(package, name)
        if callable(value) and not (name in ("Scenario", "Source", "Tracker") or name.endswith("Error")):
            yield name, partial(_parameters, value)
        if inspect.isclass(value) and name != "Scenario":
            members = (each for each in dir(value) if not each.startswith(("_", "model_")))
            yield from ((f"{name}.{each}", "member") for each in members if not hasattr(Exception, each))


def _parameters(value: Any) -> list[list[str]]:
    parameters = inspect.signature(value).parameters.values()
    return [
        [each.name, each.kind.name, digest(each.default)[:6] if isinstance(each.default, PLAIN) else "object"]
        for each in parameters
    ]


def tasks(scenarios: Sequence[Path]) -> Iterator[tuple[str, Any]]:
    """Yield (key, task) of all captures of scenes, recordings and trackers."""
    yield "names/irsim", partial(public, irsim)
    yield "names/irtrack", partial(public, irtrack)
    for path in scenarios:
        yield f"scene/{path.parent.name}/{path.stem}", partial(scene, path)
    for name, (base, overrides) in VARIANTS.items():
        yield f"variant/{name}", partial(scene, example(base), overrides)
    for name in RECORDED:
        yield f"written/{name}", partial(written, name)
    yield "imported", imported
    for path in sorted(itertools.chain(*map(Path("recordings").rglob, ["*.mcap"]))):
        yield f"reference/{path.stem}", partial(kept_recording, path)
    for tracker in TRACKERS:
        for source in (example("sky"), "scenarios/sources/xue-ground.yaml", "recordings/reference/car.mcap"):
            yield f"track/{tracker}/{Path(source).stem}", partial(tracked, tracker, source)
    yield "track_file", track_file
    yield "bench", benched
    yield "check/template", partial(judged, "template")
    yield "failures", failures
    yield "falsify", falsified
    yield "drawn/show", partial(drawn, "show", example("sky"), *SMALL)
    yield "drawn/masks", partial(drawn, "masks", "scenarios/stress/occlusion.yaml", "--frames", "50:52")
