"""The figures of one track against one reference."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Score:
    """What one track scores. A figure is None where no frame says anything about it.

    Scored frames are those after the start frame in which the target is present; `held` figures
    take only the scored frames before the loss (all of them where there is none).

    frames, held_frames     how many frames were scored, and how many of them before the loss
    lost                    lost by `irtrack.metrics.loss`; None where nothing was scored
    lost_at                 index of the frame that the loss is dated to
    off_share               share of the scored frames that are off (far from the target)
    error                   mean Euclidean centre error, px
    abs_x, abs_y            mean |error| per axis, px;  sd_x, sd_y  its standard deviation
    rmse, rmse_x, rmse_y    root mean square error, px
    precision_5, _20        share of scored frames with centre error <= 5, 20 px
    precision_norm          area under the normalised precision curve, 0..1
    success_auc             area under the success curve, 0..1
    ms_mean, ms_median      wall time of a step, ms
    """

    frames: int
    held_frames: int
    lost: bool | None
    lost_at: int | None
    off_share: float | None
    error: float | None
    abs_x: float | None
    abs_y: float | None
    sd_x: float | None
    sd_y: float | None
    rmse: float | None
    rmse_x: float | None
    rmse_y: float | None
    error_held: float | None
    abs_x_held: float | None
    abs_y_held: float | None
    sd_x_held: float | None
    sd_y_held: float | None
    rmse_held: float | None
    rmse_x_held: float | None
    rmse_y_held: float | None
    precision_5: float | None
    precision_20: float | None
    precision_norm: float | None
    success_auc: float | None
    ms_mean: float | None
    ms_median: float | None

    def as_dict(self) -> dict[str, Any]:
        """The figures by name, plain values for JSON or a table."""
        return asdict(self)
