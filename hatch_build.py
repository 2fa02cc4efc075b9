"""Compiles the inner loops where a C compiler is at hand; without one the package is plain Python, and slower.

hatchling calls it for wheels and editable installs (`make install`); `python hatch_build.py` compiles in a checkout.
"""

from __future__ import annotations

import contextlib
import os
import runpy
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from setuptools import Distribution, Extension

ROOT = Path(__file__).parent
FOLDERS = [Path(package, "_native") for package in ("irsim", "irtrack")]
SHARED = FOLDERS[0]
"""Its headers serve the others, too."""
OLDEST = "0x030b0000"
"""Python 3.11: one binary serves it and all later ones (PEP 384)."""


def build() -> list[str]:
    """Compile in place; the files that came of it, from the root. None where there is no compiler."""
    with contextlib.chdir(ROOT), tempfile.TemporaryDirectory() as objects:
        for old in _binaries():
            old.unlink()  # it would be taken for what is built now
        command = Distribution({"ext_modules": list(map(_extension, FOLDERS))}).get_command_obj("build_ext")
        command.inplace, command.force, command.build_temp, command.build_lib = True, True, objects, objects
        command.ensure_finalized()
        command.run()
        return list(map(str, _binaries()))


def _extension(folder: Path) -> Extension:
    return Extension(
        ".".join([*folder.parts, "_kernels"]),
        sorted(map(str, folder.glob("*.c"))),
        define_macros=[("Py_LIMITED_API", OLDEST), ("SOURCE", f'"{_digest(folder)}"')],
        include_dirs=["."],
        # Sums and products are rounded one by one, so that results are those of the plain loops.
        extra_compile_args=["-O3", "-ffp-contract=off", "-fno-math-errno"],
        libraries=[] if os.name == "nt" else ["m"],
        py_limited_api=True,
        optional=True,
    )


def _digest(folder: Path) -> str:
    """Of what is compiled, as it is told when it is loaded; irsim itself needs more than there is here."""
    own = runpy.run_path(str(SHARED / "loading.py"))
    return str(own["source_digest"](*{folder: None, SHARED: None}))


def _binaries() -> list[Path]:
    return [each for folder in FOLDERS for ending in ("so", "pyd") for each in folder.glob(f"_kernels*.{ending}")]


class CustomBuildHook(BuildHookInterface[Any]):
    """Called by hatchling."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and make the wheel one of this platform where that went well."""
        if built := build():
            build_data["artifacts"] += built
            build_data["pure_python"] = False
            build_data["tag"] = f"cp311-abi3-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


if __name__ == "__main__":
    print("compiled: " + (", ".join(build()) or "nothing; the plain loops will run"))
