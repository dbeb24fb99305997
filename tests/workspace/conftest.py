"""A workspace of packages that a test writes."""

from __future__ import annotations

from pathlib import Path

import pytest

from minirospy.workspace.build import Report, Workspace, build, read_plans, write_set_up
from minirospy.workspace.packages import Packages, built_in_roots


class Scene:
    """A workspace at ``root``."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.source = root / "src"
        self.source.mkdir(parents=True)
        self.devel = root / "devel"
        self.modules = self.devel / "lib" / "python3" / "dist-packages"

    def package(
        self, name: str, cmake: str = "", depends: str = "", files: dict[str, str] | None = None
    ) -> Path:
        """Write a package, given the text of its CMakeLists.txt, its dependencies and its files."""
        folder = self.source / name
        folder.mkdir(parents=True)
        tags = "".join(f"<depend>{depend}</depend>" for depend in depends.split())
        (folder / "package.xml").write_text(
            f'<package format="2"><name>{name}</name><version>0.0.1</version><description>d</description>'
            f'<maintainer email="a@b.org">a</maintainer><license>BSD</license>\n'
            f"<buildtool_depend>catkin</buildtool_depend>{tags}</package>"
        )
        (folder / "CMakeLists.txt").write_text(
            f"cmake_minimum_required(VERSION 3.0.2)\nproject({name})\n{cmake}\ncatkin_package()\n"
        )

        for path, text in (files or {}).items():
            file = folder / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)

        return folder

    def messages(self, name: str, files: dict[str, str], depends: str = "std_msgs") -> Path:
        """Write a package with definitions (``msg/A.msg``), each listed in its CMakeLists.txt."""
        lines = ["find_package(catkin REQUIRED COMPONENTS rospy message_generation)"]
        for kind, macro in (("msg", "message"), ("srv", "service"), ("action", "action")):
            names = [Path(file).name for file in files if file.startswith(f"{kind}/")]
            if names:
                lines.append(f"add_{macro}_files(FILES {' '.join(names)})")
        lines.append(f"generate_messages(DEPENDENCIES {depends})")
        return self.package(name, "\n".join(lines), f"rospy {depends}", files)

    def build(self, *chosen: str) -> dict[str, Report]:
        """Build the packages; return each package's report."""
        workspace = Workspace.at(self.root)
        reports: dict[str, Report] = {}
        build(
            workspace,
            read_plans(workspace.source),
            Packages.below(*built_in_roots()),
            chosen or None,
            lambda report: reports.__setitem__(report.plan.name, report),
        )
        write_set_up(workspace.devel, (workspace.source,), {})
        return reports


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    """Return an empty workspace, in a folder whose name has a space."""
    return Scene(tmp_path / "my ws")
