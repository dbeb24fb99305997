"""roslib.gentools: computes the md5sums and full definitions of definition files from their dependencies.

The functions use a dict that describes a definition's dependencies, with the keys ``package``, ``spec``, ``deps``,
``uniquedeps`` and ``files``.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TypedDict

from minirospy.ros.genmsg.genmsg import gentools, msg_loader
from minirospy.ros.genmsg.genmsg.msgs import MsgSpec
from minirospy.ros.genmsg.genmsg.srvs import SrvSpec
from minirospy.ros.roslib.roslib.msgs import MsgSpecException
from minirospy.workspace.packages import Packages

__all__ = [
    "MsgSpecException",
    "compute_full_text",
    "compute_md5",
    "compute_md5_text",
    "get_dependencies",
    "get_file_dependencies",
]


class Dependencies(TypedDict):
    """The messages and files that a definition depends on."""

    files: dict[str, str]
    deps: list[str]
    spec: MsgSpec | SrvSpec
    package: str
    uniquedeps: list[str]


def get_file_dependencies(
    f: str, stdout: object = sys.stdout, stderr: object = sys.stderr, rospack: object = None
) -> Dependencies:
    """Return the dependencies of a package's definition file. Raise Exception if it is not a definition file."""
    path = Path(f)
    folder = next((each for each in path.resolve().parents if (each / "package.xml").is_file()), None)
    package = folder.name if folder else None
    if path.suffix == ".msg" and package:
        spec: MsgSpec | SrvSpec = msg_loader.load_msg_from_file(
            msg_loader.MsgContext.create_default(), f, f"{package}/{path.stem}"
        )
    elif path.suffix == ".srv" and package:
        spec = msg_loader.load_srv_from_file(
            msg_loader.MsgContext.create_default(), f, f"{package}/{path.stem}"
        )
    else:
        raise Exception(f"[{package}] does not appear to be a message or service")
    return get_dependencies(spec, package)


def get_dependencies(
    spec: MsgSpec | SrvSpec,
    package: str,
    compute_files: bool = True,
    stdout: object = sys.stdout,
    stderr: object = sys.stderr,
    rospack: object = None,
) -> Dependencies:
    """Return the dependencies of a package's definition. Raise genmsg.MsgNotFound if one does not exist."""
    context = _context(spec)
    parts = [spec.request, spec.response] if isinstance(spec, SrvSpec) else [spec]
    needed = list(dict.fromkeys(name for part in parts for name in context.get_all_depends(part.full_name)))
    files = {name: str(context.get_file(name)) for name in needed} if compute_files else {}
    return Dependencies(files=files, deps=needed, spec=spec, package=package, uniquedeps=needed)


def compute_md5(get_deps_dict: Dependencies, rospack: object = None) -> str:
    """Return a definition's md5sum."""
    return gentools.compute_md5(_context(get_deps_dict["spec"]), get_deps_dict["spec"])


def compute_md5_text(get_deps_dict: Dependencies, spec: MsgSpec, rospack: object = None) -> str:
    """Return the text from which a message's md5sum is computed."""
    return gentools.compute_md5_text(_context(get_deps_dict["spec"]), spec)


def compute_full_text(get_deps_dict: Dependencies) -> str:
    """Return a definition's text followed by the texts of its dependencies."""
    return gentools.compute_full_text(_context(get_deps_dict["spec"]), get_deps_dict["spec"])


def _context(spec: MsgSpec | SrvSpec) -> msg_loader.MsgContext:
    """Return a context with all of a definition's dependencies."""
    context = msg_loader.MsgContext.create_default()
    search = {name: [str(folder / "msg")] for name, folder in Packages().folders().items()}
    msg_loader.load_depends(context, spec, search)
    return context
