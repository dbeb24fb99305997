"""A command with verbs (`rostopic list`): a table of them, its help, and the way to the one typed."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import NamedTuple

from minirospy.cli.command import run
from minirospy.errors import UsageError, did_you_mean
from minirospy.names import parse_arguments

__all__ = ["Family", "Verb"]


class Verb(NamedTuple):
    """One verb: its name, one line of help, and the function that takes the rest of the command line.

    Of a family that is a node, the function takes the remapping arguments besides.
    """

    name: str
    summary: str
    body: Callable[..., int | None]


class Family(NamedTuple):
    """A command and its verbs. ``headline`` says what the command is for, ``footer`` where more help is.

    ``is_node``: launch files start it as a node (`<node pkg="rostopic" type="rostopic" args="pub ..."/>`), with
    `__name:=` and remappings among its words. ``interrupted``: the exit status at Ctrl-C.
    """

    name: str
    headline: str
    verbs: tuple[Verb, ...]
    footer: str = ""
    is_node: bool = False
    interrupted: int = 0

    def main(self, argv: Sequence[str] | None = None) -> int:
        """Run the verb that was typed; the exit status as :func:`minirospy.cli.command.run` gives it."""
        words = list(sys.argv[1:] if argv is None else argv)
        return run(self.name, lambda: self._dispatch(words), self.interrupted)

    def help(self) -> str:
        """What `-h` prints."""
        lines = [self.headline, ""] if self.headline else []
        lines.append("Commands:")
        lines += [f"\t{self.name} {verb.name}\t{verb.summary}" for verb in self.verbs]
        return "\n".join([*lines, "", *([self.footer, ""] if self.footer else [])])

    def _dispatch(self, words: list[str]) -> int | None:
        if not words or words[0] in ("-h", "--help"):
            print(self.help())
            return 0 if words else 2
        for verb in self.verbs:
            if verb.name == words[0]:
                if not self.is_node:
                    return verb.body(words[1:])
                arguments = parse_arguments(words[1:])
                return verb.body(arguments.plain, arguments)
        hint = did_you_mean(words[0], (verb.name for verb in self.verbs))
        raise UsageError(f"there is no `{self.name} {words[0]}`{hint} (`{self.name} -h` shows what there is)")
