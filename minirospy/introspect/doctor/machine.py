"""Check this machine without using the network: Python, environment variables and packages.

Source: http://wiki.ros.org/ROS/EnvironmentVariables, http://wiki.ros.org/ROS/NetworkSetup, http://wiki.ros.org/roswtf.
"""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import minirospy
from minirospy.base import names
from minirospy.base.environment import Environment
from minirospy.base.errors import ManifestError, NotFoundError, NoThreadsAtEndError
from minirospy.base.installation import install_command
from minirospy.introspect.doctor.findings import Finding, ok, problem, warning
from minirospy.introspect.doctor.reach import MasterLocation, is_loopback, is_own_address
from minirospy.runtime.transport.shared_memory import is_possible
from minirospy.runtime.transport.shared_memory_trial import try_out
from minirospy.workspace.hidden_modules import hiding_files
from minirospy.workspace.stale import warning_of_stale_definitions, workspace_of

__all__ = ["check_packages", "check_python", "check_shared_memory", "check_variables"]

_OURS = Path(minirospy.__file__).parent
_LIBRARIES = {"yaml": "PyYAML"} | {
    name: name
    for name in ("msgpack", "psutil", "rich", "lz4", "numpy", "xacro", "websockets", "segno", "cbor2")
}
"""The modules of the packages that pip installs with minirospy, and the names of the packages."""

_MEANT = (
    "ROS_MASTER_URI",
    "ROS_HOSTNAME",
    "ROS_IP",
    "ROS_IPV6",
    "ROS_NAMESPACE",
    "MINIROSPY_PORTS",
    "MINIROSPY_ALLOW",
    "MINIROSPY_LOCAL",
)


def check_python() -> Iterator[Finding]:
    """Yield findings about the Python version, the rospy that programs would import, and the required libraries."""
    import importlib.util

    what = f"{platform.python_version()}, minirospy {minirospy.__version__}"
    spec = importlib.util.find_spec("rospy")
    origin = spec.origin if spec else None
    if origin is None:
        yield problem(
            "python",
            f"{what}; `import rospy` finds nothing",
            "run without -I and -S, or install minirospy again: its .pth file puts rospy on the path",
        )
    elif _OURS in Path(origin).parents:
        yield ok("python", f"{what}; `import rospy` is minirospy's")
    else:
        yield ok("python", f"{what}; `import rospy` is {Path(origin).parent}, which goes before minirospy's")
    if (3, 12, 0) <= sys.version_info[:3] < (3, 12, 3):
        yield warning(
            "python", str(NoThreadsAtEndError()), "install a newer Python, and make the environment again"
        )
    for file in hiding_files(Path.cwd()):
        yield problem(
            "python",
            f"{file} hides the module {file.stem} from programs in this folder",
            "give it another name",
        )
    missing = [package for module, package in _LIBRARIES.items() if importlib.util.find_spec(module) is None]
    if missing:
        yield problem("libraries", f"not installed: {', '.join(missing)}", install_command(*missing))


def check_variables(
    environ: Mapping[str, str],
    environment: Environment,
    master: MasterLocation,
    known: Mapping[str, list[str]],
) -> Iterator[Finding]:
    """Yield findings about each variable that sets the master's or this machine's address, and about their combination.

    ``known``: the addresses of the host names in the variables.
    """
    found = [*_host_findings(environ, environment, master, known), *_other_findings(environ, environment)]
    if not found:
        meant = [f"{name}={environ[name]}" for name in _MEANT if environ.get(name)]
        found.append(
            ok("variables", ", ".join(meant) or "none is set: the master and all nodes on this machine")
        )
    yield from found


def _host_findings(
    environ: Mapping[str, str],
    environment: Environment,
    master: MasterLocation,
    known: Mapping[str, list[str]],
) -> Iterator[Finding]:
    hostname, ip = environ.get("ROS_HOSTNAME", ""), environ.get("ROS_IP", "")
    host = environment.host
    variable = (
        f"ROS_HOSTNAME={host}" if hostname else f"ROS_IP={host}" if ip else f"this machine's name '{host}'"
    )
    export = f"export ROS_IP={master.own_address or '<an address of this machine>'}"
    correct = f"unset ROS_HOSTNAME; {export}" if hostname else export

    if hostname and ip and hostname != ip:
        same = ip in known[hostname]
        yield (warning if same else problem)(
            "variables",
            f"ROS_HOSTNAME={hostname} and ROS_IP={ip} are both set"
            + ("" if same else ", and say different things")
            + ": ROS_HOSTNAME counts",
            "unset ROS_HOSTNAME" if is_own_address(ip) else "unset ROS_IP",
        )

    own = known[host]
    by_ip, is_address = bool(ip and not hostname), _is_address(host)
    if by_ip and own and not is_address:
        # Strings such as `192.168.1` also resolve, in this case to 192.168.0.1.
        is_name = not ip.replace(".", "").isdigit()
        yield warning(
            "variables",
            f"ROS_IP={ip} is {'a name, not an IP address' if is_name else 'not a whole IP address'}",
            f"export ROS_HOSTNAME={ip}; unset ROS_IP" if is_name else export,
        )

    if not own:
        what = "neither an IP address nor a" if by_ip else "not a"
        yield problem("variables", f"{variable} is {what} name that this machine knows", correct)
    elif host in ("0.0.0.0", "::"):
        yield problem(
            "variables", f"{variable} is every address and none: nobody can connect to a node there", correct
        )
    elif is_address and ":" in host and not environment.ipv6:
        yield problem(
            "variables",
            f"{variable} is an IPv6 address, and nodes listen on IPv4 alone",
            "export ROS_IPV6=on",
        )
    elif is_loopback(host) and not master.is_local:
        yield problem(
            "variables",
            f"{variable} is this machine alone, but the master is on another one ({master.host})",
            correct,
        )
    elif all(map(is_loopback, own)) and not master.is_local:
        yield warning(
            "variables",
            f"{variable} is {own[0]} here, which other machines cannot use unless they know that name",
            correct,
        )
    elif not any(map(is_own_address, own)):
        yield warning(
            "variables",
            f"{variable} is {'' if is_address else ' '.join(own) + ', '}not an address of this machine: right only behind NAT "
            "or in a container",
            correct,
        )


def _other_findings(environ: Mapping[str, str], environment: Environment) -> Iterator[Finding]:
    ipv6 = environ.get("ROS_IPV6", "")
    if ipv6 and ipv6 != "on":
        yield warning("variables", f"ROS_IPV6={ipv6} has no effect", "export ROS_IPV6=on, or unset it")

    if not names.is_legal_name(environment.namespace):
        yield problem(
            "variables",
            f"ROS_NAMESPACE={environ.get('ROS_NAMESPACE')} is not a legal name",
            "letters, digits, _ and /, a letter first",
        )

    for folder in environment.package_path:
        if not folder.is_dir():
            yield warning(
                "variables",
                f"ROS_PACKAGE_PATH names {folder}, which is not a folder",
                "take it out of the variable",
            )

    config = environ.get("ROS_PYTHON_LOG_CONFIG_FILE", "")
    if config and not Path(config).is_file():
        yield warning("variables", f"ROS_PYTHON_LOG_CONFIG_FILE={config} is not a file", "unset it")

    # If a folder does not exist yet, check its nearest existing parent.
    for folder, variable in ((environment.home, "ROS_HOME"), (environment.log_dir, "ROS_LOG_DIR")):
        there = next((each for each in (folder, *folder.absolute().parents) if each.exists()), folder)
        if not (there.is_dir() and os.access(there, os.W_OK | os.X_OK)):
            why = "may not be written by this user" if there.is_dir() else "is a file, no folder"
            yield problem(
                "variables",
                f"logs cannot be written to {folder}: {there} {why}",
                f"export {variable}=<a folder of your own>"
                # A folder owned by root usually results from `sudo roscore`.
                + (f", or `sudo chown -R $USER {there}`" if there == folder and there.is_dir() else ""),
            )
            break


def check_shared_memory(environment: Environment) -> Iterator[Finding]:
    """Yield a finding on whether processes of this user can send messages of 0.5 to 32 MB through shared memory."""
    if not environment.shares_memory:
        yield ok(
            "shared memory", f"off, by MINIROSPY_TRANSPORT={environment.transport}: messages use sockets"
        )
    elif not is_possible():
        yield ok("shared memory", f"none: {try_out()}; large messages use sockets")
    elif trouble := try_out():
        yield warning(
            "shared memory",
            f"does not work: {trouble}; large messages use sockets, which is slower",
            "in a container: allow memfd_create, eventfd2 and /proc, and enough memory",
        )
    else:
        yield ok("shared memory", "works: large messages between processes of this user use it")


def check_packages(environment: Environment, here: Path | None = None) -> Iterator[Finding]:
    """Yield findings about ROS_PACKAGE_PATH: duplicate or unreadable packages, and missing dependencies.

    ``here``: a folder in the current workspace, by default the working directory.
    """
    from minirospy.workspace.packages import Packages, built_in_roots

    found: list[Finding] = []
    workspace = _workspace_of(here or Path.cwd())
    if workspace and workspace / "src" not in {path.absolute() for path in environment.package_path}:
        found.append(
            warning(
                "packages",
                f"the workspace {workspace} is not in this terminal's environment",
                f"source {workspace / 'devel' / 'setup.bash'}",
            )
        )
    # Skip minirospy's packages, which a sourced workspace adds to the path: the user's packages may replace them.
    mine = Packages.below(*(path for path in environment.package_path if path not in built_in_roots()))
    copies = mine.copies()
    for name, folders in sorted(copies.items()):
        if len(folders) > 1:
            found.append(
                warning(
                    "packages",
                    f"{name} is in {' and in '.join(map(str, folders))}: the first counts",
                    "remove or rename one of them",
                )
            )
    # Yield only one warning for each workspace.
    firsts = {workspace_of(folders[0]): folders[0] for folders in copies.values()}
    stale = filter(None, map(warning_of_stale_definitions, firsts.values()))
    found += (warning("packages", text, "catkin_make") for text in stale)
    found += _dependency_findings(environment, sorted(copies))
    yield from found or [
        ok("packages", f"{len(copies)} in ROS_PACKAGE_PATH" if copies else "those of minirospy")
    ]


def _dependency_findings(environment: Environment, mine: list[str]) -> Iterator[Finding]:
    if not mine:
        return
    from minirospy.workspace.build import PROVIDED
    from minirospy.workspace.dependencies import Dependencies
    from minirospy.workspace.packages import Packages

    packages = Packages(environment)
    known = {*packages.folders(), *PROVIDED}
    dependencies = Dependencies(packages)
    for name in mine:
        try:
            manifest = dependencies.manifest(name)
        except (ManifestError, NotFoundError) as error:
            yield problem("packages", str(error), "correct its package.xml")
            continue
        missing = [
            each.name
            for each in manifest.dependencies
            if each.tag in ("run_depend", "exec_depend", "depend") and each.name not in known
        ]
        # Ignore rosdep keys of system packages, which are not ROS packages.
        missing = [each for each in dict.fromkeys(missing) if not _is_system_key(each)]
        if missing:
            yield warning(
                "packages",
                f"{name} needs {', '.join(missing)}, which is not a package here",
                "put it into a folder of ROS_PACKAGE_PATH; if it is not a ROS package, nothing need be done",
            )


def _is_system_key(name: str) -> bool:
    return "-" in name or name.startswith(("python", "lib", "boost", "eigen"))


def _workspace_of(folder: Path) -> Path | None:
    for each in (folder, *folder.parents):
        if (each / "devel" / "setup.bash").is_file() and (each / "src").is_dir():
            return each
    return None


def _is_address(text: str) -> bool:
    import ipaddress

    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True
