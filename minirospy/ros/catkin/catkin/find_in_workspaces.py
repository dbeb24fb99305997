"""catkin.find_in_workspaces: find a package's files in all sourced workspaces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from minirospy.base.errors import NotFoundError
from minirospy.ros.catkin.catkin.workspace import get_source_paths as get_source_paths
from minirospy.ros.catkin.catkin.workspace import get_workspaces as get_workspaces
from minirospy.workspace.packages import Packages

__all__ = ["find_in_workspaces"]

_ANY = ("bin", "etc", "include", "lib", "share")
_OF_A_PROJECT = ("etc", "include", "libexec", "share")


def find_in_workspaces(
    search_dirs: Sequence[str] | None = None,
    project: str | None = None,
    path: str | None = None,
    _workspaces: Sequence[str] | None = None,
    considered_paths: list[str] | None = None,
    first_matching_workspace_only: bool = False,
    first_match_only: bool = False,
    workspace_to_source_spaces: object = None,
    source_path_to_packages: object = None,
) -> list[str]:
    """Return the existing folders of the package ``project`` or, if ``path`` is given, the existing paths FOLDER/``path``.

    ``search_dirs`` selects the folders: etc, include, libexec and share; if ``project`` is None, also bin and lib. The
    function appends all searched paths to ``considered_paths``. Raise ValueError if ``search_dirs`` contains any other folder.
    """
    chosen = _checked(search_dirs, project)
    found: list[str] = []
    for candidates in _by_workspace(
        get_workspaces() if _workspaces is None else _workspaces, chosen, project
    ):
        here = [str(folder / path) if path else str(folder) for folder in candidates]
        if considered_paths is not None:
            considered_paths += here
        found += [each for each in here if each not in found and Path(each).exists()]
        if found and first_match_only:
            return found[:1]
        if found and first_matching_workspace_only:
            break
    return found


def _checked(search_dirs: Sequence[str] | None, project: str | None) -> list[str]:
    allowed = _OF_A_PROJECT if project else _ANY
    if wrong := [each for each in search_dirs or () if each not in allowed]:
        shown = '", "'.join(sorted(wrong))
        raise ValueError(f'Unsupported search folders: "{shown}"')
    return list(search_dirs or (_OF_A_PROJECT if project else _ANY))


def _by_workspace(
    workspaces: Sequence[str], chosen: Sequence[str], project: str | None
) -> Iterator[list[Path]]:
    """Yield the list of folders to search in each workspace.

    Last, if ``chosen`` contains share, yield the package's folder in ROS_PACKAGE_PATH or minirospy.
    """
    for workspace in workspaces:
        folders = []
        for each in chosen:
            folder = Path(workspace, "lib" if each == "libexec" else each)
            folders.append(folder / project if project else folder)
            if project and each == "share":
                sources = Packages.below(*map(Path, get_source_paths(workspace)))
                folders += _folder(sources, project)
        yield folders
    if project and "share" in chosen:
        yield _folder(Packages(), project)


def _folder(packages: Packages, name: str) -> list[Path]:
    try:
        return [packages.find(name)]
    except NotFoundError:
        return []
