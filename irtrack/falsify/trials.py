"""Trials side by side, in order, none of them twice: what came of each is kept in a file as it is known."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import irsim
from irsim.recording.output import atomic_text
from irtrack.errors import InputError
from irtrack.falsify.apart import NO_LIMIT_S, Run, here
from irtrack.falsify.order import Map
from irtrack.falsify.trial import Subject, Verdict, examine, judge
from irtrack.metrics import Trace
from irtrack.registry.identity import code_hash, module_code_hash, tracker_config


class Trials:
    """A subject's trials. A journal, one JSON line a trial, holds those of earlier calls, so that a search that was
    stopped goes on where it was: it asks for the same scenes again. What other code judged is not among them, nor what
    died or hung within another time limit for a frame than `limit_s`."""

    def __init__(
        self, subject: Subject, apply: Map, journal: Path, runner: Run = here, limit_s: float | None = None
    ) -> None:
        self.runner = runner
        self._subject = subject
        self._judge = partial(judge, subject, runner)
        self._apply = apply
        self._journal = journal
        self._digest = json.dumps(
            [
                tracker_config(subject.tracker),
                code_hash(subject.tracker),
                subject.input,
                [[rule.kind, rule.model_dump()] for rule in subject.rules],
                module_code_hash(judge.__module__),
            ],
            sort_keys=True,
        )
        self._known = {
            key: verdict
            for key, verdict in _read(journal).items()
            if verdict.limit_s in (None, NO_LIMIT_S if limit_s is None else limit_s)
        }
        self.run = 0
        """Trials that were not known before."""

    def verdicts(self, scenarios: Sequence[irsim.Scenario | None]) -> Iterator[Verdict]:
        """Of each scene, in order; no more is run than is asked for, but for what has begun beside it."""
        keys = [self._key(each) for each in scenarios]
        new = {key: each for key, each in zip(keys, scenarios, strict=True) if key not in self._known}
        outcomes = self._apply(self._judge, list(new.values()))
        waiting = iter(new)
        for key in keys:
            while key not in self._known:
                self._note(next(waiting), next(outcomes))
            yield self._known[key]

    def examine(self, scenario: irsim.Scenario) -> tuple[Verdict, tuple[Trace, ...]]:
        """The verdict on a scene, and each rule's trace: run anew, and not noted."""
        return examine(self._subject, irsim.Rendering(scenario), scenario.seed, self.runner)

    def _key(self, scenario: irsim.Scenario | None) -> str:
        text = json.dumps([self._digest, None if scenario is None else scenario.hash])
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()

    def _note(self, key: str, verdict: Verdict) -> None:
        self._known[key] = verdict
        self.run += 1
        row: dict[str, Any] = {"trial": key, "margins": verdict.margins, "raised": verdict.raised}
        if verdict.limit_s is not None:
            row["limit_s"] = verdict.limit_s
        line = json.dumps(row)
        try:
            with self._journal.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        except OSError as error:
            raise InputError(f"{self._journal}: cannot be written: {error.strerror or error}") from None


def _read(journal: Path) -> dict[str, Verdict]:
    """What a journal holds; a last line that was cut off is taken away, so that others can follow."""
    try:
        text = journal.read_text(encoding="utf-8")
        whole = text[: text.rfind("\n") + 1]
        if whole != text:
            with atomic_text(journal) as file:
                file.write(whole)
    except FileNotFoundError:
        return {}
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{journal}: cannot be used as a journal of trials: {error}") from None
    known: dict[str, Verdict] = {}
    for number, line in enumerate(whole.splitlines(), start=1):
        try:
            row = json.loads(line)
            known[row["trial"]] = Verdict(tuple(map(float, row["margins"])), row["raised"], row.get("limit_s"))
        except (ValueError, TypeError, KeyError):
            raise InputError(f"{journal}:{number}: is no trial; allowed: a journal of irtrack falsify") from None
    return known
