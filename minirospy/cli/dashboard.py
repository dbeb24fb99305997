"""`minirospy dashboard`, `rqt` and its tools: the graph and the board in a browser. docs/dashboard.md describes their use."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from minirospy.cli.windows import WINDOWS, view_of_plugin
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Command

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.web.dashboard.codes import Codes
    from minirospy.web.tokens import Tokens

__all__ = ["COMMANDS", "DASHBOARD", "dashboard", "end_with_stdin"]

_MASTER_SECONDS = 1.0  # timeout for connecting to a master, after which the page is served without one
_OWN_MASTER_SECONDS = 30.0  # timeout for a master on loopback; only a busy machine takes so long

Fields = Mapping[str, Sequence[str]]  # a view's settings, as written in its link


class Serving(NamedTuple):
    """Options shared by all commands that open the page: its address and port, and the clients that may connect."""

    port: int | None
    no_browser: bool
    listen: bool
    address: str
    read_only: bool
    cert: str
    key: str
    host_name: Sequence[str]
    origin: Sequence[str]

    @property
    def bound(self) -> str:
        """Return the address to bind."""
        return self.address or ("0.0.0.0" if self.listen else "127.0.0.1")


def dashboard(argv: Sequence[str] | None = None) -> int:
    """Run `minirospy dashboard`; return its exit status."""
    return _main(DASHBOARD, argv)


def __getattr__(name: str) -> Any:
    """Return the function for an rqt command (``rqt_plot``) or its Command (``RQT_PLOT``), created from COMMANDS."""
    command = COMMANDS.get(name.lower())
    if command is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return command if name.isupper() else partial(_main, command)


def _main(command: Command, argv: Sequence[str] | None = None) -> int:
    """Run a command. A launch file may start it as a node, so the arguments may contain remappings."""
    words = list(sys.argv[1:] if argv is None else argv)
    remappings = [word for word in words if ":=" in word]
    body = partial(command.body, arguments=remappings)
    return command._replace(body=body).main([word for word in words if ":=" not in word])


# --- command lines


def _parser(name: str, what: str) -> Parser:
    parser = Parser(
        name, f"{what} Only this machine can open the page, unless --listen is given. Ctrl-C ends it."
    )
    parser.add_argument(
        "--port",
        type=int,
        help="port of the page (8766, or a free one if that is in use); 0 takes a free one",
    )
    parser.add_argument("--no-browser", action="store_true", help="print the link, and open no browser")
    parser.add_argument(
        "--listen", action="store_true", help="let other machines open the page, by links with a token"
    )
    parser.add_argument(
        "--address",
        default="",
        help="the address to listen at (127.0.0.1; with --listen 0.0.0.0)",
        completer="nothing",
    )
    parser.add_argument(
        "--read-only", action="store_true", help="let nobody publish, call services or set parameters"
    )
    parser.add_argument(
        "--cert",
        default="",
        metavar="FILE",
        help="serve https with this certificate (PEM)",
        completer="files",
    )
    parser.add_argument("--key", default="", metavar="FILE", help="its key (PEM)", completer="files")
    parser.add_argument(
        "--host-name",
        action="append",
        default=[],
        metavar="NAME",
        help="a name by which browsers reach the page, as that of a proxy in front of it; clients then need the token",
        completer="nothing",
    )
    parser.add_argument(
        "--origin",
        action="append",
        default=[],
        metavar="PATTERN",
        help="other pages that may connect, as https://*.example.org",
        completer="nothing",
    )
    return parser


def _add_ignored(parser: Parser, *words: str, takes_value: bool = False) -> None:
    """Add an rqt option that is accepted but has no effect."""
    if takes_value:
        parser.add_argument(
            *words, dest="ignored", metavar="X", help="accepted, without effect", completer="nothing"
        )
    else:
        parser.add_argument(*words, dest="ignored", action="store_true", help="accepted, without effect")


def dashboard_parser() -> Parser:
    from minirospy.web.dashboard.views import LAYOUTS, VIEWS

    parser = _parser("minirospy dashboard", "Shows the graph and the board in a browser.")
    layouts = [name for name in LAYOUTS if name not in VIEWS]
    parser.add_argument(
        "view",
        nargs="?",
        default="",
        help=f"the view to open (overview), or a layout: {', '.join(layouts)}",
        completer="dashboard_views",
    )
    parser.add_argument(
        "--layout",
        default="",
        help=f"the layout to open, several views side by side: {', '.join(LAYOUTS)}",
        completer="dashboard_layouts",
    )
    parser.add_argument(
        "--embed",
        action="store_true",
        help="for a notebook on this machine, whose cells may show the page; ends when the standard input ends",
    )
    return parser


def _add_plugin(parser: Parser) -> None:
    parser.add_argument(
        "-s",
        "--standalone",
        metavar="PLUGIN",
        default="topics",
        help="the view to open, as rqt_plot",
        completer="nothing",
    )
    _add_ignored(parser, "--force-discover", "--lock-perspective", "--on-top")
    _add_ignored(parser, "-p", "--perspective", "--perspective-file", takes_value=True)


def _add_plots(parser: Parser) -> None:
    parser.add_argument("-P", "--pause", action="store_true", help="start paused")
    _add_ignored(parser, "-e", "--empty", "-L", "--buffer-length")
    parser.add_argument(
        "topic", nargs="*", help="what to plot: /topic/field, /topic/field:field", completer="topics"
    )


def _add_bags(parser: Parser) -> None:
    _add_ignored(parser, "--clock")
    parser.add_argument(
        "bagfiles", nargs="*", help="bags, or MCAP files; the first is opened", completer="bag_files"
    )


def _add_topic(parser: Parser) -> None:
    parser.add_argument("topic", nargs="?", default="", help="the topic of the images", completer="topics")


def _add_nodes(parser: Parser) -> None:
    parser.add_argument("node_name", nargs="*", help="the nodes to open", completer="nodes")


def _window(
    name: str,
    view: str,
    what: str,
    add_arguments: Callable[[Parser], None] | None = None,
    chosen: Callable[..., tuple[str, Fields]] | None = None,
) -> Command:
    """Return the command that opens the page in place of an rqt window.

    ``what`` describes the window. ``add_arguments`` adds the command's arguments; ``chosen`` converts them to the view
    and its settings.
    """

    def make_parser() -> Parser:
        parser = _parser(name, f"{what} in a browser.")
        _add_ignored(parser, "--clear-config")
        if add_arguments:
            add_arguments(parser)
        return parser

    def body(*, arguments: Sequence[str] = (), ignored: object = None, **given: Any) -> int:
        serving = Serving(*(given.pop(field) for field in Serving._fields))
        shown, fields = chosen(**given) if chosen else (view, {})
        return _serve(shown, fields, serving, arguments)

    return Command(name, make_parser, body)


def _top() -> tuple[str, Fields]:
    return "nodes", {"sort": ["cpu"]}


def _rviz_parser() -> Parser:
    parser = _parser("rviz", "Shows robots, sensors and maps in three dimensions, in a browser.")
    parser.add_argument(
        "-d",
        "--display-config",
        metavar="FILE",
        default="",
        help="a .rviz file to open, and to save to",
        completer="files",
    )
    parser.add_argument(
        "-f", "--fixed-frame", metavar="FRAME", default="", help="the fixed frame", completer="nothing"
    )
    _add_ignored(parser, "--fullscreen", "--in-mc-wrapper", "--no-stereo", "--verbose", "--log-level-debug")
    _add_ignored(parser, "--disable-anti-aliasing")
    _add_ignored(parser, "-s", "--splash-screen", "-l", "--ogre-log", takes_value=True)
    _add_ignored(parser, "--opengl", "-t", "--display-title-format", takes_value=True)
    return parser


def _dashboard(view: str, layout: str, embed: bool, arguments: Sequence[str] = (), **serving: Any) -> int:
    from minirospy.base.suggestions import did_you_mean
    from minirospy.web.dashboard.views import LAYOUTS, VIEWS

    if view and layout:
        raise Misuse(f"'{view}' and --layout {layout} are two views: give one")
    if not layout and view not in VIEWS and view in LAYOUTS:
        layout, view = view, ""
    if layout and layout not in LAYOUTS:
        known = ", ".join(LAYOUTS)
        raise Misuse(f"there is no layout '{layout}'{did_you_mean(layout, LAYOUTS)}: there are {known}")
    if view and view not in VIEWS:
        names = (*VIEWS, *(each for each in LAYOUTS if each not in VIEWS))
        raise Misuse(f"there is no view '{view}'{did_you_mean(view, names)}: there are {', '.join(names)}")
    fields = {"preset": [layout]} if layout else {}
    shown = "layout" if layout else view or "overview"
    return _serve(shown, fields, Serving(**serving), arguments, embeds=embed)


def _plugin(standalone: str) -> tuple[str, Fields]:
    return view_of_plugin(standalone), {}


def _plots(topic: Sequence[str], pause: bool) -> tuple[str, Fields]:
    from minirospy.web.dashboard.views import plotted_fields

    return "plot", {"path": plotted_fields(topic), **({"paused": ["1"]} if pause else {})}


def _image(topic: str) -> tuple[str, Fields]:
    return "image", {"topic": [topic]} if topic else {}


def _bags(bagfiles: Sequence[str]) -> tuple[str, Fields]:
    from minirospy.base.errors import NotFoundError

    for name in bagfiles:
        if not Path(name).is_file():
            raise NotFoundError("bag", name)
    return "bag", {"file": bagfiles} if bagfiles else {}


def _nodes(node_name: Sequence[str]) -> tuple[str, Fields]:
    names = [name if name.startswith("/") else f"/{name}" for name in node_name]
    return "reconfigure", {"node": names} if names else {}


def _rviz(
    display_config: str,
    fixed_frame: str,
    arguments: Sequence[str] = (),
    ignored: object = None,
    **serving: Any,
) -> int:
    from minirospy.web.dashboard.rviz_endpoint import read_file

    file = Path(display_config) if display_config else None
    if file and read_file(file) is None:
        print(f"rviz: {file} does not exist: it is made when it is saved", file=sys.stderr)
    fields = {"file": ["1"] if file else [], "frame": [fixed_frame] if fixed_frame else []}
    return _serve("3d", fields, Serving(**serving), arguments, file)


# --- page


def _serve(
    view: str,
    fields: Fields,
    serving: Serving,
    arguments: Sequence[str],
    rviz_file: Path | None = None,
    node_name: str = "",
    *,
    embeds: bool = False,
) -> int:
    """Serve the page until Ctrl-C, SIGTERM or `rosnode kill`; return the exit status.

    ``node_name`` is set by joint_state_publisher_gui, which publishes joints; the default is the dashboard's usual name.
    ``embeds``: notebooks may embed the page, and the dashboard exits when its standard input closes.
    """
    from minirospy.web.serve import require_libraries

    port, listen, read_only = serving.port, serving.listen, serving.read_only
    if port is not None and not 0 <= port <= 65535:
        raise Misuse(f"--port {port} is not between 0 and 65535")
    require_libraries()

    from minirospy.base.environment import Environment
    from minirospy.base.errors import BridgeError
    from minirospy.base.names import anonymous_name
    from minirospy.web.access import Access, is_loopback
    from minirospy.web.addresses import host_names
    from minirospy.web.bridge import BridgeOptions
    from minirospy.web.dashboard.bag_folder import BagFolder
    from minirospy.web.dashboard.codes import Codes
    from minirospy.web.dashboard.dashboard import PORT, Dashboard
    from minirospy.web.dashboard.waiting_page import WaitingPage
    from minirospy.web.serve import run

    # Also serve the bags that the user has named, which may be outside of the working folder.
    given = fields.get("file", ()) if view == "bag" else ()
    bags = BagFolder(Path.cwd(), [Path(name) for name in given])
    if not is_loopback(serving.bound) and not listen:
        raise Misuse(f"--address {serving.address} lets other machines connect: add --listen")
    tokens = _tokens(Environment.read().home, must_be_kept=listen, must_be_new=embeds)
    # Require the token behind a proxy (--host-name), where clients on other machines appear to be local.
    requires_token = listen or bool(serving.host_name)
    access = Access(
        hosts=(*host_names(), *serving.host_name),
        origins=tuple(serving.origin),
        read_token=tokens.read if requires_token or read_only else "",
        write_token="" if read_only else tokens.write,
        requires_token=requires_token,
        default_is_read=read_only,
    )

    class Started:
        """Opens the dashboard on the given port (default: PORT, or any free port if PORT is in use).

        Until there is a master, a page without data is served on the port.
        """

        def __init__(self, node: Node) -> None:
            self._node = node
            self._codes = Codes()
            self._waiting: WaitingPage | None = None
            self._opened: list[Dashboard] = []

        async def wait(self) -> None:
            """Unless the master is reachable, start serving a page without data, which :meth:`start` will replace."""
            if await _is_reachable(self._node.master_uri):
                return
            for each in ports:
                waiting = WaitingPage(self._node.master_uri, self._codes, options_of(each), embeds=embeds)
                try:
                    await waiting.open()
                except BridgeError:
                    if each != ports[-1]:
                        continue
                    raise
                self._waiting = waiting
                announce(waiting.port, self._codes)
                return

        async def start(self) -> None:
            waiting = self._waiting
            if waiting:
                await waiting.close()
            for each in (waiting.port,) if waiting else ports:
                dashboard = Dashboard(
                    self._node,
                    options_of(each),
                    rviz_file,
                    bags,
                    publishes_joints=bool(node_name),
                    embeds=embeds,
                    codes=self._codes,
                )
                self._opened.append(dashboard)
                try:
                    await dashboard.start()
                except BridgeError:
                    if each != ports[-1] and not waiting:
                        continue
                    raise
                if not waiting:
                    announce(dashboard.port, self._codes)
                return

        async def close(self) -> None:
            if self._waiting:
                await self._waiting.close()
            for each in self._opened:
                await each.close()

    ports = (PORT, 0) if port is None else (port,)

    def options_of(port: int) -> BridgeOptions:
        return BridgeOptions(
            address=serving.bound,
            foxglove_port=port,
            access=access,
            certificate=serving.cert,
            key=serving.key,
            diagnostics=False,
            name="minirospy dashboard",
        )

    async def start(node: Node) -> Started:
        return Started(node)

    def announce(port: int, codes: Codes) -> None:
        _announce(serving, port, view, fields, tokens, codes)

    if embeds:
        end_with_stdin()
    return run(
        node_name or anonymous_name("minirospy_dashboard"),
        arguments,
        start,
        lambda _: None,
        connect=Started.wait,
    )


async def _is_reachable(uri: str) -> bool:
    """Return whether a program listens at a URI's host and port.

    Wait at most _MASTER_SECONDS, or _OWN_MASTER_SECONDS for an address of loopback.
    """
    import asyncio
    import contextlib

    from minirospy.base.environment import split_uri
    from minirospy.web.access import is_loopback

    host, port, _ = split_uri(uri)
    seconds = _OWN_MASTER_SECONDS if is_loopback(host) else _MASTER_SECONDS
    with contextlib.suppress(OSError, UnicodeError, asyncio.TimeoutError):
        _, writer = await asyncio.wait_for(asyncio.open_connection(host, port), seconds)
        writer.close()
        return True
    return False


def end_with_stdin() -> None:
    """Start a thread that terminates this process, like SIGTERM, when its standard input is closed."""
    import os
    import signal
    import threading

    def watch() -> None:
        while os.read(0, 4096):
            pass
        signal.raise_signal(signal.SIGTERM)

    threading.Thread(target=watch, name="minirospy-stdin", daemon=True).start()


def _tokens(home: Path, *, must_be_kept: bool, must_be_new: bool) -> Tokens:
    """Return this user's tokens. If ROS_HOME cannot store them, return temporary tokens, or raise if ``must_be_kept``.

    ``must_be_new``: return tokens that only this process uses, because a saved notebook contains its token.

    Even on loopback, the page needs the token to start programs and open files, because other users of the machine can
    connect.
    """
    from minirospy.base.errors import BridgeError
    from minirospy.web.access import new_token
    from minirospy.web.tokens import Tokens, kept_tokens

    if must_be_new and not must_be_kept:
        return Tokens(new_token(), new_token())
    try:
        return kept_tokens(home)
    except BridgeError:
        if must_be_kept:
            raise
        return Tokens(new_token(), new_token())


def _announce(serving: Serving, port: int, view: str, fields: Fields, tokens: Tokens, codes: Codes) -> None:
    from minirospy.web.addresses import own_addresses, qr_code
    from minirospy.web.dashboard.views import link

    address = serving.bound
    is_any = address in ("0.0.0.0", "::")
    encrypted = bool(serving.cert)
    # Avoid localhost: a browser may try ::1 first, where another user's program may listen on this port.
    host = ("127.0.0.1" if address != "::" else "::1") if is_any or address == "localhost" else address
    # The link for the local browser has the same rights as the user's own programs.
    own = tokens.read if serving.read_only else tokens.write
    address_of = partial(link, host, port, view, fields, encrypted=encrypted)
    here = address_of(token=own)
    is_opened = not serving.no_browser and _open_browser(address_of, own, codes)
    print(f"{'The browser opens' if is_opened else 'Open in a browser:'} {here}", flush=True)
    if not serving.listen:
        return
    reached = own_addresses() if is_any else [address]
    for rights, token in (
        ("read-only", tokens.read),
        ("read-write", "" if serving.read_only else tokens.write),
    ):
        for each in reached if token else ():
            there = link(each, port, view, fields, token=token, encrypted=encrypted)
            print(f"from other machines, {rights}: {there}")
    if reached and sys.stdout.isatty():
        print(qr_code(link(reached[0], port, view, fields, token=tokens.read, encrypted=encrypted)), end="")
    sys.stdout.flush()


def _open_browser(link: Callable[..., str], token: str, codes: Codes) -> bool:
    """Open the link with a one-time code in place of the token. Return False if there is no browser. Call this on the loop."""
    import asyncio

    from minirospy.web.dashboard.browser import open_link
    from minirospy.web.dashboard.codes import LIFETIME

    code = codes.new(token)
    remove = open_link(link(code=code))
    if remove is None:
        codes.redeem(code)
        return False
    codes.when_ended(code, remove)
    # Check one second late, so that the code has certainly expired by the clock that Codes uses.
    asyncio.get_running_loop().call_later(LIFETIME + 1, codes.forget_expired)
    return True


DASHBOARD = Command("minirospy dashboard", dashboard_parser, _dashboard)

_ARGUMENTS: Mapping[str, tuple[Callable[[Parser], None] | None, Callable[..., tuple[str, Fields]]]] = {
    "rqt": (_add_plugin, _plugin),
    "rqt_bag": (_add_bags, _bags),
    "rqt_image_view": (_add_topic, _image),
    "rqt_plot": (_add_plots, _plots),
    "rqt_reconfigure": (_add_nodes, _nodes),
    "rqt_top": (None, _top),
}
"""Commands that take arguments, each with two functions.

One function adds the arguments; the other converts them to a view and its settings.
"""

COMMANDS = {
    window.command: Command("rviz", _rviz_parser, _rviz)
    if window.command == "rviz"
    else _window(window.command, window.view, window.what, *_ARGUMENTS.get(window.command, ()))
    for window in WINDOWS
}
"""The commands of rqt and rviz, keyed by name."""
