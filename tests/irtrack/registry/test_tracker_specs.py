"""Trackers as the command line writes them."""

from __future__ import annotations

import pytest
from bench_fakes import Holder, Logger, Walker

import irtrack
from irtrack.bench import Entry, parse_tracker_spec, parse_trackers
from irtrack.bench.spec import Spec, read_spec
from irtrack.errors import InputError


def test_tracker_specs() -> None:
    big, mine = "big=grey_pf:particles=500:resampling=systematic", "mine=bench_fakes:Logger:log=a:b:speed=2"
    entries = parse_trackers(f"grey_pf,{big},{mine}")
    assert [one.label for one in entries] == ["grey_pf", "big", "mine"]
    assert entries[0].tracker == irtrack.make("grey_pf")
    assert entries[1].tracker == irtrack.make("grey_pf", {"particles": 500, "resampling": "systematic"})
    assert entries[2].tracker == Logger(log="a:b", speed=2)
    assert parse_tracker_spec("grey_pf:particles=50").label == "grey_pf:particles=50"
    assert parse_tracker_spec("bench_fakes:Walker") == Entry("bench_fakes:Walker", Walker())
    (listed,) = parse_trackers("bench_fakes:Holder:held=[1, 'x,:]', {a: b}]")
    assert listed.tracker == Holder(held=[1, "x,:]", {"a": "b"}])
    assert read_spec("T=trax:mine --fast=1 a:b:timeout_s=5") == Spec("T", "trax:mine --fast=1 a:b", {"timeout_s": 5})


@pytest.mark.parametrize(
    ("text", "needle"),
    [
        ("", "no name"),
        ("a=", "no name"),
        ("kalman,", "no name"),
        ("a b=kalman", "label 'a b'"),
        ("=kalman", "label ''"),
        ("klman", "did you mean 'kalman'?"),
        ("kalman:gat=3", "kalman: gat: unknown key"),
        ("grey_pf:bins=1:bins=2", "'bins' is given twice"),
        ("grey_pf:bins=many", "grey_pf: bins: expected a whole number"),
        ("grey_pf:particles", "grey_pf is a tracker's name, not a module"),
        ("grey_pf:", "grey_pf is a tracker's name, not a module"),
        ("grey_pf:bins=[1", "bins"),
        ("absent_module:Thing", "absent_module"),
    ],
)
def test_bad_specs_are_one_line(text: str, needle: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_trackers(text)
    assert needle in str(caught.value)
    assert "\n" not in str(caught.value)
