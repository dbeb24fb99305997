"""Mesh files of each format, and broken ones."""

from __future__ import annotations

import random
import struct
from pathlib import Path

import numpy as np
import pytest

from minirospy.core.meshes.collada import parse_dae
from minirospy.core.meshes.errors import MeshError
from minirospy.core.meshes.files import read_mesh
from minirospy.core.meshes.obj import parse_mtl, parse_obj
from minirospy.core.meshes.stl import parse_stl

CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]


def binary_stl(header: bytes = b"") -> bytes:
    data = header.ljust(80, b"\0") + struct.pack("<I", len(FACES))
    for face in FACES:
        data += struct.pack("<12fH", 0, 0, 0, *(value for index in face for value in CORNERS[index]), 0)
    return data


def ascii_stl() -> bytes:
    lines = ["solid pyramid"]
    for face in FACES:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(map(str, CORNERS[index])) for index in face]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid pyramid"]).encode()


@pytest.mark.parametrize(
    "data", [binary_stl(), binary_stl(b"solid of CAD"), binary_stl() + b"tail", ascii_stl()]
)
def test_stl(data: bytes) -> None:
    mesh = parse_stl(data)

    assert len(mesh.vertices) == 4
    found = mesh.vertices[mesh.triangles]
    assert found.tolist() == [[list(CORNERS[index]) for index in face] for face in FACES]


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "shorter than a header"),
        (binary_stl()[:-1], "incomplete: 3 of 4 triangles"),
        (bytes(84), "there are no triangles"),
        (bytes(80) + b"\xff\xff\xff\x7f", "incomplete: 0 of 2147483647"),
        (ascii_stl().replace(b"vertex 1.0 0.0 0.0", b"vertex 1.0 zero 0.0", 1), "is not three numbers"),
        (ascii_stl().replace(b"vertex 1.0 0.0 0.0", b"", 1), "11 vertices are not triangles"),
        (binary_stl()[:96] + b"\0\0\xc0\x7f" + binary_stl()[100:], "not a finite number"),
    ],
)
def test_broken_stl_is_one_clear_error(data: bytes, text: str) -> None:
    with pytest.raises(MeshError, match=text):
        parse_stl(data)


OBJ = """
# a table
mtllib table.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1 0.5 0.5 0.5
o top
usemtl wood
f 1/1/1 2/2/1 3//1 4
o leg
usemtl steel
f -5 -4 -1
usemtl unknown
f 2 3 5
"""

MTL = """newmtl wood
Kd 0.6 0.4 0.2
map_Kd wood.png
newmtl steel
Kd 0.5 0.5 0.5
d 0.25
"""


def test_obj_has_objects_and_colours() -> None:
    top, leg = parse_obj(OBJ, lambda name: MTL if name == "table.mtl" else "")

    assert (top.name, leg.name) == ("top", "leg")
    assert top.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert leg.triangles.tolist() == [[0, 1, 4], [1, 2, 4]]
    assert [(triangles.tolist(), color) for triangles, color in top.by_material()] == [
        ([[0, 1, 2], [0, 2, 3]], (0.6, 0.4, 0.2, 1.0))
    ]
    assert [color for _, color in leg.by_material()] == [(0.5, 0.5, 0.5, 0.25), None]
    assert top.materials[0].texture == "wood.png"


def test_mtl_ignores_lines_that_are_broken() -> None:
    assert parse_mtl("newmtl a\nKd red\nd\nKd 1 1 1\n")["a"].color == (1.0, 1.0, 1.0, 1.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no faces"),
        ("v 0 0 0\nf 1 2 3\n", "line 2 of this OBJ file is invalid: 'f 1 2 3'"),
        ("v 0 0\n", "line 1 of this OBJ file is invalid"),
        ("v 0 0 x\n", "line 1 of this OBJ file is invalid"),
        ("v 0 0 0\nf 1 1\n", "line 2"),
        ("v 0 0 0\nf 0 0 0\n", "line 2"),
        ("v nan 0 0\nf 1 1 1\n", "not a finite number"),
    ],
)
def test_broken_obj_is_one_clear_error(text: str, message: str) -> None:
    with pytest.raises(MeshError, match=message):
        parse_obj(text)


DAE = """<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="millimeter" meter="0.001"/><up_axis>Y_UP</up_axis></asset>
  <library_effects><effect id="red-fx"><profile_COMMON><technique sid="t"><phong>
    <diffuse><color>1 0 0 1</color></diffuse></phong></technique></profile_COMMON></effect></library_effects>
  <library_materials><material id="red"><instance_effect url="#red-fx"/></material></library_materials>
  <library_geometries>
    <geometry id="g"><mesh>
      <source id="p"><float_array id="a" count="12">0 0 0 1000 0 0 1000 1000 0 0 1000 0</float_array>
        <technique_common><accessor source="#a" count="4" stride="3"/></technique_common></source>
      <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
      <polylist material="m" count="1"><input semantic="VERTEX" source="#v" offset="0"/>
        <input semantic="NORMAL" source="#n" offset="1"/><vcount>4</vcount><p>0 0 1 0 2 0 3 0</p></polylist>
      <triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
    </mesh></geometry>
  </library_geometries>
  <library_visual_scenes><visual_scene id="s">
    <node id="outer" name="outer"><translate>0 0 2000</translate>
      <node name="plate"><matrix>0 -1 0 0  1 0 0 0  0 0 1 0  0 0 0 1</matrix>
        <instance_geometry url="#g"><bind_material><technique_common>
          <instance_material symbol="m" target="#red"/></technique_common></bind_material></instance_geometry>
      </node>
    </node>
    <node name="copy"><rotate>0 0 1 90</rotate><scale>2 1 1</scale><instance_geometry url="#g"/></node>
  </visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"""


def test_dae_has_units_transforms_and_colours() -> None:
    plate, copy = parse_dae(DAE.encode())

    assert (plate.name, copy.name) == ("plate", "copy")
    assert plate.triangles.tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6]]
    assert plate.vertices[:4] == pytest.approx(np.array([(0, 0, 2), (0, 1, 2), (-1, 1, 2), (-1, 0, 2)]))
    assert copy.vertices[:4] == pytest.approx(np.array([(0, 0, 0), (0, 2, 0), (-1, 2, 0), (-1, 0, 0)]))
    assert [(len(triangles), color) for triangles, color in plate.by_material()] == [
        (2, (1.0, 0.0, 0.0, 1.0)),
        (1, None),
    ]


@pytest.mark.parametrize("rest", [b"\n", b"\0" * 100, b"</mesh></COLLADA>"])
def test_text_after_the_end_of_a_dae_is_ignored(rest: bytes) -> None:
    assert len(parse_dae(DAE.encode() + rest)) == len(parse_dae(DAE.encode()))
    assert len(parse_dae(DAE.replace("</COLLADA>", "</COLLADA \n>").encode() + rest)) == len(
        parse_dae(DAE.encode())
    )


def test_dae_strips_fans_and_polygons() -> None:
    for tag, text, expected in (
        ("tristrips", "<p>0 1 2 3</p>", [[0, 1, 2], [3, 2, 1]]),
        ("trifans", "<p>0 1 2 3</p>", [[0, 1, 2], [0, 2, 3]]),
        ("polygons", "<p>0 1 2</p><p>1 2 3</p>", [[0, 1, 2], [1, 2, 3]]),
        ("triangles", "<p>0 1 2 1 2 3</p>", [[0, 1, 2], [1, 2, 3]]),
    ):
        start, end = DAE.index("<polylist"), DAE.index("</mesh>")
        element = f'<{tag}><input semantic="VERTEX" source="#v" offset="0"/>{text}</{tag}>'
        mesh = parse_dae((DAE[:start] + element + DAE[end:]).encode())[0]
        assert mesh.triangles.tolist() == expected


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        (DAE, "", "this is no Collada file"),
        (DAE, "<sdf/>", "begins with <sdf>"),
        (DAE[300:], "", "this is no Collada file: line"),
        ('url="#g"', 'url="#x"', "has no geometry '#x'"),
        ('source="#p"', 'source="#x"', "has no positions '#v'"),
        ("<p>0 1 2</p>", "<p>0 1 9</p>", "uses a vertex that does not exist"),
        ("<p>0 1 2</p>", "<p>0 1 -1</p>", "uses a vertex that does not exist"),
        ("<p>0 1 2</p>", "<p>0 1 x</p>", "this Collada file is broken"),
        ("<vcount>4</vcount>", "<vcount>9</vcount>", "shorter than its counts"),
        ("0 0 1 90", "0 0", "this Collada file is broken"),
        ("1000 0 0 1000 1000", "nan 0 0 1000 1000", "not a finite number"),
        ('<instance_geometry url="#g"/>', '<instance_node url="#outer"/>', ""),
        ("<translate>0 0 2000</translate>", '<instance_node url="#outer"/>', "nodes that contain themselves"),
    ],
)
def test_broken_dae_is_one_clear_error(old: str, new: str, text: str) -> None:
    data = DAE.replace(old, new).encode()
    if not text:
        assert len(parse_dae(data)) == 2
        return
    with pytest.raises(MeshError, match=text) as caught:
        parse_dae(data)
    assert "\n" not in str(caught.value)


def test_random_damage_is_refused_or_read() -> None:
    """Damaged files raise MeshError, or give meshes with valid indices."""
    generator = random.Random(5)
    originals = {"stl": [binary_stl(), ascii_stl()], "dae": [DAE.encode()], "obj": [OBJ.encode()]}
    readers = {
        "stl": lambda data: [parse_stl(data)],
        "dae": parse_dae,
        "obj": lambda data: parse_obj(data.decode("utf-8", "replace")),
    }
    for kind, files in originals.items():
        for _ in range(300):
            data = bytearray(generator.choice(files))
            for _ in range(generator.randint(1, 5)):
                at = generator.randrange(len(data))
                if generator.random() < 0.5:
                    data[at] = generator.randrange(256)
                else:
                    del data[at : at + generator.randrange(40)]
            try:
                meshes = readers[kind](bytes(data))
            except MeshError:
                continue
            for mesh in meshes:
                assert mesh.triangles.max() < len(mesh.vertices)


def test_files_have_scale_submesh_and_centre(tmp_path: Path) -> None:
    path = tmp_path / "table.obj"
    path.write_text(OBJ)
    (tmp_path / "table.mtl").write_text(MTL)

    (top,) = read_mesh(str(path), "top", (2.0, 1.0, 1.0), is_centered=True)

    corners = top.vertices[np.unique(top.triangles)]
    assert (corners.min(axis=0).tolist(), corners.max(axis=0).tolist()) == (
        [-1.0, -0.5, 0.0],
        [1.0, 0.5, 0.0],
    )
    assert top.materials[0].color == (0.6, 0.4, 0.2, 1.0)
    assert len(read_mesh(str(path))) == 2
    with pytest.raises(MeshError, match=r"table.obj: there is no sub-mesh 'lid'; there are: leg, top"):
        read_mesh(str(path), "lid")


def test_mirrored_meshes_keep_their_outside(tmp_path: Path) -> None:
    path = tmp_path / "pyramid.STL"
    path.write_bytes(binary_stl())
    for scale in ((1.0, 1.0, 1.0), (-1.0, 1.0, 1.0)):
        (mesh,) = read_mesh(str(path), scale=scale)
        a, b, c = (mesh.vertices[mesh.triangles[:, index]] for index in range(3))
        assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(1 / 6)


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    for name, content, text in (
        ("no.stl", None, "No such file"),
        ("robot.fbx", b"x", r"the format '.fbx' is not supported: convert it to .stl, .obj or .dae"),
        ("short.stl", b"x", "shorter than a header"),
        ("bad.dae", b"<a", "this is no Collada file"),
    ):
        path = tmp_path / name
        if content is not None:
            path.write_bytes(content)
        with pytest.raises(MeshError, match=text) as caught:
            read_mesh(str(path))
        assert str(caught.value).startswith(f"{path}: ")


DAE_WITH_TEXTURE = b"""<COLLADA><library_images><image id="i">
<init_from>../pictures/my%20board.png</init_from></image></library_images>
<library_effects><effect id="e"><profile_COMMON><newparam sid="s"><surface><init_from>i</init_from></surface></newparam>
<technique><phong><diffuse><texture texture="s" texcoord="U"/></diffuse></phong></technique>
</profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array>0 0 0 1 0 0 1 1 0 0 1 0</float_array></source>
<source id="t"><float_array>0 0 1 0 1 1 0 1</float_array>
  <technique_common><accessor stride="2"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist material="m" count="1"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#t" offset="1"/>
<vcount>4</vcount><p>0 3 1 2 2 1 3 0</p></polylist></mesh></geometry></library_geometries></COLLADA>"""
OBJ_WITH_TEXTURE = (
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 1\nvt 1 1\nvt 1 0\nvt 0 0\nf 1/1 2/2 3/3 4/-1\nf 1 2 3\n"
)


def test_texture_coordinates_belong_to_corners() -> None:
    (mesh,) = parse_dae(DAE_WITH_TEXTURE)
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.texcoords is not None
    assert mesh.texcoords.tolist() == [[[0, 1], [1, 1], [1, 0]], [[0, 1], [1, 0], [0, 0]]]

    (mesh,) = parse_obj(OBJ_WITH_TEXTURE)
    assert mesh.texcoords is not None
    assert mesh.texcoords.tolist() == [
        [[0, 1], [1, 1], [1, 0]],
        [[0, 1], [1, 0], [0, 0]],
        [[0, 0], [0, 0], [0, 0]],
    ]
    mirrored = mesh.scaled((-1.0, 1.0, 1.0))
    assert mirrored.texcoords is not None
    assert mirrored.texcoords[0].tolist() == [[1, 0], [1, 1], [0, 1]]


@pytest.mark.parametrize(
    "change",
    [
        (b"#t", b"#x"),
        (b"1 2 2 1", b"1 9 2 1"),
        (b"0 0 1 0 1 1 0 1<", b"0 0 1 0 nan 1 0 1<"),
        (b"0 0 1 0 1 1 0 1<", b"0 0 1 0 -1.#IND 1 0 1<"),
        (b'"#t" offset="1"', b'"#t" offset="-9"'),
        (b'stride="2"', b'stride="two"'),
    ],
)
def test_texture_coordinates_that_cannot_be_used_are_left_out(change: tuple[bytes, bytes]) -> None:
    (mesh,) = parse_dae(DAE_WITH_TEXTURE.replace(*change))
    assert mesh.texcoords is None


@pytest.mark.parametrize(
    "change", [("3/3", "3/9"), ("3/3", "3/x"), ("3/3", "3//1"), ("vt 1 0", "vt one 0"), ("vt 1 0", "vt")]
)
def test_an_object_without_usable_texture_coordinates_is_read(change: tuple[str, str]) -> None:
    (mesh,) = parse_obj(OBJ_WITH_TEXTURE.replace(*change))
    assert len(mesh.triangles) == 3
    assert mesh.texcoords is None


def test_textures_are_found_beside_the_mesh(tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    file = tmp_path / "meshes" / "board.dae"
    file.write_bytes(DAE_WITH_TEXTURE)
    assert [each.texture for each in read_mesh(str(file))[0].materials] == [""]
    file.write_bytes(DAE_WITH_TEXTURE + b" ")  # another time of change
    textures = tmp_path / "materials" / "textures"
    textures.mkdir(parents=True)
    (textures / "my board.png").write_bytes(b"")
    assert [each.texture for each in read_mesh(str(file))[0].materials] == [str(textures / "my board.png")]
