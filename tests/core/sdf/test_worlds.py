"""SDF worlds: includes, lights, physics, scene and state; a model that cannot be used is left out, and the rest is read."""

from __future__ import annotations

from pathlib import Path

import pytest

from minirospy.base.errors import SdfError
from minirospy.core.sdf.model import Physics, Pose, World
from minirospy.core.sdf.read import parse_model, parse_world

MODEL = '<model name="{}"><link name="link"/></model>'
SDF = '<sdf version="1.6">{}</sdf>'


class Library:
    """A folder of models. ``resolve`` finds them by model://."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def resolve(self, uri: str) -> str | None:
        path = self.folder / uri.removeprefix("model://")
        return str(path) if uri.startswith("model://") and path.exists() else None

    def add(self, name: str, text: str, file: str = "model.sdf", config: str | None = None) -> None:
        (self.folder / name).mkdir(exist_ok=True)
        (self.folder / name / file).write_text(text, encoding="utf-8")
        if config is not None:
            (self.folder / name / "model.config").write_text(config, encoding="utf-8")

    def read(self, body: str) -> World:
        return parse_world(SDF.format(f'<world name="w">{body}</world>'), self.resolve)


@pytest.fixture
def library(tmp_path: Path) -> Library:
    return Library(tmp_path)


def read(body: str, version: str = "1.6") -> World:
    return parse_world(f'<sdf version="{version}"><world name="w">{body}</world></sdf>')


class TestIncludes:
    def test_name_pose_static_and_plugins_are_the_includes(self, library: Library) -> None:
        library.add("box", SDF.format(MODEL.format("box")))
        world = library.read(
            """<include><uri>model://box</uri><name>mine</name><pose>1 2 3 0 0 0</pose><static>true</static>
            <plugin name="p" filename="libp.so"/></include><include><uri>model://box</uri></include>"""
        )
        first, second = world.models
        assert (first.name, first.pose.position, first.is_static) == ("mine", (1.0, 2.0, 3.0), True)
        assert [plugin.name for plugin in first.plugins] == ["p"]
        assert (second.name, second.pose, second.is_static) == ("box", Pose(), False)

    def test_the_newest_version_in_the_configuration_is_read(self, library: Library) -> None:
        config = """<model><sdf version="1.4">old.sdf</sdf><sdf version="1.6">new.sdf</sdf>
            <sdf version="9.9">future.sdf</sdf></model>"""
        library.add("box", SDF.format(MODEL.format("new")), "new.sdf", config)
        library.add("box", SDF.format(MODEL.format("old")), "old.sdf")
        world = library.read("<include><uri>model://box</uri></include>")
        assert [model.name for model in world.models] == ["new"]

    def test_the_included_files_version_counts_for_its_axes(self, library: Library) -> None:
        body = """<model name="m"><link name="a"/><link name="b"><pose>0 0 0 0 0 3.141592653589793</pose></link>
            <joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz></axis></joint>
            </model>"""
        library.add("old", f'<sdf version="1.4">{body}</sdf>')
        (model,) = library.read("<include><uri>model://old</uri></include>").models
        assert model.joints["j"].axis.xyz == pytest.approx((-1.0, 0.0, 0.0))

    def test_lights_can_be_included(self, library: Library) -> None:
        library.add(
            "sun", SDF.format('<light name="sun" type="directional"><pose>0 0 10 0 0 0</pose></light>')
        )
        (light,) = library.read("<include><uri>model://sun</uri></include>").lights
        assert (light.name, light.kind, light.pose.position) == ("sun", "directional", (0.0, 0.0, 10.0))

    def test_files_beside_an_included_file_are_found(self, library: Library) -> None:
        visual = '<visual name="v"><geometry><mesh><uri>meshes/a.stl</uri></mesh></geometry></visual>'
        library.add("box", SDF.format(f'<model name="m"><link name="a">{visual}</link></model>'))
        (library.folder / "box" / "meshes").mkdir()
        (library.folder / "box" / "meshes" / "a.stl").touch()
        (model,) = library.read("<include><uri>model://box</uri></include>").models
        path = model.links["a"].visuals[0].geometry[0]
        assert Path(str(path)).samefile(library.folder / "box" / "meshes" / "a.stl")

    def test_a_model_takes_static_from_the_model_that_it_includes(self, library: Library) -> None:
        library.add("wall", MODEL.format("wall").replace("</model>", "<static>true</static></model>"))
        include = "<include><uri>model://wall</uri></include>"
        own = "<static>false</static>"
        bodies = [include, f"{own}{include}", f"{include}{own}"]
        world = library.read("".join(f'<model name="m{i}">{body}</model>' for i, body in enumerate(bodies)))
        assert [model.is_static for model in world.models] == [True, False, True]

    def test_models_include_models(self, library: Library) -> None:
        library.add("wheel", SDF.format(MODEL.format("wheel")))
        body = """<link name="body"/><include><uri>model://wheel</uri><name>left</name><pose>0 1 0 0 0 0</pose></include>
            <joint name="j" type="revolute"><parent>body</parent><child>left::link</child></joint>"""
        library.add("car", SDF.format(f'<model name="car">{body}</model>'))
        (car,) = library.read("<include><uri>model://car</uri></include>").models
        assert car.links["left::link"].pose.position == (0.0, 1.0, 0.0)
        assert car.joints["j"].child == "left::link"

    def test_a_missing_part_of_a_model_is_named_and_the_rest_stays(self, library: Library) -> None:
        include = "<include><uri>model://typo</uri><name>left</name></include>"
        joint = '<joint name="j" type="fixed"><parent>body</parent><child>left::link</child></joint>'
        (car,) = library.read(f'<model name="car"><link name="body"/>{include}{joint}</model>').models
        assert list(car.links) == ["body"]
        assert car.warnings == (
            "world:1: model://typo does not exist, and is left out of model [car]",
            "world:1: joint [j] is left out: its child link [left::link] does not exist",
        )

    def test_a_missing_model_is_named_with_a_hint(self, library: Library) -> None:
        world = library.read(f"{MODEL.format('box')}\n<include><uri>model://typo</uri></include>")
        assert [model.name for model in world.models] == ["box"]
        assert world.warnings == (
            "include [model://typo] is left out: world:2: model://typo does not exist "
            "(add its folder to GAZEBO_MODEL_PATH)",
        )

    def test_a_folder_without_a_model_is_named(self, library: Library) -> None:
        (library.folder / "empty").mkdir()
        world = library.read("<include><uri>model://empty</uri></include>")
        assert "the folder has neither model.config nor model.sdf" in world.warnings[0]


class TestHarm:
    def test_cyclic_includes(self, library: Library) -> None:
        for name, other in (("a", "b"), ("b", "a")):
            body = f'<link name="l"/><include><uri>model://{other}</uri></include>'
            library.add(name, SDF.format(f'<model name="{name}">{body}</model>'))
        world = library.read(f"<include><uri>model://a</uri></include>{MODEL.format('box')}")
        assert [model.name for model in world.models] == ["box"]
        assert len(world.warnings) == 1
        assert "includes itself: a -> b -> a" in world.warnings[0]

    def test_a_world_that_includes_itself(self, library: Library) -> None:
        body = "<include><uri>model://me</uri></include>"
        library.add("me", SDF.format(f'<world name="w">{body}</world>'))
        path = library.folder / "me" / "model.sdf"
        world = parse_world(path.read_bytes(), library.resolve, file=str(path))
        assert "includes itself" in world.warnings[0]

    def test_a_bomb_of_includes(self, library: Library) -> None:
        for level in range(12):
            includes = "".join(
                f"<include><name>n{index}</name><uri>model://l{level + 1}</uri></include>"
                for index in range(10)
            )
            library.add(f"l{level}", SDF.format(f'<model name="l{level}"><link name="x"/>{includes}</model>'))
        library.add("l12", SDF.format(MODEL.format("l12")))
        body = f"{MODEL.format('box')}<include><uri>model://l0</uri></include>{MODEL.format('late') * 2}"
        world = parse_world(SDF.format(f"<world>{body}</world>"), library.resolve, max_parts=2000)
        assert [model.name for model in world.models] == ["box"]
        assert len(world.warnings) == 2
        assert "there are more than 2000 links, joints and models" in world.warnings[0]
        assert world.warnings[1].endswith("the models after it are left out, too")

    def test_a_deep_chain_of_includes(self, library: Library) -> None:
        for level in range(40):
            body = f'<link name="x"/><include><uri>model://l{level + 1}</uri></include>'
            library.add(f"l{level}", SDF.format(f'<model name="l{level}">{body}</model>'))
        world = library.read("<include><uri>model://l0</uri></include>")
        assert world.models == ()
        assert "more than 16 levels deep" in world.warnings[0]

    def test_warnings_have_a_limit(self) -> None:
        visuals = "".join(f'<visual name="v{index}"/>' for index in range(1000))
        (model,) = read(f'<model name="m"><link name="a">{visuals}</link></model>').models
        assert len(model.warnings) == 201
        assert model.warnings[-1] == "world: there are more than 200 warnings: the others are not listed"

    def test_thousands_of_models_with_the_same_name(self) -> None:
        world = read(MODEL.format("a") * 3000)
        assert world.models[-1].name == "a_2998"

    def test_entities_of_a_document_type(self) -> None:
        text = '<!DOCTYPE sdf [<!ENTITY a "aaaa">]><sdf version="1.6"><world name="&a;"/></sdf>'
        with pytest.raises(SdfError, match="the entity &a; is declared, and entities are not supported"):
            parse_world(text)

    @pytest.mark.parametrize(
        "broken",
        [
            '<model name="b"/>',
            '<model name="b"><link name="a"><pose>nan 0 0 0 0 0</pose></link></model>',
            '<model name="b"><link/></model>',
            '<model name="b"><pose>1</pose><link name="a"/></model>',
        ],
    )
    def test_a_broken_model_is_named_and_the_rest_stays(self, broken: str) -> None:
        world = read(MODEL.format("first") + broken + MODEL.format("last"))
        assert [model.name for model in world.models] == ["first", "last"]
        assert len(world.warnings) == 1
        assert world.warnings[0].startswith("model [b] is left out: world:1: ")

    @pytest.mark.parametrize(
        ("text", "why"),
        [
            ("", "world: the file is empty"),
            (
                "<sdf><world>",
                "world:1: not XML: no element found (column 12): <world> of line 1 is not closed, by /> or </world>",
            ),
            ("<gazebo:world/>", "world:1: the root is <gazebo:world>: <sdf> is expected"),
        ],
    )
    def test_text_that_is_not_sdf(self, text: str, why: str) -> None:
        with pytest.raises(SdfError) as caught:
            parse_world(text)
        assert str(caught.value) == why


class TestParts:
    def test_defaults(self) -> None:
        assert read("") == World("w")

    def test_physics(self) -> None:
        physics = """<physics type="ode"><max_step_size>0.01</max_step_size><real_time_factor>2</real_time_factor>
            <real_time_update_rate>0</real_time_update_rate><max_contacts>30</max_contacts><gravity>0 0 -1</gravity>
            <ode><solver><iters>70</iters><sor>1.4</sor></solver></ode></physics>"""
        assert read(physics).physics == Physics(0.01, 2.0, 0.0, (0, 0, -1), 70, 1.4, 30)
        assert read(f"{physics}<gravity>0 0 -2</gravity>").physics.gravity == (0, 0, -2)

    def test_the_default_profile_is_used(self) -> None:
        profiles = """<physics name="a"><max_step_size>0.1</max_step_size></physics>
            <physics name="b" default="1"><max_step_size>0.2</max_step_size></physics>"""
        assert read(profiles).physics.step == 0.2

    def test_a_step_that_is_not_possible_is_named(self) -> None:
        for step in ("0", "4e-10"):
            world = read(f"<physics><max_step_size>{step}</max_step_size></physics>")
            assert world.physics.step == 0.001
            assert world.warnings == (f"world:1: the step of {step} s is not possible: it is 0.001 s",)

    def test_an_infinite_number_of_iterations_is_named(self) -> None:
        world = read("<physics><ode><solver><iters>inf</iters></solver></ode></physics>")
        assert world.physics == Physics()
        assert "<iters> has an infinite number: 'inf'" in world.warnings[0]

    def test_scene_camera_lights_and_plugins(self) -> None:
        world = read(
            """<scene><ambient>0.1 0.2 0.3 1</ambient><background>0 0 0 1</background></scene>
            <gui><camera name="c"><pose>1 2 3 0 0 0</pose></camera></gui>
            <light name="lamp" type="spot"><pose>0 0 5 0 0 0</pose><cast_shadows>1</cast_shadows>
            <direction>0 0 -2</direction><diffuse>1 0 0 1</diffuse></light>
            <plugin name="p" filename="libown.so"/>"""
        )
        assert (world.ambient, world.background) == ((0.1, 0.2, 0.3, 1.0), (0.0, 0.0, 0.0, 1.0))
        assert world.camera == Pose((1.0, 2.0, 3.0))
        (light,) = world.lights
        assert (light.kind, light.casts_shadows, light.direction) == ("spot", True, (0.0, 0.0, -1.0))
        assert light.diffuse == (1.0, 0.0, 0.0, 1.0)
        assert [plugin.library for plugin in world.plugins] == ["own"]

    def test_the_state_moves_and_deletes(self) -> None:
        world = read(
            f"""{MODEL.format("a")}{MODEL.format("b")}<light name="l" type="point"/>
            <state world_name="w"><model name="a"><pose>1 2 3 0 0 0</pose><link name="link"/></model>
            <light name="l"><pose>0 0 9 0 0 0</pose></light>
            <deletions><name>b</name></deletions><insertions>{MODEL.format("c")}</insertions></state>"""
        )
        assert [(model.name, model.pose.position) for model in world.models] == [
            ("a", (1, 2, 3)),
            ("c", (0, 0, 0)),
        ]
        assert world.lights[0].pose.position == (0, 0, 9)

    def test_models_with_the_same_name_get_numbers(self) -> None:
        world = read(MODEL.format("a") * 3)
        assert [model.name for model in world.models] == ["a", "a_0", "a_1"]
        assert world.warnings == (
            "world:1: [a] exists already: this one is [a_0]",
            "world:1: [a] exists already: this one is [a_1]",
        )

    def test_what_is_not_simulated_is_named(self) -> None:
        assert read('<actor name="person"/>').warnings == ("world:1: actor [person] is not simulated",)

    def test_an_old_version_is_named(self) -> None:
        assert read("", "1.2").warnings == ("world:1: SDF 1.2 is older than 1.4: parts of it may be missing",)

    def test_a_file_of_models_is_a_world(self) -> None:
        world = parse_world(SDF.format(MODEL.format("a") + '<light name="l" type="point"/>'))
        assert [model.name for model in world.models] == ["a"]
        assert [light.name for light in world.lights] == ["l"]

    def test_the_first_model_of_a_world_is_read(self) -> None:
        text = SDF.format(f'<world name="w"><light name="l" type="point"/>{MODEL.format("a")}</world>')
        assert parse_model(text, name="other").name == "other"


class TestLenientText:
    @pytest.mark.parametrize(
        "text",
        [
            "<!-- first --><?xml version='1.0'?><sdf version='1.6'><world name='w'/></sdf>",
            "\n<?xml version=\"1\" ?><sdf version='1.6'><world name='w'/></sdf>",
            "<sdf version=1.6><world name=w><a b=c/></world></sdf>",
            "\ufeff<sdf version='1.6'><world name='w'/><!-- a -- b --></sdf>",
        ],
    )
    def test_what_gazebos_parser_accepts_is_read(self, text: str) -> None:
        assert parse_world(text).name == "w"

    def test_bytes_that_are_not_utf8(self) -> None:
        assert parse_world("<sdf version='1.6'><world name='\xe4'/></sdf>".encode("latin-1")).name == "\xe4"

    def test_lines_keep_their_numbers(self) -> None:
        world = parse_world(
            '<?xml version="1"?>\n<!--\n\n-->\n<sdf version="1.6"><world name="w">\n<actor/></world></sdf>'
        )
        assert world.warnings == ("world:6: <actor> is not simulated",)
