"""The simulated scanner: geometry, the person, noise and fields."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from minirospy.board.scanner import ANGLE_INCREMENT, ANGLE_MIN, BEAMS, RANGE_MIN, Circle, Room, Wall

AHEAD = round(-ANGLE_MIN / ANGLE_INCREMENT)
SQUARE = (Wall(2, -2, 2, 2), Wall(2, 2, -2, 2), Wall(-2, 2, -2, -2), Wall(-2, -2, 2, -2))


def test_angles_are_those_of_the_scanner() -> None:
    assert pytest.approx(2.39983, abs=1e-4) == ANGLE_MIN + (BEAMS - 1) * ANGLE_INCREMENT


def test_walls_are_measured_at_their_distance() -> None:
    scan = Room(SQUARE).scan(noise=0)
    assert len(scan.ranges) == len(scan.intensities) == BEAMS
    assert scan.ranges[AHEAD] == pytest.approx(2.0, abs=1e-3)
    beam = AHEAD + round(math.radians(45) / ANGLE_INCREMENT)
    assert scan.ranges[beam] == pytest.approx(2 * math.sqrt(2), abs=0.02)


def test_no_echo_without_a_wall() -> None:
    scan = Room((Wall(2, -1, 2, 1),)).scan(noise=0)
    assert math.isinf(scan.ranges[0])
    assert scan.intensities[0] == 0
    assert math.isfinite(scan.ranges[AHEAD])


@given(st.floats(0.3, 1.8), st.floats(-2.3, 2.3))
def test_person_is_measured_before_the_walls(away: float, angle: float) -> None:
    room = Room(SQUARE)
    room.person = Circle(away * math.cos(angle), away * math.sin(angle))
    assert room.scan(noise=0).nearest == pytest.approx(room.person.distance, abs=0.01)


def test_person_behind_the_scanner_is_not_seen() -> None:
    room = Room(SQUARE)
    before = room.scan(noise=0)
    room.person = Circle(-1.0, 0.0)
    assert room.scan(noise=0) == before


def test_a_person_on_top_of_the_scanner() -> None:
    room = Room(SQUARE)
    room.person = Circle(0.0, 0.05)
    assert set(room.scan(noise=0).ranges) == {RANGE_MIN}


@pytest.mark.parametrize(
    ("away", "fields"), [(0.7, (True, True)), (0.5, (False, True)), (0.3, (False, False))]
)
def test_fields(away: float, fields: tuple[bool, bool]) -> None:
    room = Room(SQUARE)
    room.person = Circle(away, 0.0)
    assert room.scan(noise=0).fields() == fields


def test_noise_is_small_and_repeatable() -> None:
    scans = [Room(seed=3).scan() for _ in range(2)]
    assert scans[0] == scans[1]
    clean = Room(seed=3).scan(noise=0)
    off = [a - b for a, b in zip(scans[0].ranges, clean.ranges, strict=True) if math.isfinite(b)]
    assert 0 < max(map(abs, off)) < 0.03
    assert any(clean.is_reflector)
