"""Presets of typical cameras: values of a camera's keys by name.

No preset is one product. Optics, wells and integration times are typical; noise, in units of the NETD, follows raw
counts of real cameras where a comment says so, and is assumed elsewhere.

Drift is assumed, not measured. In a scene of 300 K, the fixed pattern of offsets and gains reaches a pixel's temporal
noise 17 minutes after a correction of `cooled_mwir`, and one minute after one of `cooled_lwir`. Beyond that, a
correction is due (W. Gross, Th. Hierl, M. Schulz, "Correctability and long-term stability of infrared focal plane
arrays", Opt. Eng. 38, 862 (1999)). Before the shutter closes, the pixel pattern of `uncooled_lwir` is 2.5 times a
pixel's temporal noise; in eight clips of a Lepton 3 the ratio is 0.7 to 4.6 (`irsim.calibration.realism.CAMERAS`).
"""

from __future__ import annotations

from typing import Any, Literal

Preset = Literal["cooled_mwir", "cooled_lwir", "uncooled_lwir", "uncooled_video", "uncooled_stream", "ideal"]

_CORRECTION_RESIDUAL = {"kind": "fixed_pattern", "pixel": 0.3, "column": 0.15, "row": 0.08, "redrawn": True}
"""tvh:vh:h:v = 1:0.3:0.15:0.08, assumed for a fresh correction; raw counts of a real cooled LWIR camera after a
correction have 1:0.40:0.085:0.12 (`irsim.calibration.realism.CAMERAS`)."""

_VIDEO: dict[str, Any] = {
    "size": [640, 512],
    "rate_hz": 30.0,
    "ifov_mrad": 0.5,
    "band": "lwir",
    "bits": 14,
    "range_k": [233.0, 413.0],
    "psf_px": 0.5,
    "netd_mk": 30.0,
    "time_constant_ms": 10.0,
    # Before noise reduction. These ratios bring clouds near to 20 clips of an uncooled core (Svanstrom et al., Data in
    # Brief 2021) and were chosen on them; they are no sensor's figures.
    "noise": [
        {"kind": "white", "ratio": 0.4},
        {"kind": "ar1", "ratio": 1.0, "time_constant_s": 0.6},
        {"kind": "fixed_pattern", "pixel": 3.0, "column": 0.45, "row": 0.6, "redrawn": True},
    ],
    "agc": {
        "kind": "video",
        "noise_reduction": {"gain": 0.25, "motion_counts": 20.0},
        "detail": {"gain": 1.3, "radius_px": 8, "edge_counts": 60.0},
        "base": {"kind": "linear", "tails": [0.001, 0.001], "time_constant_frames": 4.0},
    },
}
"""Video of an uncooled core, before encoding; its noise reduction, detail enhancement and gain control are assumed."""

PRESETS: dict[Preset, dict[str, Any]] = {
    # InSb, 640x512 of 15 um behind 100 mm F/4: wells of 7 Me-, 37 % full at 300 K in 10 ms.
    "cooled_mwir": {
        "size": [640, 512],
        "rate_hz": 50.0,
        "ifov_mrad": 0.15,
        "band": [3.4, 4.9],
        "bits": 14,
        "psf_px": 0.47,  # 0.42 lambda F / pitch
        "detector": {
            "kind": "electrons",
            "pitch_um": 15.0,
            "f_number": 4.0,
            "transmittance": 0.85,
            "quantum_efficiency": 0.8,
            "integration_ms": 10.0,
            "well_me": 7.0,
            "read_noise_e": 400.0,
        },
        "noise": [
            {"kind": "shot"},
            # 3-D noise of raw counts of a real MWIR camera: t 0.5, tvh 3.3
            {"kind": "noise_3d", "id": "level", "t": 0.15, "tvh": 0.0},
            _CORRECTION_RESIDUAL,
            {"kind": "drift", "pixel": 0.8, "column": 0.2, "row": 0.1, "gain": 0.0005, "time_constant_s": 1800.0},
            {"kind": "bad_pixels", "dead": 0.0, "hot": 0.0, "blinking": 0.0005},  # cameras replace dead and hot ones
        ],
    },
    # HgCdTe, 640x512 of 15 um behind 50 mm F/2: wells fill fast, so integration is short.
    "cooled_lwir": {
        "size": [640, 512],
        "rate_hz": 100.0,
        "ifov_mrad": 0.3,
        "band": [7.7, 9.3],
        "bits": 14,
        "psf_px": 0.48,
        "detector": {
            "kind": "electrons",
            "pitch_um": 15.0,
            "f_number": 2.0,
            "transmittance": 0.85,
            "quantum_efficiency": 0.7,
            "integration_ms": 0.4,
            "well_me": 12.0,
            "read_noise_e": 800.0,
        },
        "noise": [
            {"kind": "shot"},
            # 3-D noise of raw counts of a real cooled LWIR camera: t 0.35, tvh 1.65
            {"kind": "noise_3d", "id": "level", "t": 0.2, "tvh": 0.0},
            _CORRECTION_RESIDUAL,
            {"kind": "drift", "pixel": 1.0, "column": 0.25, "row": 0.1, "gain": 0.001, "time_constant_s": 900.0},
            {"kind": "bad_pixels", "dead": 0.0, "hot": 0.0, "blinking": 0.001},
        ],
    },
    # A microbolometer, 640x512 of 12 um behind 24 mm F/1: slow, with correlated noise and a shutter.
    "uncooled_lwir": {
        "size": [640, 512],
        "rate_hz": 30.0,
        "ifov_mrad": 0.5,
        "band": "lwir",
        "bits": 14,
        "range_k": [233.0, 413.0],
        "psf_px": 0.5,
        "netd_mk": 40.0,
        "time_constant_ms": 10.0,
        "noise": [
            {"kind": "white", "ratio": 0.6},
            # the sum with white noise has ratio 1; 1.05 s give rho 0.9 at 9 Hz, as in raw counts of a Lepton 3
            {"kind": "ar1", "ratio": 0.8, "time_constant_s": 1.05},
            {"kind": "ar1", "id": "level", "over": "frame", "ratio": 1.0, "time_constant_s": 20.0},
            {"kind": "fixed_pattern", "pixel": 0.5, "column": 0.3, "row": 0.2, "redrawn": True},
            {"kind": "drift", "pixel": 2.5, "column": 0.7, "row": 0.5, "time_constant_s": 120.0},
            {"kind": "bad_pixels", "dead": 0.0, "hot": 0.0, "blinking": 0.0005},
        ],
        # A shutter every three minutes, a Lepton's default (FLIR, Lepton Engineering Datasheet 500-0659-00-09, rev.
        # 203), for 0.5 s: a Tau 640 takes less (FLIR, Tau 640 User's Manual TAU-0640-00-10, 2011).
        "correction": {"period_frames": 5400, "freeze_frames": 15},
    },
    # The same sort of camera as its core delivers it: 8 bits after noise reduction and detail enhancement.
    "uncooled_video": _VIDEO,
    # A core of 320x256 px whose video is recorded as H.264; needs PyAV.
    "uncooled_stream": {
        **_VIDEO,
        "size": [320, 256],
        "ifov_mrad": 1.0,
        "agc": {**_VIDEO["agc"], "encoding": {"crf": 26.0, "bits_per_pixel": 0.5}},
    },
    # A noiseless camera.
    "ideal": {"bits": 16, "netd_mk": 0.0, "noise": []},
}
