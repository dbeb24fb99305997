"""The turtles' world and its canvas, without a node."""

from __future__ import annotations

import math

import pytest

from minirospy.ros.turtlesim.canvas import PIXELS, Canvas, Color
from minirospy.ros.turtlesim.square import Order, Square
from minirospy.ros.turtlesim.world import BACKGROUND, SIZE, Pose, Reading, Velocity, World, WorldError

PEN = Color(179, 184, 255)
RED = Color(255, 0, 0)


@pytest.fixture
def world() -> World:
    world = World()
    assert world.spawn_first() == "turtle1"
    return world


def steps(world: World, count: int, start: float = 0.0) -> Reading:
    """Run ``count`` steps; return the last message of turtle1."""
    for number in range(count):
        first = next(reading for reading in world.step(start + number * 0.016) if reading.name == "turtle1")
    return first


def test_world_has_the_size_of_ros() -> None:
    assert f"{SIZE:f}" == "11.088889"


def test_first_turtle_stands_in_the_middle(world: World) -> None:
    assert world.step(0.0) == [
        Reading("turtle1", Pose(pytest.approx(SIZE / 2), pytest.approx(SIZE / 2), 0.0), 0, 0, BACKGROUND, "")
    ]


def test_command_is_obeyed_for_one_second(world: World) -> None:
    world.command("turtle1", Velocity(forward=2.0), 0.0)
    reading = steps(world, 63)  # The last step is 0.992 s after the command.
    assert reading.pose.x == pytest.approx(SIZE / 2 + 63 * 0.032)
    assert reading.linear == 2.0
    stopped = steps(world, 10, start=1.001)
    assert stopped.pose == reading.pose
    assert stopped.linear == 0.0


def test_turtle_turns_before_it_goes(world: World) -> None:
    world.command("turtle1", Velocity(forward=1.0, turn=math.pi / 2 / 0.016), 0.0)
    x, y, theta = steps(world, 1).pose
    assert (x, y) == (pytest.approx(SIZE / 2), pytest.approx(SIZE / 2 + 0.016))
    assert theta == pytest.approx(math.pi / 2)


def test_turtle_goes_sideways(world: World) -> None:
    world.command("turtle1", Velocity(left=3.0, forward=4.0), 0.0)
    reading = steps(world, 1)
    assert reading.pose.x == pytest.approx(SIZE / 2 + 0.064)
    assert reading.pose.y == pytest.approx(SIZE / 2 + 0.048)
    assert reading.linear == 5.0


def test_direction_stays_between_minus_pi_and_pi(world: World) -> None:
    world.teleport_relative("turtle1", 0.0, 4.0)
    assert steps(world, 1).pose.theta == pytest.approx(4.0 - 2 * math.pi)
    world.teleport_absolute("turtle1", 1.0, 1.0, -20.0)
    assert steps(world, 1).pose.theta == pytest.approx(-20.0 + 6 * math.pi)


def test_walls_stop_a_turtle_with_a_warning(world: World) -> None:
    world.teleport_absolute("turtle1", SIZE, 5.0, 0.0)
    assert steps(world, 1).warning == ""
    world.command("turtle1", Velocity(forward=1.0), 1.0)
    reading = steps(world, 1, start=1.0)
    assert reading.pose.x == SIZE
    # The y in this message is measured from the top of the picture.
    assert reading.warning == "Oh no! I hit the wall! (Clamping from [x=11.104889, y=6.088889])"


def test_teleport_out_of_the_world_ends_at_its_wall(world: World) -> None:
    world.teleport_absolute("turtle1", -3.0, 5.0, 0.0)
    reading = steps(world, 1)
    assert reading.pose.x == 0.0
    assert "x=-3.000000" in reading.warning
    world.teleport_absolute("turtle1", 1e38, 1e38, 0.0)
    assert steps(world, 1).pose[:2] == (SIZE, SIZE)


def test_relative_teleport_turns_and_goes_forward(world: World) -> None:
    world.teleport_relative("turtle1", 2.0, math.pi / 2)
    x, y, _ = steps(world, 1).pose
    assert (x, y) == (pytest.approx(SIZE / 2), pytest.approx(SIZE / 2 + 2.0))


def test_color_is_that_before_the_turtle_drew(world: World) -> None:
    world.set_pen("turtle1", RED, 10, is_off=False)
    world.command("turtle1", Velocity(forward=10.0), 0.0)
    assert steps(world, 1).color == BACKGROUND
    assert steps(world, 1, start=2.0).color == RED


def test_pen_that_is_off_draws_nothing_and_is_kept(world: World) -> None:
    version = world.canvas.version
    world.set_pen("turtle1", RED, 10, is_off=True)
    world.teleport_absolute("turtle1", 1.0, 1.0, 0.0)
    steps(world, 1)
    assert world.canvas.version == version
    world.set_pen("turtle1", PEN, 0, is_off=False)
    world.teleport_absolute("turtle1", 2.0, 1.0, 0.0)
    assert steps(world, 1).color == PEN
    # A width of 0 is drawn as one pixel.
    assert set(world.canvas.marks.sum(axis=0).tolist()) == {0, 1}


def test_clear_wipes_lines_and_keeps_turtles(world: World) -> None:
    world.teleport_absolute("turtle1", 1.0, 1.0, 0.0)
    steps(world, 1)
    world.clear(Color(1, 2, 3))
    assert not world.canvas.marks.any()
    assert steps(world, 1).color == Color(1, 2, 3)
    assert world.pose("turtle1").x == 1.0


def test_names_are_counted_until_all_are_removed(world: World) -> None:
    assert world.spawn("turtle2", 0, 0, 0) == "turtle2"
    assert world.spawn("", 0, 0, 0) == "turtle3"
    world.kill("turtle1")
    assert world.spawn("", 0, 0, 0) == "turtle4"
    world.remove_all()
    assert world.spawn_first() == "turtle1"


def test_turtles_are_published_by_name(world: World) -> None:
    world.spawn("b", 1, 1, 0)
    world.spawn("a", 1, 1, 0)
    assert [reading.name for reading in world.step(0.0)] == ["a", "b", "turtle1"]


def test_requests_that_the_world_refuses(world: World) -> None:
    with pytest.raises(WorldError, match=r"^A turtled named \[turtle1\] already exists$"):
        world.spawn("turtle1", 1, 1, 0)
    with pytest.raises(WorldError, match=r"^Tried to kill turtle \[fred\], which does not exist$"):
        world.kill("fred")
    with pytest.raises(WorldError, match=r"\[my turtle\] is not a legal name"):
        world.spawn("my turtle", 1, 1, 0)
    with pytest.raises(WorldError, match="no turtle"):
        world.command("fred", Velocity(), 0.0)
    for number in (math.nan, math.inf):
        with pytest.raises(WorldError, match="finite"):
            world.command("turtle1", Velocity(forward=number), 0.0)
        with pytest.raises(WorldError, match="finite"):
            world.teleport_absolute("turtle1", number, 0, 0)
        with pytest.raises(WorldError, match="finite"):
            world.teleport_relative("turtle1", 0, number)
        with pytest.raises(WorldError, match="finite"):
            world.spawn("", 0, number, 0)
    assert world.names == ["turtle1"]
    assert steps(world, 1).pose.x == pytest.approx(SIZE / 2)


@pytest.mark.parametrize(
    ("start", "end", "width", "columns", "rows"),
    [
        ((10, 20), (30, 20), 3, (9, 31), (19, 21)),
        ((30, 20), (10, 20), 3, (9, 31), (19, 21)),
        ((10, 20), (10, 50), 1, (10, 10), (20, 50)),
        ((10, 20), (10, 20), 5, (8, 12), (18, 22)),
        ((-1e38, 20), (1e38, 20), 3, (0, PIXELS - 1), (19, 21)),
        ((PIXELS + 50, 20), (PIXELS - 3, 20), 1, (PIXELS - 3, PIXELS - 1), (20, 20)),
    ],
)
def test_stroke_covers_its_rectangle(
    start: tuple[float, float],
    end: tuple[float, float],
    width: int,
    columns: tuple[int, int],
    rows: tuple[int, int],
) -> None:
    canvas = Canvas(BACKGROUND)
    canvas.stroke(start, end, RED, width)
    for axis, (first, last) in enumerate((columns, rows)):
        assert canvas.marks.any(axis=axis).nonzero()[0].tolist() == list(range(first, last + 1))
    assert canvas.color_at(*(min(max(value, 0), PIXELS - 1) for value in end)) == RED


def test_thin_slanted_stroke_has_no_gap() -> None:
    canvas = Canvas(BACKGROUND)
    canvas.stroke((10, 10), (200, 90), RED, 1)
    assert canvas.marks[:, 10:201].any(axis=0).all()


def test_stroke_outside_of_the_paper_changes_nothing() -> None:
    canvas = Canvas(BACKGROUND)
    canvas.stroke((-50, -50), (-10, 700), RED, 3)
    assert not canvas.marks.any()


def test_square_is_drawn_with_its_goals(world: World) -> None:
    """These are the lines that draw_square logs. For half of its turns, the goal is where the turtle stops."""
    square = Square()
    lines: list[str] = []
    orders: list[Order | None] = []
    for number in range(3000):
        (reading,) = world.step(number * 0.016)
        order, said = square.step(reading.pose, reading.linear, reading.angular)
        lines += said
        orders.append(order)
        if order is not None:
            world.command("turtle1", Velocity(forward=order.linear, turn=order.angular), number * 0.016)
    assert lines[:2] == ["New goal [7.544445 5.544445, 0.000000]", "Reached goal"]
    goals = [line for line in lines if line != "Reached goal"]
    assert lines[1::2] == ["Reached goal"] * (len(lines) // 2)
    assert [float(goal.rstrip("]").rpartition(" ")[2]) for goal in goals[1:8:2]] == [
        pytest.approx(angle, abs=0.05) for angle in (math.pi / 2, math.pi, -math.pi / 2, 0)
    ]
    assert set(orders) == {Order(1.0, 0.0), Order(0.0, 0.4), Order(), None}
