"""Expressions in rad() and !radians, and texts that are no angle though they look like one."""

import rosparam
import yaml
from referee import outcome

EXPRESSIONS = """pi; pi/2; 1<<3; 1<<3>>1; 3<2; 3>2; 2==2; 1!=2; 1<2<3; 3<2<1; 1 <= 2; 3 and 4; 0 or 5; not 0; not pi
~1; 6&3; 6|1; 6^2; 7//2; -7//2; 7%4; 5.0//2; 5.5%2; 2**10; 2**-1; 2**0.5; 3**40; 7**30/3; 2**62+1; -1>>1; +1; --1; 1+True
1 if pi>3 else 2; 1 if 0 else -pi; True; True and 2; 1<2 and 2<1; 0x10; 0b101; 1_000; 1e3; math.e; math.inf; -math.inf"""
TAGGED = """(1<2)+1; math.sin(pi/2); math.sqrt(4); math.atan2(1,1); math.floor(2.5); math.degrees(pi); math.hypot(3,4); abs(-1)
max(1,2); min(pi, 3); round(2.6); round(2.567,1); int(2.5); float(3); pow(2,3); (1+2)*3"""
TEXTS = """rad(1)+rad(1); rad(deg(1)); rad((1)x); rad (1); rad(1; rad); rad()); deg(9)x; xdeg(9); deg(deg(9)); rad(os.getcwd())
rad(__import__('os'))"""
DEGREES = "90; 90.5; 1e2; -45; +4; 1_0; nan; inf"


def each(text):
    """Return the parts of a list above."""
    return [part for line in text.splitlines() for part in line.split("; ")]


def read(text):
    """Return the value of a parameter with this text."""
    return rosparam.load_str(f"a: {text}", "f")[0][0]["a"]


for text in each(EXPRESSIONS):
    outcome(f"rad({text})", lambda: read(f"rad({text})"))
    outcome(f"!radians {text}", lambda: yaml.safe_load(f"!radians {text}"))
for text in each(TAGGED):
    outcome(f"!radians {text}", lambda: read(f"!radians {text}"))
for text in each(TEXTS):
    outcome(text, lambda: read(text))
for text in each(DEGREES):
    outcome(f"deg({text})", lambda: read(f"deg({text})"))
