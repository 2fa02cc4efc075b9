"""Compiles the inner loops where a C compiler is at hand; without one the package is plain Python and slower.

`python hatch_build.py` does so in a checkout.
"""

from __future__ import annotations

import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from setuptools import Distribution, Extension

ROOT = Path(__file__).parent
PACKAGES = ("irsim", "irtrack")
OLDEST = "0x030b0000"
"""Python 3.11: one binary serves it and all later ones (PEP 384)."""


def build() -> list[str]:
    """Compile in place; the files that came of it, from the root."""
    extensions = [
        Extension(
            f"{package}.compiled._kernels",
            sorted(str(each.relative_to(ROOT)) for each in (ROOT / package / "compiled").glob("*.c")),
            depends=sorted(str(each.relative_to(ROOT)) for each in (ROOT / package / "compiled").glob("*.h")),
            define_macros=[("Py_LIMITED_API", OLDEST)],
            include_dirs=[str(ROOT)],
            # Sums and products are rounded one by one, so that results are those of the plain loops.
            extra_compile_args=["-O3", "-ffp-contract=off", "-fno-math-errno"],
            py_limited_api=True,
            optional=True,
        )
        for package in PACKAGES
        if (ROOT / package / "compiled").is_dir()
    ]
    command = Distribution({"ext_modules": extensions}).get_command_obj("build_ext")
    command.inplace = True
    command.ensure_finalized()
    command.run()
    built = [each for package in PACKAGES for each in (ROOT / package / "compiled").glob("*.abi3.*")]
    return [str(each.relative_to(ROOT)) for each in built]


class CustomBuildHook(BuildHookInterface[Any]):
    """Called by hatchling for wheels and editable installs."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and make the wheel one of this platform where that went well."""
        if built := build():
            build_data["artifacts"] += built
            build_data["pure_python"] = False
            build_data["tag"] = f"cp311-abi3-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


if __name__ == "__main__":
    print(*build(), sep="\n")
