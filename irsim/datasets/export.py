"""Export of a data set: clips rendered or read, labelled, and written by one process or several."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from pathlib import Path

import cv2

from irsim.config.paths import path_of
from irsim.datasets.card import Card, Written
from irsim.datasets.plan import (
    MIN_VISIBLE,
    Job,
    Settings,
    checked_fraction,
    checked_input,
    mask_rendering,
    opened_clips,
    planned_jobs,
)
from irsim.datasets.splits import split_names
from irsim.errors import InputError, IrsimError, counted, whole_number
from irsim.recording.formats import WRITERS, dataset_format
from irsim.recording.formats.base import LabelledFrame, touches
from irsim.recording.formats.folder import DatasetFolder
from irsim.recording.output import make_folder
from irsim.render.frame import Renderer
from irsim.render.interrupts import end_with_parent, ignore_interrupts
from irsim.render.masks import visible_pixels
from irsim.render.stream import Rendering
from irsim.types import Bools, Input, TargetTruth


def export_dataset(
    sources: Sequence[str | Path],
    out: str | Path,
    format: str,
    seeds: int | None = None,
    split: Sequence[float] | None = None,
    min_visible: float = MIN_VISIBLE,
    jobs: int = 1,
    input: Input | None = None,
    overrides: Sequence[str] = (),
    command: str = "",
    progress: Callable[[int, int], None] | None = None,
    frames: int | None = None,
) -> Path:
    """Write a data set into a new or empty folder and return the folder.

    sources      scenarios, recordings and suites, by file or shipped name
    format       a key of `recording.formats.WRITERS`
    seeds        scenes with seeds 0 .. seeds-1; default: the scenario's seed, and for a suite its number of seeds
    split        shares of clips for train, val and test, which add up to 1; default: no split
    min_visible  least visible fraction of a labelled target. Wholly hidden targets, and those outside the picture, have
                 no labels
    jobs         number of processes, each of which writes whole clips
    input        display or counts; default: the first that the format has
    overrides    overrides of all scenarios, such as "camera.netd_mk=80"
    command      command line for the card
    progress     called with the number of frames done and that of all
    frames       largest number of frames of a clip; default: all

    Raises InputError for wrong input before anything is written, and where a file cannot be written: the card then
    lists the clips that are whole.
    """
    root = path_of(out)
    writer = dataset_format(format)
    most = None if frames is None else whole_number("frames", frames, 1)
    settings = Settings(root, format, checked_input(input, format), checked_fraction(min_visible), most)
    opened = opened_clips(sources, seeds, overrides)
    parts = split_names([name for _, _, name in opened], split)
    planned = planned_jobs(opened, parts, settings)
    whole_number("jobs", jobs, 1)
    make_folder(root)
    if there := sorted(path.name for path in root.iterdir()):
        raise InputError(f"{root}: holds {counted(len(there), 'file')}, such as {there[0]}; allowed: an empty folder")

    card = Card(planned, settings, command)
    total, done = sum(job.clip.frames for job in planned), 0
    for job, written in _results(planned, settings, jobs):
        card.add(job, written)
        done += job.clip.frames
        if progress is not None:
            progress(done, total)
    folder = DatasetFolder(root)
    if writer.finish is not None:
        writer.finish(folder, [(job.clip, card.part(job)) for job in planned])
    card.finish(folder.digest)
    return root


def _results(planned: Sequence[Job], settings: Settings, jobs: int) -> Iterator[tuple[Job, Written]]:
    """Yield each clip as soon as it is written."""
    if jobs == 1 or len(planned) == 1:
        for job in planned:
            yield job, _write_clip(job, settings)
        return
    context = multiprocessing.get_context("spawn")
    with ExitStack() as stack:
        pool = ProcessPoolExecutor(min(jobs, len(planned)), mp_context=context, initializer=_begin)
        stack.callback(pool.shutdown, wait=True, cancel_futures=True)
        tasks = {pool.submit(_write_clip, job, settings): job for job in planned}
        for task in as_completed(tasks):
            try:
                written = task.result()
            except BrokenProcessPool:
                raise IrsimError("a worker process died; allowed: the same again, or fewer jobs") from None
            yield tasks[task], written


def _begin() -> None:
    ignore_interrupts()
    end_with_parent()
    cv2.setNumThreads(1)


def _write_clip(job: Job, settings: Settings) -> Written:
    """Write the files of one clip."""
    folder, count = DatasetFolder(settings.root), 0

    def counting() -> Iterator[LabelledFrame]:
        nonlocal count
        for frame in labelled_frames(job, settings):
            count += len(frame.targets)
            yield frame

    part = WRITERS[settings.format].write(folder, job.clip, counting())
    return Written(part, count, folder.digest)


def labelled_frames(job: Job, settings: Settings) -> Iterator[LabelledFrame]:
    """Yield the frames of a clip with their labelled targets and, where the format uses them, masks."""
    wanted = WRITERS[settings.format].masks
    size, least = job.clip.size, settings.min_visible
    masks: Iterator[dict[str, Bools]] | None = None
    if wanted != "unused" and isinstance(job.source, Rendering):
        triples = job.source.masked_pairs(0, job.clip.frames, settings.input)
    else:
        found = None if wanted == "unused" else mask_rendering(job.source, job.word, wanted == "needed")
        masks = None if found is None else _rendered_masks(*found)
        pairs = job.source.pairs(0, job.clip.frames, input=settings.input)
        triples = ((frame, truth, None if masks is None else next(masks)) for frame, truth in pairs)  # type: ignore[misc]
    for number, (frame, truth, pixels) in enumerate(triples):
        targets = tuple(target for target in truth.targets if is_labelled(target, size, least))
        yield LabelledFrame(number, frame.time, frame.image, targets, pixels)


def is_labelled(target: TargetTruth, size: tuple[int, int], least: float) -> bool:
    """Return True where a target gets a label: its box touches the picture of `size` (columns, rows), and its visible
    fraction, where it is known, is above 0 and at least `least`."""
    return touches(target.box, size) and (target.visible is None or 0 < target.visible >= least)


def _rendered_masks(rendering: Rendering, start: int) -> Iterator[dict[str, Bools]]:
    renderer, (columns, rows) = Renderer(rendering.scenario), rendering.size
    for index in rendering.arrivals[start:]:
        yield visible_pixels(renderer.drawn_targets(index), (rows, columns))
