"""Metadata records of a recording: `irsim` (first in the file) and `irsim_contents` (last)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationError

from irsim.camera import AGCS
from irsim.camera.agc import Agc
from irsim.config.base import Part, Several, importing_nothing
from irsim.config.quantities import AboveZero, NotNegative
from irsim.errors import InputError, one_line
from irsim.types import Curve

FORMAT = 1
"""Version of the file layout; a reader refuses a newer one."""

_Side = Annotated[int, Field(ge=1, le=65_535)]
Size = Annotated[tuple[_Side, _Side], Field(strict=False)]
"""Columns, rows."""
Count = Annotated[int, Field(ge=0)]


class DigestError(InputError):
    """Error of a metadata record whose bytes have changed since it was written."""


class DigestRecord(Part):
    """MCAP metadata record with a text for each field and a digest of them, as MCAP gives no CRC."""

    def to_record(self) -> dict[str, str]:
        """Return the texts of the record by key. Fields that are None are left out."""
        values = self.model_dump(mode="json", exclude_none=True)
        as_text = self._kept_as_text()
        texts = {key: value if key in as_text else json.dumps(value) for key, value in values.items()}
        return {**texts, "digest": _digest(texts)}

    @classmethod
    def from_record(cls, record: Mapping[str, str]) -> Self:
        """Return the object stored in a record. InputError, without the file's name, where it cannot be used;
        DigestError where it is damaged."""
        texts = {key: text for key, text in record.items() if key != "digest"}
        if record.get("digest") != _digest(texts):
            raise DigestError("damaged: its metadata does not match its digest")
        as_text = cls._kept_as_text()
        try:
            # An untrusted recording must not import the modules that it names.
            with importing_nothing():
                return cls.model_validate(
                    {key: _shown(text if key in as_text else json.loads(text)) for key, text in texts.items()}
                )
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in first["loc"])
            raise InputError(f"its metadata is not understood: {place}: {first['msg']}") from None
        except (ValueError, RecursionError):
            raise InputError("damaged: its metadata cannot be read") from None

    @classmethod
    def _kept_as_text(cls) -> set[str]:
        """Return the names of fields that are texts; all other fields are stored as JSON."""
        return {name for name, field in cls.model_fields.items() if _is_text(field.annotation)}


def _shown(value: Any) -> Any:
    """Return a JSON value with characters escaped that control a terminal."""
    if isinstance(value, dict):
        return {key: _shown(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_shown(item) for item in value]
    return one_line(value) if isinstance(value, str) else value


def _digest(texts: Mapping[str, str]) -> str:
    return hashlib.blake2b(json.dumps(sorted(texts.items())).encode(), digest_size=16).hexdigest()


def _is_text(annotation: Any) -> bool:
    choices = [choice for choice in getattr(annotation, "__args__", (annotation,)) if choice is not type(None)]
    return all(choice is str or isinstance(choice, str) for choice in choices)


class Header(DigestRecord):
    """Metadata record before the first frame. Optional fields are None where unknown."""

    version: str
    """Version of irsim."""
    format: Annotated[int, Field(ge=1, le=FORMAT)] = FORMAT
    name: str
    """Name of the source."""
    source_hash: str | None = None
    """Hash of the source; None for imported frames."""
    input: Literal["rendered", "imported"]
    """Origin of the frames."""
    size: Size
    """Columns, rows."""
    bits: Annotated[int, Field(ge=1, le=16)]
    rate_hz: Annotated[AboveZero, Field(le=1e9)]
    follow: str | None = None
    """Id of the target to track."""
    has_truth: bool
    accuracy_px: NotNegative = 0.0
    """Error of the truth's centres, px."""
    agc: Annotated[Agc, AGCS]
    """AGC of the 8-bit display."""
    first_frame: Count = 0
    """Index, in the source, of the recording's frame 0."""
    ifov_rad: AboveZero | None = None
    """Field of view of one pixel, rad."""
    band: str | None = None
    """Name of the band, or its limits as text."""
    range_k: Annotated[tuple[float, float], Field(strict=False)] | None = None
    """Scene temperatures of count 0 and full scale, K, where counts are linear in radiance."""
    curve: Annotated[Curve, Field(strict=False)] | None = None
    """Response curve of a camera whose counts are not linear in radiance, such as a photon counter."""


class TargetEntry(Part):
    """Target in the table of contents."""

    id: str
    cls: str | None = None
    first: Count
    """Index of the first frame in which the target exists."""
    frames: Count
    """Number of frames in which the target exists."""


class Contents(DigestRecord):
    """Metadata record after the last frame."""

    frames: Annotated[int, Field(ge=1)]
    targets: Several[TargetEntry] = ()
    """Targets in the order of their first frames."""
    notes: Several[str] = ()
    """Assumptions made by an import, and losses found by a recovery."""
