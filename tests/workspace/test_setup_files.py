"""devel/setup.bash and similar files in real shells: variables, chains of workspaces, and the workshop's chapter."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from minirospy.workspace.build import write_set_up
from minirospy.workspace.packages import built_in_roots
from minirospy.workspace.setup_files import SetUp, assignments, setup_files

if TYPE_CHECKING:
    from conftest import Scene

BIN = Path(sys.executable).parent
NAMES = ("ROS_PACKAGE_PATH", "PYTHONPATH", "CMAKE_PREFIX_PATH", "ROS_DISTRO", "ROS_MASTER_URI", "ROS_VERSION")
OURS = ":".join(map(str, built_in_roots()))

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="shells of Unix")


def run(shell: str, script: str, home: Path, **variables: str) -> str:
    """Return a shell's output; assert that stderr is empty."""
    program = shutil.which(shell)
    if program is None:
        pytest.skip(f"no {shell} here")
    done = subprocess.run(
        [program, *(["--norc"] if shell == "bash" else ["-f"] if shell == "zsh" else []), "-c", script],
        env={"PATH": f"{BIN}:{os.environ['PATH']}", "HOME": str(home), **variables},
        capture_output=True,
        text=True,
        check=False,
        cwd=home,
    )
    assert (done.returncode, done.stderr) == (0, ""), done
    return done.stdout


def variables(shell: str, script: str, home: Path, **given: str) -> dict[str, str]:
    """Return the environment variables after a script has run."""
    said = run(shell, f"{script}\nenv", home, **given)
    found = dict(line.split("=", 1) for line in said.splitlines() if "=" in line)
    return {name: found[name] for name in NAMES if name in found}


SHELLS = [
    pytest.param("bash", "bash", id="bash"),
    pytest.param("zsh", "zsh", id="zsh"),
    pytest.param("sh", "sh", id="sh"),
    pytest.param("fish", "fish", id="fish"),
]


@pytest.mark.parametrize(("shell", "ending"), SHELLS)
def test_assignments_are_read_by_the_shell(shell: str, ending: str, tmp_path: Path) -> None:
    values = {"ONE": "http://pi:11311", "TWO": "it's $HOME & \\ `id`", "THREE": ""}
    code = assignments(ending, values)
    # printenv shows what the programs started from the shell receive.
    script = code + "printenv ONE\nprintenv TWO\nprintenv THREE\n"
    assert run(shell, script, tmp_path).split("\n") == [*values.values(), ""]


@pytest.mark.parametrize(("shell", "ending"), SHELLS)
def test_the_variables(scene: Scene, shell: str, ending: str) -> None:
    scene.build()
    expected = {
        "ROS_PACKAGE_PATH": f"{scene.source}:{OURS}",
        "PYTHONPATH": str(scene.modules),
        "CMAKE_PREFIX_PATH": str(scene.devel),
        "ROS_DISTRO": "noetic",
        "ROS_MASTER_URI": "http://localhost:11311",
        "ROS_VERSION": "1",
    }
    once = f". '{scene.devel}/setup.{ending}'"
    assert variables(shell, once, scene.root) == expected
    # Sourcing it twice adds nothing further.
    assert variables(shell, f"{once}\n{once}", scene.root) == expected


EVIL = "a'b\"c$(touch OWNED)`touch OWNED`;touch OWNED\\'; touch OWNED; '"


@pytest.mark.parametrize(("shell", "ending"), SHELLS)
def test_name_of_a_folder_is_never_code(scene: Scene, shell: str, ending: str) -> None:
    evil = type(scene)(scene.root / EVIL)
    evil.build()
    above = type(scene)(scene.root / "above")
    above.build()
    write_set_up(above.devel, (above.source,), {"CMAKE_PREFIX_PATH": str(evil.devel)})
    script = f". \"$SETUP_FILE\"\n. '{above.devel}/setup.{ending}'"
    found = variables(shell, script, scene.root, SETUP_FILE=str(evil.devel / f"setup.{ending}"))
    assert found["CMAKE_PREFIX_PATH"] == f"{above.devel}:{evil.devel}"
    assert not list(scene.root.rglob("OWNED"))


def test_paths_are_words_of_fish() -> None:
    folder = Path("/a'b\\' c")
    text = setup_files(SetUp(folder, (folder,), (folder,), folder, (folder,), folder))["setup.fish"]
    assert "_minirospy_workspace '/a\\'b\\\\\\' c' put" in text
    assert "/a'b" not in text.replace("/a\\'b", "")


def test_run_instead_of_sourced(scene: Scene) -> None:
    scene.build()
    file = str(scene.devel / "setup.bash")
    done = subprocess.run(["bash", file], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == (
        "",
        f"a program sets nothing in your terminal; type: source '{file}'\n",
    )


def test_sourced_file_whose_path_is_argument_zero(scene: Scene) -> None:
    scene.build()
    script = 'set -eu; source "$0"; echo "$ROS_PACKAGE_PATH"'
    done = subprocess.run(
        ["bash", "-c", script, str(scene.devel / "setup.bash")], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(str(scene.source))


@pytest.mark.parametrize(("shell", "ending"), SHELLS)
def test_variables_set_before_stay(scene: Scene, shell: str, ending: str) -> None:
    scene.build()
    given = {"PYTHONPATH": "/a:/b c", "ROS_MASTER_URI": "http://robot:1", "ROS_PACKAGE_PATH": "/x"}
    found = variables(shell, f". '{scene.devel}/setup.{ending}'", scene.root, **given)
    assert found["PYTHONPATH"] == f"{scene.modules}:/a:/b c"
    assert found["ROS_MASTER_URI"] == "http://robot:1"
    assert found["ROS_PACKAGE_PATH"] == f"{scene.source}:/x:{OURS}"


@pytest.mark.parametrize(("shell", "ending"), SHELLS)
def test_workspaces_stand_on_one_another(scene: Scene, shell: str, ending: str) -> None:
    scene.build()
    above = type(scene)(scene.root / "above")
    above.build()
    write_set_up(above.devel, (above.source,), {"CMAKE_PREFIX_PATH": str(scene.devel)})
    # The chain keeps the first workspace after a build in a shell that has not sourced it.
    write_set_up(above.devel, (above.source,), {})
    both = variables(shell, f". '{above.devel}/setup.{ending}'", scene.root)
    assert both["CMAKE_PREFIX_PATH"] == f"{above.devel}:{scene.devel}"
    assert both["ROS_PACKAGE_PATH"] == f"{above.source}:{scene.source}:{OURS}"
    assert both["PYTHONPATH"] == f"{above.modules}:{scene.modules}"
    script = f". '{above.devel}/setup.{ending}'\n. '{scene.devel}/setup.{ending}'"
    assert variables(shell, script, scene.root)["PYTHONPATH"] == str(scene.modules)


@pytest.mark.parametrize("file", ["setup.bash' --extend '", "local_setup.bash", "local_setup.sh"])
def test_extend_keeps_the_workspace_before(scene: Scene, file: str) -> None:
    scene.build()
    other = type(scene)(scene.root / "other")
    other.build()
    script = f". '{other.devel}/setup.bash'\n_minirospy_prefix='{scene.devel}'\n. '{scene.devel}/{file}'"
    assert variables("bash", script, scene.root)["PYTHONPATH"] == f"{scene.modules}:{other.modules}"


def test_a_workspace_may_move(scene: Scene) -> None:
    scene.build()
    scene.devel.rename(scene.root / "moved")
    found = variables("bash", f". '{scene.root}/moved/setup.bash'", scene.root)
    assert found["CMAKE_PREFIX_PATH"] == str(scene.root / "moved")


def test_env_sh_runs_a_command(scene: Scene) -> None:
    scene.build()
    assert run("sh", f"'{scene.devel}/env.sh' printenv PYTHONPATH", scene.root) == f"{scene.modules}\n"


def test_hooks_are_sourced(scene: Scene) -> None:
    scene.build()
    hooks = scene.devel / "etc" / "catkin" / "profile.d"
    hooks.mkdir(parents=True)
    (hooks / "10.mine.sh").write_text("export MINE=yes\n")
    assert run("bash", f". '{scene.devel}/setup.bash'; echo $MINE", scene.root) == "yes\n"


def test_the_commands_are_found_without_an_activated_environment(scene: Scene) -> None:
    scene.build()
    said = run("bash", f". '{scene.devel}/setup.bash'; command -v rosrun", scene.root, PATH="/usr/bin:/bin")
    assert Path(said.strip()).name == "rosrun"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_minirospy_shell(tmp_path: Path, shell: str) -> None:
    evaluate = "minirospy shell fish | source" if shell == "fish" else f'eval "$(minirospy shell {shell})"'
    said = run(shell, f"{evaluate}\nroscd std_msgs; pwd; echo $ROS_DISTRO", tmp_path)
    assert said == f"{built_in_roots()[0] / 'std_msgs'}\nnoetic\n"


WORKSHOP = r"""
cd
mkdir catkin_ws
cd catkin_ws
mkdir src
catkin_make
cd devel
source setup.bash
echo "source ~/catkin_ws/devel/setup.bash" >> ~/.bashrc
source ~/.bashrc
cd ~/catkin_ws/src
catkin_create_pkg rpi_test rospy std_msgs
cd ..
catkin_make
roscd rpi_test
mkdir scripts
cd scripts
cat > my_first_node.py << 'END'
#!/usr/bin/env python
import rospy
if __name__ == '__main__':
    print('Exit now')
END
chmod +x my_first_node.py
rosrun rpi_test my_first_node.py
roscd
cd ..
cd src
catkin_create_pkg rpi_feros_bringup
catkin_create_pkg rpi_msgs rospy std_msgs
cd ..
catkin_make
roscd rpi_msgs
mkdir msg srv action
cat > msg/ledStatus.msg << 'END'
int64 ledNumber
string ledStatus
END
cat > srv/safetyZone.srv << 'END'
int16 zone
---
bool success
string message
END
cat > action/runningLed.action << 'END'
# goal
int16 numberOfRuns
---
# result
int16 finalRun
---
# feedback
int16 currentRun
END
python edit.py
cd ~/catkin_ws
catkin_make
rosmsg show rpi_msgs/ledStatus
rossrv show rpi_msgs/safetyZone
rosmsg md5 ledStatus
python -c "from rpi_msgs.msg import ledStatus, runningLedAction; from rpi_msgs.srv import safetyZone
print(ledStatus._md5sum, safetyZone._md5sum, runningLedAction._md5sum)"
"""

EDIT = """
import re
text = open("package.xml").read()
lines = "<build_depend>message_generation</build_depend><exec_depend>message_runtime</exec_depend>"
lines += "<build_depend>actionlib_msgs</build_depend>"
open("package.xml", "w").write(text.replace("  <export>", lines + "  <export>"))
text = open("CMakeLists.txt").read()
text = text.replace("  std_msgs\\n)", "  std_msgs\\n  message_generation\\n  actionlib_msgs\\n)", 1)
macros = '''
add_message_files(
  FILES
  ledStatus.msg
)
add_service_files(
FILES
safetyZone.srv
)
add_action_files(
FILES
runningLed.action
)
generate_messages(
DEPENDENCIES
std_msgs
actionlib_msgs
)
catkin_package(
# INCLUDE_DIRS include
# LIBRARIES my_robot_msgs
CATKIN_DEPENDS rospy std_msgs message_runtime
'''
open("CMakeLists.txt", "w").write(text.replace("catkin_package(\\n", macros, 1))
"""


def test_the_workshop_word_for_word(tmp_path: Path) -> None:
    """Run the chapters on workspaces, packages, nodes and messages in bash."""
    (tmp_path / ".bashrc").write_text("")
    (tmp_path / "edit.py").write_text(EDIT)
    said = run("bash", WORKSHOP.replace("edit.py", "~/edit.py"), tmp_path)
    root = tmp_path / "catkin_ws"
    assert f"There are no packages in {root / 'src'} yet\n" in said
    assert "Created file rpi_test/package.xml\nCreated file rpi_test/CMakeLists.txt\n" in said
    assert "Exit now\n" in said
    assert "] rpi_msgs: 1 message, 1 service, 1 action\n" in said
    assert said.endswith(
        "int64 ledNumber\nstring ledStatus\n\nint16 zone\n---\nbool success\nstring message\n\n"
        "[rpi_msgs/ledStatus]: ae9bed52aabba7ce5ecb3ffd3198f36e\n"
        "ae9bed52aabba7ce5ecb3ffd3198f36e 2cf7256a6a834010475f5aab98d139f1 cda9af6ccaf743d766e051f587fc5391\n"
    )
