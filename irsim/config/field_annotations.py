"""What may stand beside a field, in its annotation, and says more of it than its type."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import AfterValidator

from irsim.config.file_digests import whole_name


@dataclass(frozen=True)
class Items:
    """Stands beside a field that is a list of so many numbers: what they are, as errors and the reference name them."""

    names: str


@dataclass(frozen=True)
class Plausible:
    """Stands beside the limits of a field: a number outside of it is allowed, and `irsim check` warns of it."""

    low: float
    high: float
    unit: str
    hint: str = ""

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g} {self.unit}" + (f" ({self.hint})" if self.hint else "")


class Located:
    """Stands beside a field that names a file: in a YAML file a relative name is looked for beside that file first."""


FileName = Annotated[str, Located(), AfterValidator(whole_name)]
"""A file's name, whole: what a scene is read from stays that when the working directory changes."""
