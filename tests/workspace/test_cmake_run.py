"""The evaluation of CMakeLists.txt: conditions, loops, variables and included files."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.base.errors import BuildError
from minirospy.workspace.cmake_run import Command, run_cmake


def run(folder: Path, text: str, **variables: str) -> list[Command]:
    (folder / "CMakeLists.txt").write_text(text, encoding="utf-8")
    return list(run_cmake(folder / "CMakeLists.txt", variables))


def said(folder: Path, text: str, **variables: str) -> list[str]:
    """Return the arguments of each `f(...)` that is run, joined to a string."""
    return [" ".join(each.arguments) for each in run(folder, text, **variables) if each.name == "f"]


def test_variables(tmp_path: Path) -> None:
    text = (
        'project(p)\nset(F a b)\nset(G "c;d")\n'
        'f(${F} ${G} "${F}" ${PROJECT_NAME}_x ${nobody} ${P}/y $ENV{HOME} "\\${F}" [[${F}]])'
    )
    (command,) = [each for each in run(tmp_path, text, P="lib", **{"ENV{HOME}": "h"}) if each.name == "f"]
    assert command.arguments == ("a", "b", "c", "d", "a;b", "p_x", "lib/y", "h", "${F}", "${F}")
    assert (command.line, command.file) == (4, tmp_path / "CMakeLists.txt")


def test_a_variable_in_the_name_of_another(tmp_path: Path) -> None:
    assert said(tmp_path, "project(p)\nf(${${PROJECT_NAME}_SOURCE_DIR})") == [tmp_path.as_posix()]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ('set(X a CACHE STRING "what for")\nlist(APPEND X b c)', "a b c"),
        ("list(APPEND X d)", "d"),
        ("set(X c a b a)\nlist(REMOVE_DUPLICATES X)\nlist(SORT X)\nlist(REVERSE X)", "c b a"),
        ("set(X a b c)\nlist(REMOVE_ITEM X b)\nlist(PREPEND X z)", "z a c"),
        ('set(X a.msg b.srv)\nlist(FILTER X EXCLUDE REGEX "\\\\.srv$")', "a.msg"),
        ("set(L a b)\nlist(LENGTH L X)", "2"),
        ("set(X a)\nunset(X)", ""),
        ("set(X a)\nset(X)", ""),
        ('option(X "what" ON)', "ON"),
        ('option(GIVEN "what" OFF)\nset(X ${GIVEN})', "yes"),
        ('set(GIVEN no CACHE BOOL "")\nset(X ${GIVEN})', "yes"),
        ("string(TOUPPER abc X)", "ABC"),
        ("string(REPLACE . _ X a.b.c)", "a_b_c"),
        ('string(REGEX REPLACE "^a(.)" "<\\\\1>" X abc)', "<b>c"),
        ("string(CONCAT X a b)\nstring(APPEND X c)", "abc"),
        ("get_filename_component(X some/file.tar.gz NAME)", "file.tar.gz"),
        ("get_filename_component(X some/file.tar.gz NAME_WE)", "file"),
        ("get_filename_component(X some/file.tar.gz DIRECTORY)", "some"),
    ],
)
def test_commands_that_set_a_variable(tmp_path: Path, text: str, value: str) -> None:
    assert said(tmp_path, f"{text}\nf(${{X}})", GIVEN="yes") == [value]


@pytest.mark.parametrize(
    ("condition", "holds"),
    [
        *((text, True) for text in ("1", "ON", "yes", "TRUE", "Y", "42", "SET", '"1"')),
        *(
            (text, False)
            for text in ("0", "off", "NO", "FALSE", "N", "IGNORE", "NOTFOUND", '""', "NOBODY", "OFFED")
        ),
        *((text, False) for text in ('"SET"', "X-NOTFOUND", "${NOBODY}", "${NOBODY} AND SET", "NOT 1")),
        *((text, True) for text in ("NOT NOBODY", "NOT ${NOBODY}", "SET AND NOT NOBODY", "NOBODY OR SET")),
        ("NOBODY AND 1 OR 1", True),
        ("NOBODY AND (1 OR 1)", False),
        ("1 OR 1 AND 0", False),
        ("-1.5 AND NOT 0.0 AND NOT N", True),
        ("NOT (SET AND NOBODY)", True),
        ("DEFINED SET AND NOT DEFINED NOBODY", True),
        ('SET STREQUAL "text"', True),
        ('"SET" STREQUAL "text"', False),
        ("${NOBODY} STREQUAL text", False),
        ("3 GREATER 2 AND 2 LESS_EQUAL 2 AND NOT x EQUAL 0", True),
        ("1.2.10 VERSION_GREATER 1.2.9 AND 3 VERSION_EQUAL 3.0.0", True),
        ('text MATCHES "^te.t$"', True),
        ("a STRLESS b", True),
        ("two IN_LIST LIST", True),
        ("three IN_LIST LIST", False),
        ("EXISTS ${HERE}/CMakeLists.txt AND IS_DIRECTORY ${HERE}", True),
        ("EXISTS ${HERE}/nothing OR EXISTS ${NOBODY}", False),
        ("$ENV{ROS_VERSION} EQUAL 1", True),
        ("catkin_FOUND AND rospy_FOUND AND NOT Boost_FOUND", True),
        ("rostest_FOUND AND NOT roslaunch_FOUND", True),
        ("IS_ABSOLUTE ${HERE} AND NOT IS_ABSOLUTE cmake AND NOT IS_SYMLINK ${HERE}", True),
        ("a IS_NEWER_THAN b", True),
        ("TARGET p_generate_messages AND NOT TARGET tests", True),
    ],
)
def test_conditions(tmp_path: Path, condition: str, holds: bool) -> None:
    text = (
        "find_package(catkin REQUIRED COMPONENTS rospy)\nfind_package(Boost QUIET)\nfind_package(rostest)\n"
        "set(SET text)\nset(OFFED off)\nset(N 1)\n"
        f"set(LIST one two)\nif({condition})\n f(yes)\nelse()\n f(no)\nendif()"
    )
    environment = {"ENV{ROS_VERSION}": "1", "HERE": tmp_path.as_posix()}
    assert said(tmp_path, text, **environment) == ["yes" if holds else "no"]


def test_the_first_branch_that_holds(tmp_path: Path) -> None:
    text = "if({})\n f(a)\n f(b)\nelseif({})\n f(c)\nelseif(1)\n f(d)\nelse()\n f(e)\nendif()"
    assert said(tmp_path, text.format(1, 1)) == ["a", "b"]
    assert said(tmp_path, text.format(0, 1)) == ["c"]
    assert said(tmp_path, text.format(0, 0)) == ["d"]


def test_loops(tmp_path: Path) -> None:
    text = (
        "set(L x y)\nforeach(T a b)\n f(${T})\n foreach(U IN LISTS L ITEMS z)\n  f(${T}${U})\n endforeach()\n"
        "endforeach(T)\nforeach(N RANGE 2)\n f(${N})\nendforeach()\nforeach(N RANGE 4 8 2)\n f(${N})\nendforeach()"
    )
    assert said(tmp_path, text) == ["a", "ax", "ay", "az", "b", "bx", "by", "bz", *"012468"]
    text = "foreach(T a b c d)\n if(T STREQUAL b)\n continue()\n elseif(T STREQUAL d)\n break()\n endif()\n f(${T})\nendforeach()"
    assert said(tmp_path, text) == ["a", "c"]


@pytest.mark.parametrize("stop", ["100000", "9999999999999999999"])
def test_loop_over_too_many_numbers_is_refused(tmp_path: Path, stop: str) -> None:
    with pytest.raises(BuildError, match=r"foreach\(\): RANGE has .* numbers, at most 100000 are read"):
        said(tmp_path, f"foreach(N RANGE {stop})\n f(${{N}})\nendforeach()")


def test_macros(tmp_path: Path) -> None:
    """A macro's body runs only when it is called, and the call passes its arguments."""
    text = (
        "macro(Twice A)\n f(${A} ${ARGN} ${ARGC})\nendmacro()\n"
        "function(unused)\n f(unused)\nendfunction()\ntwice(a b c)\nTWICE(d)\nf(${A}.)"
    )
    assert said(tmp_path, text) == ["a b c 3", "d 1", "."]


def test_macro_sets_the_variable_that_an_argument_names(tmp_path: Path) -> None:
    """A macro's arguments are not variables, so `${NAME}` remains the argument even after a set() of that name."""
    text = (
        'macro(Find NAME KIND)\n set(NAME "")\n set(INNER ${KIND})\n'
        " foreach(P IN ITEMS ${ARGN})\n  if(${KIND} STREQUAL k)\n   list(APPEND NAME x${P})\n  endif()\n endforeach()\n"
        " set(${NAME}_ALL ${NAME})\nendmacro()\nfind(NAME k a b)\nf(${NAME} ${INNER} ${NAME_ALL})\nfind(OTHER k c)\n"
        "f(${NAME} ${OTHER} ${OTHER_ALL})"
    )
    assert said(tmp_path, text) == ["xa xb k NAME", "xc OTHER"]


def test_function_has_variables_of_its_own(tmp_path: Path) -> None:
    text = (
        'function(find NAME)\n set(NAME "")\n foreach(P IN LISTS ARGN)\n  list(APPEND NAME x${P})\n endforeach()\n'
        " set(INNER 1)\n set(FOUND ${NAME} PARENT_SCOPE)\n f(${FOUND}.)\nendfunction()\n"
        "find(FOUND a b)\nf(${FOUND} ${NAME} ${INNER})"
    )
    assert said(tmp_path, text) == [".", "xa xb"]


def test_subdirectory_sets_variables_of_its_parent(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "CMakeLists.txt").write_text("set(A in PARENT_SCOPE)\nset(B in)\nf(${A})")
    text = "project(p)\nset(A out)\nset(B out)\nadd_subdirectory(sub)\nf(${A} ${B})"
    assert said(tmp_path, text) == ["out", "in out"]


def test_return_ends_the_file(tmp_path: Path) -> None:
    (tmp_path / "more.cmake").write_text("f(more)\nreturn()\nf(never)")
    assert said(tmp_path, "include(more.cmake)\nf(a)\nif(1)\n return()\nendif()\nf(b)") == ["more", "a"]


def test_return_in_a_macro_ends_its_caller(tmp_path: Path) -> None:
    """Macros are text, as in CMake: return() ends the function that called the macro, or else the file."""
    text = (
        "macro(leave)\n f(leaves)\n return()\nendmacro()\nfunction(g)\n leave()\n f(never)\nendfunction()\n"
        "g()\nf(goes on)\nforeach(I 1 2)\n leave()\nendforeach()\nf(never)"
    )
    assert said(tmp_path, text) == ["leaves", "goes on", "leaves"]


def test_own_module_of_find_package(tmp_path: Path) -> None:
    (tmp_path / "cmake").mkdir()
    (tmp_path / "cmake" / "FindFoo.cmake").write_text(
        "set(FOO_LIB x)\nmacro(of_foo)\n f(macro)\nendmacro()\n"
        "find_package_handle_standard_args(Foo DEFAULT_MSG FOO_LIB)"
    )
    text = (
        "list(APPEND CMAKE_MODULE_PATH ${CMAKE_CURRENT_SOURCE_DIR}/cmake)\nfind_package(Foo QUIET)\n"
        "f(${Foo_FOUND} ${FOO_FOUND} ${FOO_LIB})\nof_foo()\nfind_package(Bar QUIET)\nf(${Bar_FOUND}.)"
    )
    variables = {"CMAKE_CURRENT_SOURCE_DIR": tmp_path.as_posix()}
    assert said(tmp_path, text, **variables) == ["TRUE TRUE x", "macro", "."]


@pytest.mark.parametrize(
    "search", ["find_package(Eigen3)", "pkg_check_modules(EIGEN3 eigen3)", "pkg_search_module(EIGEN3 eigen3)"]
)
def test_missing_library_does_not_end_the_file(tmp_path: Path, search: str) -> None:
    """Nothing is compiled with the library; only what the file says about Python matters."""
    text = f"{search}\nif(NOT EIGEN3_FOUND)\n return()\nendif()\nf(goes on)"
    assert said(tmp_path, text) == ["goes on"]


def test_ros_2_is_not_found(tmp_path: Path) -> None:
    text = "find_package(ament_cmake)\nif(ament_cmake_FOUND)\n f(ros2)\nelse()\n f(ros1)\nendif()"
    assert said(tmp_path, text) == ["ros1"]


def test_other_files(tmp_path: Path) -> None:
    (tmp_path / "cmake").mkdir()
    (tmp_path / "cmake" / "own.cmake").write_text("set(OWN ${CMAKE_CURRENT_LIST_DIR})\nf(own)")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "CMakeLists.txt").write_text("project(other)\nf(${OWN} ${PROJECT_NAME})\nset(OWN x)")
    text = (
        "project(p)\nset(CMAKE_MODULE_PATH ${PROJECT_SOURCE_DIR}/cmake)\ninclude(own)\ninclude(GNUInstallDirs)\n"
        "add_subdirectory(sub)\nf(${OWN} ${PROJECT_NAME})"
    )
    commands = [each for each in run(tmp_path, text) if each.name == "f"]
    place = (tmp_path / "cmake").as_posix()
    assert [each.arguments for each in commands] == [("own",), (place, "other"), (place, "p")]
    assert [each.folder for each in commands] == [tmp_path, tmp_path / "sub", tmp_path]
    assert [each.file.name for each in commands] == ["own.cmake", "CMakeLists.txt", "CMakeLists.txt"]


def test_files_by_pattern(tmp_path: Path) -> None:
    folder = tmp_path / "a [b] ü"
    for name in ("msg/B.msg", "msg/A.msg", "msg/deep/C.msg", "srv/S.srv"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
    variables = {"CMAKE_CURRENT_SOURCE_DIR": folder.as_posix()}
    here = "${CMAKE_CURRENT_SOURCE_DIR}"
    for glob, names in {
        f'file(GLOB X RELATIVE "{here}/msg" "{here}/msg/*.msg")': "A.msg B.msg",
        f'FILE(GLOB X RELATIVE "{here}" CONFIGURE_DEPENDS msg/[A]*.msg srv/*)': "msg/A.msg srv/S.srv",
        f'file(GLOB_RECURSE X RELATIVE "{here}" LIST_DIRECTORIES false *.msg)': "msg/A.msg msg/B.msg msg/deep/C.msg",
        "file(GLOB X srv/*)": f"{folder.as_posix()}/srv/S.srv",
        "file(GLOB X nothing/*)": "",
        "file(GLOB_RECURSE X ${NOBODY}/*)": "",
    }.items():
        assert said(folder, f"{glob}\nf(${{X}})", **variables) == [names]


@given(st.text('afi()[]="#\\ \n;$ {}', max_size=40))
def test_any_text_is_run_or_refused(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    folder = tmp_path_factory.getbasetemp()
    with contextlib.suppress(BuildError):
        run(folder, text)
