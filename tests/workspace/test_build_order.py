"""The build order of packages."""

from __future__ import annotations

from pathlib import Path

import pytest

from minirospy.workspace.build_order import build_order
from minirospy.workspace.dependencies import CircularDependencyError
from minirospy.workspace.manifest import Manifest, parse_manifest


def manifest(name: str, *tags: str) -> Manifest:
    """Return a package.xml in format 2; a tag such as ``exec:other`` stands for ``<exec_depend>other</exec_depend>``."""
    needs = [
        (f"{kind}_depend".strip("_"), other)
        for kind, _, other in (tag.partition(":") for tag in tags)
        if other
    ]
    depends = "".join(f"<{tag}>{other}</{tag}>" for tag, other in needs)
    exports = "".join(f"<{tag}/>" for tag in tags if ":" not in tag)
    return parse_manifest(
        f'<package format="2"><name>{name}</name><version>1.0.0</version><description>d</description>'
        f'<maintainer email="a@b.c">m</maintainer><license>BSD</license>{depends}<export>{exports}</export></package>',
        Path(name),
    )


def order(*manifests: Manifest, **also: list[str]) -> str:
    return " ".join(build_order({each.name: each for each in manifests}, also))


def test_packages_that_need_nothing_come_by_name() -> None:
    assert order(manifest("c"), manifest("a"), manifest("b", "build:not_here")) == "a b c"


@pytest.mark.parametrize("kind", ["build", "buildtool", "test", ""])
def test_a_package_comes_after_what_it_is_built_from(kind: str) -> None:
    assert order(manifest("a", f"{kind}:b"), manifest("b")) == "b a"


@pytest.mark.parametrize("kind", ["exec", "build_export", "doc"])
def test_run_time_dependencies_may_be_built_later(kind: str) -> None:
    assert order(manifest("a", f"{kind}:b"), manifest("b")) == "a b"


def test_a_package_comes_after_what_its_build_dependency_runs_with() -> None:
    packages = [manifest("a", "build:c"), manifest("b", "exec:d"), manifest("c", "exec:b"), manifest("d")]
    assert order(*packages) == "b c d a"


def test_the_first_by_name_is_next_as_soon_as_it_is_free() -> None:
    assert order(manifest("a", "build:c"), manifest("b", "build:e"), *map(manifest, "cde")) == "c a d e b"


def test_message_generators_and_what_they_need_come_first() -> None:
    packages = [manifest("a"), manifest("gen", "message_generator", "build:lib"), manifest("lib")]
    assert order(*packages) == "lib gen a"


def test_further_needs_of_the_caller_count() -> None:
    assert order(manifest("a"), manifest("b"), a=["b", "not_here"]) == "b a"


def test_a_cycle_names_its_packages_in_the_order_of_their_needs() -> None:
    packages = [manifest("x"), manifest("c", "build:a"), manifest("a", "build:b"), manifest("b", "build:c")]
    with pytest.raises(CircularDependencyError) as raised:
        order(*packages)
    assert raised.value.circle == ("a", "b", "c", "a")


def test_a_cycle_through_what_others_run_with_is_named_whole() -> None:
    packages = [manifest("a", "build:c"), manifest("b", "exec:a"), manifest("c", "exec:b")]
    with pytest.raises(CircularDependencyError) as raised:
        order(*packages)
    assert raised.value.circle == ("a", "c", "b", "a")


def test_a_package_that_needs_itself_is_a_cycle() -> None:
    with pytest.raises(CircularDependencyError) as raised:
        order(manifest("a", "build:a"))
    assert raised.value.circle == ("a", "a")


def test_a_long_chain_has_no_limit() -> None:
    count = 3000
    chain = [manifest(f"p{index}", f"build:p{index + 1}") for index in range(count)]
    assert order(*chain).startswith(f"p{count - 1} p{count - 2} ")
