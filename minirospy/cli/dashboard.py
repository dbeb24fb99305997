"""`minirospy dashboard`, `rqt` and its kin: the graph and the board in a browser. How to use it: docs/dashboard.md."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from minirospy.cli.parser import Misuse, Parser
from minirospy.cli.verbs import Command

if TYPE_CHECKING:
    from minirospy.aio.node import Node
    from minirospy.bridge.tokens import Tokens

__all__ = ["DASHBOARD", "RQT", "RQT_CONSOLE", "RQT_GRAPH", "RQT_IMAGE_VIEW", "RQT_PLOT"]


def dashboard(argv: Sequence[str] | None = None) -> int:
    """Run `minirospy dashboard`; return its exit status."""
    return _main(DASHBOARD, argv)


def rqt(argv: Sequence[str] | None = None) -> int:
    """Run `rqt`; return its exit status."""
    return _main(RQT, argv)


def rqt_console(argv: Sequence[str] | None = None) -> int:
    """Run `rqt_console`; return its exit status."""
    return _main(RQT_CONSOLE, argv)


def rqt_plot(argv: Sequence[str] | None = None) -> int:
    """Run `rqt_plot`; return its exit status."""
    return _main(RQT_PLOT, argv)


def rqt_graph(argv: Sequence[str] | None = None) -> int:
    """Run `rqt_graph`; return its exit status."""
    return _main(RQT_GRAPH, argv)


def rqt_image_view(argv: Sequence[str] | None = None) -> int:
    """Run `rqt_image_view`; return its exit status."""
    return _main(RQT_IMAGE_VIEW, argv)


def _main(command: Command, argv: Sequence[str] | None) -> int:
    """Run a command; launch files start it as a node, with remappings among its words."""
    words = list(sys.argv[1:] if argv is None else argv)
    remappings = [word for word in words if ":=" in word]
    body = partial(command.body, arguments=remappings)
    return command._replace(body=body).main([word for word in words if ":=" not in word])


# --- the command lines


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
    return parser


def _add_ignored(parser: Parser, *words: str, takes_value: bool = False) -> None:
    """Accept an option of rqt that has no meaning for a page."""
    if takes_value:
        parser.add_argument(
            *words, dest="ignored", metavar="X", help="accepted, without effect", completer="nothing"
        )
    else:
        parser.add_argument(*words, dest="ignored", action="store_true", help="accepted, without effect")


def _dashboard_parser() -> Parser:
    parser = _parser("minirospy dashboard", "Shows the graph and the board in a browser.")
    parser.add_argument(
        "view",
        nargs="?",
        default="",
        help="the view to open (topics), or the layout: workshop, classroom",
        completer="dashboard_views",
    )
    parser.add_argument(
        "--layout",
        default="",
        help="the layout to open, several views side by side: workshop, console, teleop or classroom",
        completer="dashboard_layouts",
    )
    return parser


def _rqt_parser() -> Parser:
    parser = _parser("rqt", "Shows the graph in a browser.")
    parser.add_argument(
        "-s",
        "--standalone",
        metavar="PLUGIN",
        default="topics",
        help="the view to open, as rqt_plot",
        completer="nothing",
    )
    _add_ignored(parser, "--clear-config", "--force-discover", "--lock-perspective", "--on-top")
    _add_ignored(parser, "-p", "--perspective", "--perspective-file", takes_value=True)
    return parser


def _console_parser() -> Parser:
    parser = _parser("rqt_console", "Shows the log lines of all nodes in a browser.")
    _add_ignored(parser, "--clear-config")
    return parser


def _plot_parser() -> Parser:
    parser = _parser("rqt_plot", "Plots numbers of messages in a browser.")
    parser.add_argument("-P", "--pause", action="store_true", help="start paused")
    _add_ignored(parser, "-e", "--empty", "-L", "--buffer-length", "--clear-config")
    parser.add_argument(
        "topic", nargs="*", help="what to plot: /topic/field, /topic/field:field", completer="topics"
    )
    return parser


def _graph_parser() -> Parser:
    parser = _parser("rqt_graph", "Shows nodes and topics in a browser.")
    _add_ignored(parser, "--clear-config")
    return parser


def _image_parser() -> Parser:
    parser = _parser("rqt_image_view", "Shows images of a topic in a browser.")
    _add_ignored(parser, "--clear-config")
    parser.add_argument("topic", nargs="?", default="", help="the topic of the images", completer="topics")
    return parser


def _dashboard(
    view: str,
    layout: str,
    port: int | None,
    no_browser: bool,
    listen: bool,
    address: str,
    read_only: bool,
    arguments: Sequence[str] = (),
) -> int:
    from minirospy.dashboard.views import LAYOUTS, VIEWS
    from minirospy.errors import did_you_mean

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
    shown = "layout" if layout else view or "topics"
    return _serve(shown, fields, port, no_browser, listen, address, read_only, arguments)


def _rqt(
    standalone: str,
    port: int | None,
    no_browser: bool,
    listen: bool,
    address: str,
    read_only: bool,
    arguments: Sequence[str] = (),
    ignored: object = None,
) -> int:
    from minirospy.dashboard.views import view_of_plugin

    return _serve(view_of_plugin(standalone), {}, port, no_browser, listen, address, read_only, arguments)


def _rqt_console(
    port: int | None,
    no_browser: bool,
    listen: bool,
    address: str,
    read_only: bool,
    arguments: Sequence[str] = (),
    ignored: object = None,
) -> int:
    return _serve("console", {}, port, no_browser, listen, address, read_only, arguments)


def _rqt_plot(
    topic: Sequence[str],
    pause: bool,
    port: int | None,
    no_browser: bool,
    listen: bool,
    address: str,
    read_only: bool,
    arguments: Sequence[str] = (),
    ignored: object = None,
) -> int:
    from minirospy.dashboard.views import plotted_fields

    fields = {"path": plotted_fields(topic), **({"paused": ["1"]} if pause else {})}
    return _serve("plot", fields, port, no_browser, listen, address, read_only, arguments)


def _rqt_graph(
    port: int | None,
    no_browser: bool,
    listen: bool,
    address: str,
    read_only: bool,
    arguments: Sequence[str] = (),
    ignored: object = None,
) -> int:
    return _serve("graph", {}, port, no_browser, listen, address, read_only, arguments)


def _rqt_image_view(
    topic: str,
    port: int | None,
    no_browser: bool,
    listen: bool,
    address: str,
    read_only: bool,
    arguments: Sequence[str] = (),
    ignored: object = None,
) -> int:
    return _serve(
        "image", {"topic": [topic]} if topic else {}, port, no_browser, listen, address, read_only, arguments
    )


# --- the page


def _serve(
    view: str,
    fields: Mapping[str, Sequence[str]],
    port: int | None,
    no_browser: bool,
    listen: bool,
    address: str,
    read_only: bool,
    arguments: Sequence[str],
) -> int:
    """Serve the page until Ctrl-C, SIGTERM or `rosnode kill`; return the exit status."""
    from minirospy.bridge.serve import require_libraries

    if port is not None and not 0 <= port <= 65535:
        raise Misuse(f"--port {port} is not between 0 and 65535")
    require_libraries()

    from minirospy.bridge.access import Access, is_loopback
    from minirospy.bridge.addresses import host_names
    from minirospy.bridge.bridge import BridgeOptions
    from minirospy.bridge.serve import run
    from minirospy.bridge.tokens import Tokens, kept_tokens
    from minirospy.dashboard.dashboard import PORT, Dashboard
    from minirospy.environment import Environment
    from minirospy.errors import BridgeError
    from minirospy.names import anonymous_name

    address = address or ("0.0.0.0" if listen else "127.0.0.1")
    if not is_loopback(address) and not listen:
        raise Misuse(f"--address {address} lets other machines connect: add --listen")
    tokens = kept_tokens(Environment.read().home) if listen else Tokens("", "")
    access = Access(
        hosts=tuple(host_names()),
        read_token=tokens.read,
        write_token="" if read_only else tokens.write,
        requires_token=listen,
        default_is_read=read_only,
    )

    class Started:
        """The dashboard at the first port that is free, of those that are wanted."""

        dashboard: Dashboard

        def __init__(self, node: Node) -> None:
            self._node = node
            self._opened: list[Dashboard] = []

        async def start(self) -> None:
            for each in (PORT, 0) if port is None else (port,):
                options = BridgeOptions(
                    address=address,
                    foxglove_port=each,
                    access=access,
                    diagnostics=False,
                    name="minirospy dashboard",
                )
                self.dashboard = Dashboard(self._node, options)
                self._opened.append(self.dashboard)
                try:
                    await self.dashboard.start()
                except BridgeError:
                    if each == PORT and port is None:
                        continue
                    raise
                return

        async def close(self) -> None:
            for each in self._opened:
                await each.close()

    async def start(node: Node) -> Started:
        return Started(node)

    def announce(started: Started) -> None:
        _announce(
            address,
            started.dashboard.port,
            view,
            fields,
            tokens,
            no_browser=no_browser,
            listen=listen,
            read_only=read_only,
        )

    return run(anonymous_name("minirospy_dashboard"), arguments, start, announce)


def _announce(
    address: str,
    port: int,
    view: str,
    fields: Mapping[str, Sequence[str]],
    tokens: Tokens,
    *,
    no_browser: bool,
    listen: bool,
    read_only: bool,
) -> None:
    from minirospy.bridge.access import is_loopback
    from minirospy.bridge.addresses import own_addresses, qr_code
    from minirospy.dashboard.browser import open_link
    from minirospy.dashboard.views import link

    is_any = address in ("0.0.0.0", "::")
    host = "localhost" if is_any or is_loopback(address) else address
    # The person at this machine gets the rights of its programs.
    own = tokens.read if read_only else tokens.write
    here = link(host, port, view, fields, token=own)
    is_opened = not no_browser and open_link(here)
    print(f"{'The browser opens' if is_opened else 'Open in a browser:'} {here}", flush=True)
    if not listen:
        return
    reached = own_addresses() if is_any else [address]
    for rights, token in (("read-only", tokens.read), ("read-write", "" if read_only else tokens.write)):
        for each in reached if token else ():
            print(f"from other machines, {rights}: {link(each, port, view, fields, token=token)}")
    if reached and sys.stdout.isatty():
        print(qr_code(link(reached[0], port, view, fields, token=tokens.read)), end="")
    sys.stdout.flush()


DASHBOARD = Command("minirospy dashboard", _dashboard_parser, _dashboard)
RQT = Command("rqt", _rqt_parser, _rqt)
RQT_CONSOLE = Command("rqt_console", _console_parser, _rqt_console)
RQT_PLOT = Command("rqt_plot", _plot_parser, _rqt_plot)
RQT_GRAPH = Command("rqt_graph", _graph_parser, _rqt_graph)
RQT_IMAGE_VIEW = Command("rqt_image_view", _image_parser, _rqt_image_view)
