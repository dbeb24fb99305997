"""`rosbag compress`, `decompress` and `reindex` rewrite a bag and keep the original; `encrypt` and `decrypt` are not supported.

Source: http://wiki.ros.org/rosbag/Commandline. As in ROS, an unreadable file is reported, and the next one is processed.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable

from minirospy.base import private_files
from minirospy.base.errors import BagError, BagUnindexedError, MinirospyError
from minirospy.command.command import warn
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Verb
from minirospy.core.bag import compression
from minirospy.ros.rosbag.commands.rosbag_info import report, unreadable

__all__ = ["VERBS"]

_COMPRESS = "Compress one or more bag files."
_DECOMPRESS = "Decompress one or more bag files."
_REINDEX = "Reindexes one or more bag files."
_ENCRYPT = "Encrypt one or more bag files."
_DECRYPT = "Decrypt one or more bag files."


def _parser(verb: str, about: str) -> Parser:
    parser = Parser(f"rosbag {verb}", "", f"rosbag {verb} [options] BAGFILE1 [BAGFILE2 ...]", about=about)
    parser.add_argument("bags", nargs="*", metavar="BAGFILE", help="bag files", completer="bag_files")
    parser.add_argument("--output-dir", metavar="DIR", help="write to directory DIR", completer="folders")
    parser.add_argument(
        "-f", "--force", action="store_true", help="force overwriting of backup file if it exists"
    )
    parser.add_argument("-q", "--quiet", action="store_true", help="suppress noncritical messages")
    return parser


def _add_compressions(parser: Parser, default: str) -> None:
    option = {"action": "store_const", "dest": "compression"}
    parser.add_argument(
        "-j", "--bz2", const=compression.BZ2, default=default, help="use BZ2 compression", **option
    )
    parser.add_argument("--lz4", const=compression.LZ4, default=default, help="use lz4 compression", **option)


def _compress_parser() -> Parser:
    parser = _parser("compress", _COMPRESS)
    _add_compressions(parser, compression.BZ2)
    return parser


def _compress(bags: list[str], output_dir: str | None, force: bool, quiet: bool, compression: str) -> int:
    def write(source: str, target: str) -> None:
        _change_compression(source, target, compression, quiet)

    return _rewrite(bags, output_dir, force, quiet, write)


def _decompress(bags: list[str], output_dir: str | None, force: bool, quiet: bool) -> int:
    return _compress(bags, output_dir, force, quiet, compression.NONE)


def _change_compression(source: str, target: str, name: str, quiet: bool) -> None:
    from minirospy.introspect import bags
    from minirospy.ros.rosbag.commands.rosbag_progress import showing_progress

    with bags.open_reader(source) as reader:
        total = bags.data_size(reader)
    with showing_progress(target, total, quiet=quiet) as progress:
        bags.compress(source, target, name, progress)


def _reindex(bags: list[str], output_dir: str | None, force: bool, quiet: bool) -> int:
    return _rewrite(
        bags,
        output_dir,
        force,
        quiet,
        lambda source, target: _reindex_one(source, target, quiet),
        unindexed=True,
    )


def _reindex_one(source: str, target: str, quiet: bool) -> None:
    import shutil  # imported here because the import takes longer than running these commands

    from minirospy.introspect import bags
    from minirospy.ros.rosbag.commands.rosbag_progress import showing_progress

    size = os.path.getsize(source)
    if not bags.is_mcap(source) and bags.version_of(source) < 200:
        with showing_progress(target, size, quiet=quiet) as progress:
            bags.convert12(source, target, progress)
        return
    shutil.copy(source, target)
    with showing_progress(target, bags.chunks_end(source) or size, quiet=quiet) as progress:
        problems = bags.reindex(target, progress)
    for problem in problems:
        warn(f"{source}: {problem}")


def _rewrite(
    paths: list[str],
    output_dir: str | None,
    force: bool,
    quiet: bool,
    write: Callable[[str, str], None],
    *,
    unindexed: bool = False,
) -> int:
    """Rewrite each bag with ``write(source, target)``: to a folder, or in place with a backup of the original.

    Return the exit status.
    """
    if not paths:
        raise Misuse("a bag file is missing", "You must specify at least one bag file.")
    from minirospy.introspect.bags import backup_path, is_mcap

    status = 0
    for path in paths:
        if not _is_readable(path, unindexed=unindexed):
            continue
        if not unindexed and is_mcap(path):
            report(
                f"ERROR: {path} is an MCAP file, and the result would be a bag: "
                f"`rosbag convert -c lz4 {path} OTHER.mcap` changes its compression"
            )
            status = 1
            continue
        if output_dir is not None:
            target = os.path.join(output_dir, os.path.basename(path))
            if os.path.realpath(target) != os.path.realpath(path):
                if not _write(path, path, target, write) and unindexed:
                    # As in ROS, compress and decompress continue if the target cannot be created; reindex fails.
                    status = 1
                continue

        backup = backup_path(path)
        if not force and os.path.exists(backup):
            if not quiet:
                report(f"Skipping {path}. Backup path {backup} already exists.")
            continue
        try:
            private_files.replace_file(path, backup)
        except OSError as error:
            report(f"ERROR moving {path} to {backup}: {error}")
            continue
        try:
            _write(path, backup, path, write)
        except BaseException:
            # After Ctrl-C or an error such as a full disk, restore the original bag.
            with contextlib.suppress(OSError):
                private_files.replace_file(backup, path)
            raise
    return status


def _is_readable(path: str, *, unindexed: bool) -> bool:
    from minirospy.introspect.bags import data_size, open_reader

    try:
        with open_reader(path) as reader:
            if not unindexed:
                # Read all chunk headers first, to avoid rewriting a bag with a damaged header.
                data_size(reader)
            return True
    except (BagError, OSError) as error:
        if unindexed and isinstance(error, BagUnindexedError):
            return True
        report(unreadable(path, error))
        return False


def _write(path: str, source: str, target: str, write: Callable[[str, str], None]) -> bool:
    """Rewrite a bag; return False if the target cannot be created."""
    try:
        with open(target, "wb"):
            pass
    except OSError as error:
        report(f"ERROR writing to {target}: {error}")
        if source != path:
            private_files.replace_file(source, path)
        return False

    try:
        write(source, target)
    except BagError as error:
        # Keep the target: it contains the messages that precede the damage.
        print()
        report(f"ERROR operating on {source}: {error}")
    except OSError as error:
        print()
        with contextlib.suppress(OSError):
            os.remove(target)
        report(f"ERROR operating on {path}: {error}")
        if source != path:
            private_files.replace_file(source, path)
    return True


def _encrypt_parser() -> Parser:
    parser = _parser("encrypt", _ENCRYPT)
    parser.add_argument(
        "-p", "--plugin", default="rosbag/AesCbcEncryptor", help="encryptor plugin name", completer="nothing"
    )
    parser.add_argument("-r", "--param", default="*", help="encryptor plugin parameter", completer="nothing")
    _add_compressions(parser, compression.NONE)
    return parser


def _decrypt_parser() -> Parser:
    parser = _parser("decrypt", _DECRYPT)
    _add_compressions(parser, compression.NONE)
    return parser


def _refuse(bags: list[str], **others: object) -> None:
    if not bags:
        raise Misuse("a bag file is missing", "You must specify at least one bag file.")
    raise MinirospyError(
        "bags are neither encrypted nor decrypted here: that needs gpg and a key which ROS 1 alone uses. "
        "To keep a bag secret, encrypt the file: gpg -e a.bag"
    )


VERBS = (
    Verb("rosbag compress", _COMPRESS, _compress_parser, _compress),
    Verb("rosbag decompress", _DECOMPRESS, lambda: _parser("decompress", _DECOMPRESS), _decompress),
    Verb("rosbag reindex", _REINDEX, lambda: _parser("reindex", _REINDEX), _reindex),
    Verb("rosbag encrypt", _ENCRYPT, _encrypt_parser, _refuse),
    Verb("rosbag decrypt", _DECRYPT, _decrypt_parser, _refuse),
)
