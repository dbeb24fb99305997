"""genpy.generator: generates Python modules from definitions, with minirospy's compiler. Source: http://wiki.ros.org/genpy."""

from __future__ import annotations

import keyword
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from minirospy.base.errors import DefinitionError
from minirospy.core.idl.emit import emit_message, emit_service
from minirospy.ros.genmsg.genmsg.base import InvalidMsgSpec
from minirospy.ros.genmsg.genmsg.msg_loader import (
    MsgContext,
    MsgNotFound,
    SearchPath,
    load_depends,
    load_msg_from_file,
    load_srv_from_file,
    lookup_in,
    parsed_message,
    parsed_service,
)
from minirospy.ros.genmsg.genmsg.msgs import Constant, MsgSpec
from minirospy.ros.genmsg.genmsg.srvs import SrvSpec
from minirospy.ros.genpy.genpy.base import MsgGenerationException

__all__ = [
    "Generator",
    "MsgGenerator",
    "SrvGenerator",
    "_remap_reserved",
    "compute_outfile_name",
    "compute_pkg_type",
    "compute_resource_name",
    "make_python_safe",
    "msg_generator",
    "srv_generator",
]

_Loader = Callable[[MsgContext, str, str], MsgSpec | SrvSpec]
_Emitter = Callable[..., Iterator[str]]


def msg_generator(msg_context: MsgContext, spec: MsgSpec, search_path: SearchPath) -> Iterator[str]:
    """Yield the lines of a message's module.

    Raise MsgGenerationException or InvalidMsgSpec if the definition is invalid, MsgNotFound if a definition is missing.
    """
    load_depends(msg_context, spec, search_path)
    try:
        yield from emit_message(parsed_message(spec), lookup_in(msg_context)).splitlines()
    except DefinitionError as error:
        raise MsgGenerationException(str(error)) from error


def srv_generator(msg_context: MsgContext, spec: SrvSpec, search_path: SearchPath) -> Iterator[str]:
    """Yield the lines of a service's module.

    Raise MsgGenerationException or InvalidMsgSpec if the definition is invalid, MsgNotFound if a definition is missing.
    """
    load_depends(msg_context, spec, search_path)
    try:
        yield from emit_service(
            parsed_service(spec.text, spec.full_name), lookup_in(msg_context)
        ).splitlines()
    except DefinitionError as error:
        raise MsgGenerationException(str(error)) from error


def compute_resource_name(filename: str, ext: str) -> str:
    """Return the name of the type defined in a file."""
    return os.path.basename(filename)[: -len(ext)]


def compute_outfile_name(outdir: str, infile_name: str, ext: str) -> str:
    """Return the path of the module generated from a definition file."""
    return os.path.join(outdir, f"_{compute_resource_name(infile_name, ext)}.py")


def compute_pkg_type(package: str, type_: str) -> tuple[str, str]:
    """Return a type's package and name, resolved in ``package``. Raise MsgGenerationException if the name is invalid."""
    words = type_.split("/")
    if len(words) > 2:
        raise MsgGenerationException(f"illegal message type: {type_}")
    return (words[0], words[1]) if len(words) == 2 else (package, words[0])


def make_python_safe(spec: MsgSpec) -> MsgSpec:
    """Rename a message's fields and constants that are Python keywords or ``self``; return the changed message."""
    constants = [
        Constant(each.type, _remap_reserved(each.name), each.val, each.val_text) for each in spec.constants
    ]
    return MsgSpec(
        spec.types, [_remap_reserved(name) for name in spec.names], constants, spec.text, spec.full_name
    )


def _remap_reserved(field_name: str) -> str:
    prefix, dot, name = field_name.rpartition(".")
    return f"{prefix}{dot}{name}_" if keyword.iskeyword(name) or name == "self" else field_name


class Generator:
    """Generates modules for messages or services.

    ``what`` names the kind, ``ext`` is its file extension. The functions load a definition and yield its module's lines.
    """

    def __init__(self, what: str, ext: str, spec_loader_fn: _Loader, generator_fn: _Emitter) -> None:
        self.what = what
        self.ext = ext
        self.spec_loader_fn = spec_loader_fn
        self.generator_fn = generator_fn

    def generate(
        self, msg_context: MsgContext, full_type: str, f: str, outdir: str, search_path: SearchPath
    ) -> str:
        """Generate the module for the definition file ``f``; return the module's path.

        Raise MsgGenerationException or InvalidMsgSpec if the definition is invalid, MsgNotFound if one that it uses is
        missing, OSError if a file cannot be read or written.
        """
        spec = self.spec_loader_fn(msg_context, f, full_type)
        lines = list(self.generator_fn(msg_context, spec, search_path))
        path = compute_outfile_name(outdir, f, self.ext)
        os.makedirs(outdir, exist_ok=True)
        Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    def generate_messages(
        self, package: str, package_files: Sequence[str], outdir: str, search_path: SearchPath
    ) -> int:
        """Generate modules for a package's files in ``outdir``. Return 0, or print errors to stderr and return 1."""
        msg_context = MsgContext.create_default()
        status = 0
        for file in package_files:
            full_type = f"{package}/{compute_resource_name(file, self.ext)}"
            try:
                if not file.endswith((".msg", ".srv")):
                    raise MsgGenerationException(
                        f"Processing file: '{os.path.basename(file)}' - unknown file extension"
                    )
                self.generate(msg_context, full_type, file, outdir, search_path)
            except (
                InvalidMsgSpec,
                MsgGenerationException,
                MsgNotFound,
                OSError,
                UnicodeDecodeError,
            ) as error:
                # Report the error and continue with the other definitions.
                text = f"ERROR: Unable to generate {self.what} for package '{package}': while processing '{file}': {error}"
                print(f"\n{text}\n", file=sys.stderr)
                status = 1
        return status


class MsgGenerator(Generator):
    """Generates modules for messages."""

    def __init__(self) -> None:
        super().__init__("messages", ".msg", load_msg_from_file, msg_generator)


class SrvGenerator(Generator):
    """Generates modules for services."""

    def __init__(self) -> None:
        super().__init__("services", ".srv", load_srv_from_file, srv_generator)
