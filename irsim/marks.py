"""What may stand beside a field, in its annotation, and says more of it than its type."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True)
class Items:
    """Stands beside a field that is a list of so many numbers: what they are, as errors and the reference name them."""

    names: str


class Located:
    """Stands beside a field that names a file: in a YAML file a relative name is looked for beside that file first."""


FileName = Annotated[str, Located()]
