"""The pure parts of interactive markers under node: update sequence numbers, handles, menus, drags."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest

from tests.interop.page_modules import needs_node, run_script

pytestmark = needs_node


def updates(*steps: tuple[str, int]) -> list[Any]:
    """Return the changes that these steps cause, and the server's status.

    A step is full, update or alive, with a sequence number.
    """
    body = f"""
        const updates = new MarkerUpdates();
        const found = [];
        for (const [kind, number] of {json.dumps(steps)}) {{
          const all = {{server_id: "s", seq_num: number, markers: [number], poses: [], erases: []}};
          const changes = kind === "full" ? updates.full(all) : updates.update({{...all, type: kind === "update" ? 1 : 0}}, 0);
          for (const {{isAll, markers}} of changes) found.push([isAll ? "all" : "one", markers[0]]);
        }}
        return [...found, updates.statuses(1000)[0][1][1], updates.statuses(4000)[0][1][1]];"""
    found: list[Any] = run_script("MarkerUpdates", "js/scene/marker_updates.js", body)
    return found


QUIET = "No update received for 4 seconds."
WAITING = "Waiting for all markers."


@pytest.mark.parametrize(
    ("steps", "changes", "state"),
    [
        ([("full", 3)], [], None),
        ([("full", 3), ("alive", 3)], [["all", 3]], "OK"),
        ([("alive", 3), ("full", 3), ("update", 4)], [["all", 3], ["one", 4]], "OK"),
        # Updates that arrived before the full state are part of it, or follow it.
        ([("update", 3), ("update", 4), ("full", 3)], [["all", 3], ["one", 4]], "OK"),
        ([("update", 3), ("update", 4), ("full", 4)], [["all", 4]], "OK"),
        # A full state from before a gap, or newer than the updates, cannot be combined with them.
        ([("update", 5), ("full", 3)], [], WAITING),
        ([("update", 3), ("full", 5)], [], WAITING),
        ([("update", 3), ("full", 5), ("update", 4), ("update", 5)], [["all", 5]], "OK"),
        ([("full", 3), ("alive", 3), ("full", 9), ("update", 4)], [["all", 3], ["one", 4]], "OK"),
    ],
)
def test_updates_are_followed_from_all_markers_on(
    steps: list[tuple[str, int]], changes: list[Any], state: str | None
) -> None:
    *found, now, later = updates(*steps)
    assert found == changes
    if state:
        assert (now, later) == (state, QUIET)


@pytest.mark.parametrize(
    ("lost", "text"),
    [
        (("update", 5), "Sequence number of update is out of order. Expected: 4 Received: 5"),
        (("alive", 4), "Sequence number of keep-alive is out of order. Expected: 3 Received: 4"),
        (("update", 3), "Sequence number of update is out of order. Expected: 4 Received: 3"),
    ],
)
def test_lost_update_is_named_until_all_markers_come(lost: tuple[str, int], text: str) -> None:
    *found, now, _ = updates(("full", 3), ("alive", 3), lost)
    assert (found, now) == ([["all", 3]], text)
    *found, now, _ = updates(("full", 3), ("alive", 3), lost, ("full", lost[1]))
    assert (found, now) == ([["all", 3], ["all", lost[1]]], "OK")


def test_servers_of_a_namespace_are_limited() -> None:
    body = """
        const updates = new MarkerUpdates();
        for (let at = 0; at < 20; at++) updates.update({server_id: `s${at}`, seq_num: 1}, 0);
        try {
          updates.update({server_id: "x".repeat(1000), seq_num: 1}, 0);
        } catch (error) { return [error.message.length, updates.servers.size]; }"""
    assert run_script("MarkerUpdates", "js/scene/marker_updates.js", body) == [236, 20]


# --- markers


def completed(message: str) -> Any:
    """Return a marker with handles and menus; ``message`` is JavaScript for its fields."""
    body = f"""
        const pose = {{position: {{x: 0, y: 0, z: 0}}, orientation: {{x: 0, y: 0, z: 0, w: 0}}}};
        const control = (mode, more = {{}}) => ({{
          name: "", description: "", interaction_mode: mode, orientation_mode: 0, always_visible: false,
          independent_marker_orientation: false, markers: [], orientation: {{x: 0, y: 0, z: 0, w: 1}}, ...more}});
        const entry = (id, parent_id, title, command_type = 0) => ({{id, parent_id, title, command: "a b", command_type}});
        try {{
          const marker = {{name: "m", description: "", header: {{}}, scale: 0, pose, controls: [], menu_entries: []}};
          return complete({{...marker, ...{message}}});
        }} catch (error) {{ return error.message; }}"""
    return run_script("complete", "js/scene/handles.js", body)


def test_controls_without_shapes_get_handles() -> None:
    made = completed(
        "{scale: 2, controls: [control(3), control(5), control(4), control(6), control(2), control(0)]}"
    )
    arrows, *rings, button, nothing = (control["shapes"] for control in made["controls"])
    assert [[point["x"] for point in shape["points"]] for shape in arrows] == [[1, 1.8], [-1, -1.8]]
    assert [shape["color"] for shape in arrows] == [{"r": 1, "g": 0, "b": 0, "a": 0.5}] * 2
    for (ring,) in rings:
        radii = {
            round(math.hypot(point["y"], point["z"]) * ring["scale"]["x"], 6) for point in ring["points"]
        }
        assert radii == {1.0, 1.3}
        assert {point["x"] for point in ring["points"]} == {0}
        assert len(ring["points"]) == 3 * len(ring["colors"])
    assert (button, nothing) == ([], [])
    assert made["pose"]["q"] == [0, 0, 0, 1]


def test_menu_control_without_shapes_is_its_text() -> None:
    (control,) = completed("{controls: [control(1, {description: 'open'})]}")["controls"]
    assert (control["shapes"][0]["text"], control["facing"]) == ("open", 2)


def test_names_of_controls_differ() -> None:
    made = completed(
        "{controls: [control(2, {name: 'a'}), control(2, {name: 'a'}), control(2), control(2, {name: 'a'})]}"
    )
    assert [control["name"] for control in made["controls"]] == ["a", "a_u0", "", "a_u1"]


def test_menu_is_a_tree_without_loops() -> None:
    made = completed(
        "{menu_entries: [entry(1, 0, '[x] one'), entry(2, 1, '[ ] two'), entry(3, 4, 'lost'), entry(4, 4, 'own'),"
        "entry(1, 0, 'again'), entry(0, 0, 'zero'), entry(5, 2, 'run', 1)]}"
    )
    (one,) = made["menu"]
    (two,) = one["children"]
    (run,) = two["children"]
    assert (one["title"], one["isChecked"]) == ("one", True)
    assert (two["title"], two["isChecked"]) == ("two", False)
    assert (run["title"], run["isChecked"], run["command"]) == ("run", None, "rosrun a b")


@pytest.mark.parametrize(
    ("message", "error"),
    [
        ("{controls: Array(201).fill(control(2))}", "201 controls, more than 200"),
        (
            "{controls: [control(2, {markers: Array(1001).fill({})})]}",
            "1001 markers in its controls, more than 1000",
        ),
        ("{menu_entries: Array(1001).fill(entry(1, 0, ''))}", "1001 menu entries, more than 1000"),
        ("{scale: NaN}", "Marker contains invalid floats!"),
        (
            "{controls: [control(3, {orientation: {x: Infinity, y: 0, z: 0, w: 1}})]}",
            "Marker contains invalid floats!",
        ),
    ],
)
def test_marker_beyond_limits_is_refused(message: str, error: str) -> None:
    assert completed(message) == error


def test_long_texts_are_cut() -> None:
    made = completed("{description: 'd'.repeat(9999), menu_entries: [entry(1, 0, 't'.repeat(9999))]}")
    assert (len(made["description"]), len(made["menu"][0]["title"])) == (300, 300)


# --- dragging

_START = "pose: {p: [0, 0, 0], q: [0, 0, 0, 1]}"


def dragged(mode: int, axis: str, grabbed: str, *to: tuple[float, float], by: str = "{}") -> Any:
    """Return the pose after a drag, seen from above, to points on the ground."""
    body = f"""
        const down = (x, y) => ({{origin: [x, y, 10], direction: [0, 0, -1]}});
        const grabbed = {grabbed};
        const drag = new Drag({{mode: {mode}, {_START}, axis: {axis}, grabbed, ray: down(grabbed[0], grabbed[1])}});
        const view = {{right: [1, 0, 0], up: [0, 1, 0], forward: [0, 0, -1], metres: 0.1, dx: 0, dy: 0, ...{by}}};
        let found = null;
        for (const [x, y] of {json.dumps(to)}) found = drag.move(down(x, y), view);
        return found && [...found.p, ...found.q, drag.angle];"""
    return run_script("Drag", "js/scene/handles.js", body)


HALF = math.sqrt(0.5)


@pytest.mark.parametrize(
    ("mode", "axis", "grabbed", "to", "by", "wanted"),
    [
        # Drag along an axis. The distance cannot be determined if the view is along it.
        (3, "[1, 0, 0]", "[0.7, 0.05, 0.1]", [(1.7, 3)], "{}", [1, 0, 0, 0, 0, 0, 1, 0]),
        (3, "[0, 0, 1]", "[0, 0, 0.7]", [(1, 1)], "{}", None),
        (4, "[0, 0, 1]", "[0.1, 0, 0.2]", [(2.1, 3)], "{}", [2, 3, 0, 0, 0, 0, 1, 0]),
        (4, "[1, 0, 0]", "[0.1, 0, 0.2]", [(2.1, 3)], "{}", None),
        (5, "[0, 0, 1]", "[0.5, 0, 0]", [(0, 9)], "{}", [0, 0, 0, 0, 0, HALF, HALF, math.pi / 2]),
        # Seen from its side, a ring turns by the part that is closest to the eye.
        (
            5,
            "[1, 0, 0]",
            "[0, 0, 0.5]",
            [(0, -0.25)],
            "{}",
            [0, 0, 0, math.sin(0.25), 0, 0, math.cos(0.25), 0.5],
        ),
        # A drag straight away from the middle only moves the marker; a drag to the side also turns it.
        (6, "[0, 0, 1]", "[0.5, 0, 0]", [(1.5, 0)], "{}", [1, 0, 0, 0, 0, 0, 1, 0]),
        (6, "[0, 0, 1]", "[0.5, 0, 0]", [(0, 0.5)], "{}", [0, 0, 0, 0, 0, HALF, HALF, math.pi / 2]),
        (6, "[0, 0, 1]", "[0.5, 0, 0]", [(0, 0.5), (0, 2.5)], "{}", [0, 2, 0, 0, 0, HALF, HALF, math.pi / 2]),
        (7, "[1, 0, 0]", "[0, 0, 0]", [(0, 0)], "{dx: 5, dy: 2}", [0.5, -0.2, 0, 0, 0, 0, 1, 0]),
        (7, "[1, 0, 0]", "[0, 0, 0]", [(0, 0)], "{dx: 5, dy: 2, isFar: true}", [0, 0, 0.2, 0, 0, 0, 1, 0]),
        (
            8,
            "[1, 0, 0]",
            "[0, 0, 0]",
            [(0, 0)],
            "{dx: 100}",
            [0, 0, 0, 0, math.sin(0.5), 0, math.cos(0.5), 0],
        ),
        (
            9,
            "[1, 0, 0]",
            "[0, 0, 0]",
            [(0, 0)],
            "{dy: 100, isTurn: true}",
            [0, 0, 0, math.sin(0.5), 0, 0, math.cos(0.5), 0],
        ),
        (9, "[1, 0, 0]", "[0, 0, 0]", [(0, 0)], "{dx: 5}", [0.5, 0, 0, 0, 0, 0, 1, 0]),
        (2, "[1, 0, 0]", "[0, 0, 0]", [(1, 0)], "{}", None),
    ],
)
def test_drag_moves_as_its_mode_says(
    mode: int, axis: str, grabbed: str, to: list[tuple[float, float]], by: str, wanted: list[float] | None
) -> None:
    found = dragged(mode, axis, grabbed, *to, by=by)
    assert found == (None if wanted is None else pytest.approx(wanted, abs=1e-9))


def test_axes_of_controls_follow_the_marker_or_the_view_or_stay() -> None:
    body = """
        const half = Math.SQRT1_2;
        const [start, now, view] = [[0, 0, 0, 1], [0, 0, half, half], [half, 0, 0, half]];
        const control = (facing, isIndependent = false, rotation = 0) =>
          ({facing, isIndependent, rotation, q: [0, 0, 0, 1], initial: start});
        const all = [control(0), control(1), control(1, false, Math.PI / 2), control(2), control(2, true)];
        return all.map((each) => rotationsOf(each, now, view));"""
    inherited, fixed, turned, facing, independent = run_script("rotationsOf", "js/scene/handles.js", body)
    marker, view = [0, 0, HALF, HALF], [HALF, 0, 0, HALF]
    assert inherited == {"frame": marker, "shapes": marker}
    assert fixed == {"frame": [0, 0, 0, 1], "shapes": [0, 0, 0, 1]}
    assert turned["frame"] == pytest.approx([HALF, 0, 0, HALF])
    assert facing == {"frame": view, "shapes": view}
    assert independent == {"frame": view, "shapes": marker}


def test_display_of_a_file_keeps_what_rviz_has_set() -> None:
    # This is a file saved by Debian's RViz.
    saved = {
        "Class": "rviz/InteractiveMarkers",
        "Enable Transparency": True,
        "Enabled": True,
        "Name": "InteractiveMarkers",
        "Show Axes": True,
        "Show Descriptions": False,
        "Show Visual Aids": False,
        "Update Topic": "/markers/update",
        "Value": True,
    }
    raw = {"Visualization Manager": {"Displays": [saved]}}
    body = f"""
        const config = new Config({json.dumps(raw)});
        return [config.unknown(), config.displays()[0].settings];"""
    assert run_script("Config", "js/scene/config.js", body) == [[], saved]
