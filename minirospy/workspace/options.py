"""Run a package's .cfg files: programs that describe a node's parameters and generate package.cfg.NAMEConfig and documents.

Source: http://wiki.ros.org/dynamic_reconfigure/Tutorials/HowToWriteYourFirstCfgFile.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

from minirospy.base.errors import BuildError
from minirospy.workspace.packages import DIST_PACKAGES, built_in_roots
from minirospy.workspace.plan import Plan

__all__ = ["make_options"]

_OVERLAY = Path(__file__).parents[1] / "overlay"


def make_options(plan: Plan, devel: Path) -> tuple[list[Path], tuple[str, ...]]:
    """Run the .cfg files of a package. Return the files written to devel, and the warnings.

    Raise BuildError if a .cfg file fails.
    """
    made: list[Path] = []
    warnings: list[str] = []
    modules = devel / DIST_PACKAGES
    documents, headers = devel / "share" / plan.name, devel / "include" / plan.name
    for file in plan.options:
        _run(file, plan, [documents, headers, modules / plan.name], modules)
        name = f"{file.stem}Config"
        module = modules / plan.name / "cfg" / f"{name}.py"
        if not module.is_file():
            warnings.append(
                f"{file}: it has written no {name}: the name that generate() gets must be that of the file"
            )
        made += [
            path
            for path in (
                module,
                module.with_name("__init__.py"),
                *(documents / "docs" / f"{name}{end}" for end in (".dox", ".wikidoc", "-usage.dox")),
            )
            if path.is_file()
        ]
    return made, tuple(warnings)


def _run(file: Path, plan: Plan, folders: list[Path], modules: Path) -> None:
    """Run a .cfg file with minirospy's generator, which can import the messages and modules of the workspace."""
    base = next(root / "dynamic_reconfigure" for root in built_in_roots())
    path = [str(_OVERLAY), str(modules), *filter(None, [os.environ.get("PYTHONPATH")])]
    done = subprocess.run(
        [sys.executable, str(file), str(base), *map(str, folders)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path), "PYTHONIOENCODING": "utf-8"},
        cwd=plan.folder,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        check=False,
    )

    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        places = re.findall(rf'File "{re.escape(str(file))}", line (\d+)', done.stderr)
        raise BuildError(
            str(file), int(places[-1]) if places else 0, lines[-1] if lines else "ends with a fault"
        )
