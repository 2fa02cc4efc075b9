"""Compare two captures: `python tests/support/net/compare.py OLD.json NEW.json [--words]`; status 1 where they differ.

A line of intended.txt is `gone|new|changed  PATTERN  REASON` (fnmatch over keys, separated by two spaces or more):
it permits a key only in OLD, only in NEW, or another value. An error on either side is a difference, even the same.
Changes of words are counted; `--words` lists them. Captures of parts (`--only`) are compared by `--only` likewise.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

INTENDED = Path(__file__).with_name("intended.txt")


def intended() -> list[tuple[str, str, str]]:
    """Return (kind, pattern, reason) of each line of intended.txt."""
    lines = [line.strip() for line in INTENDED.read_text().splitlines()]
    found = [re.split(r"\s{2,}", line, maxsplit=2) for line in lines if line and not line.startswith("#")]
    for each in found:
        if len(each) != 3 or each[0] not in ("gone", "new", "changed"):
            sys.exit(f"{INTENDED}: {each}: allowed: gone|new|changed  PATTERN  REASON")
    return [(kind, pattern, reason) for kind, pattern, reason in found]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--words", action="store_true", help="list the changes of words")
    parser.add_argument("--only", default="*", help="only keys of this pattern")
    given = parser.parse_args()
    sides = [json.loads(path.read_text()) for path in (given.old, given.new)]
    old, new = ({k: v for k, v in side["values"].items() if fnmatchcase(k, given.only)} for side in sides)
    permitted, used = intended(), set[str]()

    def meant(kind: str, key: str) -> bool:
        found = [pattern for permission, pattern, _ in permitted if permission == kind and fnmatchcase(key, pattern)]
        used.update(found)
        return bool(found)

    def failed(value: Any) -> bool:
        return isinstance(value, str) and value.startswith("error: ")

    lines = [f"only in old: {key}: {old[key]}" for key in old if key not in new and not meant("gone", key)]
    lines += [f"only in new: {key}: {new[key]}" for key in new if key not in old and not meant("new", key)]
    both = [key for key in old if key in new]
    lines += [f"differs: {k}: {old[k]} -> {new[k]}" for k in both if old[k] != new[k] and not meant("changed", k)]
    lines += [f"error in both: {key}: {old[key]}" for key in both if failed(old[key]) and old[key] == new[key]]
    print("\n".join(lines), end="\n" if lines else "")
    words = [side["words"] for side in sides]
    changed = [key for key in words[0].keys() & words[1].keys() if words[0][key] != words[1][key]]
    for key in sorted(changed) if given.words else ():
        print(f"words: {key}\n  - {words[0][key]}\n  + {words[1][key]}")
    print(f"{len(both)} values compared, {len(lines)} differences, {len(used)} intended patterns used")
    print(f"{len(changed)} of {len(words[0])} texts have other words")
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
