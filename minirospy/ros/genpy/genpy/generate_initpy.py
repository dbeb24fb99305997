"""genpy.generate_initpy: writes ``__init__.py`` for a folder of generated modules. Source: http://wiki.ros.org/genpy."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

__all__ = ["write_module", "write_modules"]


def write_modules(outdir: str) -> int:
    """Write ``__init__.py`` for all generated modules in a folder. Return 0."""
    folder = Path(outdir)
    if not folder.is_dir():
        print(f"{outdir} is not a folder: no __init__.py is written", file=sys.stderr)
        return 0
    write_module(outdir, sorted(path.stem for path in folder.glob("_[!_]*.py")))
    return 0


def write_module(basedir: str, generated_modules: Iterable[str]) -> None:
    """Write an ``__init__.py`` that re-exports the names in these modules. Raise OSError on failure."""
    lines = [f"from .{module} import *\n" for module in generated_modules]
    Path(basedir, "__init__.py").write_text("".join(lines), encoding="utf-8")
