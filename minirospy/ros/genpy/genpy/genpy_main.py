"""genpy.genpy_main: the command line of message generators. Source: http://wiki.ros.org/genpy."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from optparse import OptionParser
from typing import NoReturn

from minirospy.ros.genmsg.genmsg.base import InvalidMsgSpec
from minirospy.ros.genmsg.genmsg.command_line import includepath_to_dict
from minirospy.ros.genmsg.genmsg.msg_loader import MsgNotFound
from minirospy.ros.genpy.genpy.base import MsgGenerationException
from minirospy.ros.genpy.genpy.generate_initpy import write_modules
from minirospy.ros.genpy.genpy.generator import Generator

__all__ = ["genmain", "usage"]


def usage(progname: str) -> None:
    """Print the generator's usage."""
    print(f"{progname} file(s)")


def genmain(argv: Sequence[str], progname: str, gen: Generator) -> NoReturn:
    """Run a generator with the command line ``argv``, including the program's name, and exit.

    The exit status is 0, 1 to 3 after an error, or 2 after a usage error. Arguments: ``-p PACKAGE -o FOLDER -I PACKAGE:FOLDER
    FILE ...``, or ``--initpy -o FOLDER``.
    """
    parser = OptionParser(f"{progname} file")
    parser.add_option("--initpy", action="store_true", default=False)
    parser.add_option("-p", dest="package")
    parser.add_option("-o", dest="outdir")
    parser.add_option("-I", dest="includepath", action="append")
    options, arguments = parser.parse_args(list(argv))
    if options.initpy and not options.outdir:
        parser.error("Missing args")
    if not options.initpy and len(arguments) < 2:
        parser.error("please specify args")
    if not options.outdir or not (options.initpy or options.package):
        parser.error("-p PACKAGE and -o FOLDER are needed")

    try:
        if options.initpy:
            status = write_modules(options.outdir)
        else:
            os.makedirs(options.outdir, exist_ok=True)
            search_path = includepath_to_dict(options.includepath or [])
            status = gen.generate_messages(options.package, arguments[1:], options.outdir, search_path)
    except InvalidMsgSpec as error:
        status = _failed(error, 1)
    except MsgGenerationException as error:
        status = _failed(error, 2)
    except (OSError, MsgNotFound) as error:
        status = _failed(error, 3)
    sys.exit(status)


def _failed(error: Exception, status: int) -> int:
    print("ERROR: ", error, file=sys.stderr)
    return status
