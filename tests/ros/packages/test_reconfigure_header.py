"""The C++ header of a .cfg file: literals that C++ takes as they are meant. What it does is tested by tests/interop."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

SHARE = Path(__file__).parents[3] / "msgs" / "dynamic_reconfigure"
CFG = """
from dynamic_reconfigure.parameter_generator_catkin import *
gen = ParameterGenerator()
gen.add("label", str_t, 1, "Text", 'a "b" \\\\ ??/ \\n Zoë 7')
gen.add("least", int_t, 2, "Least", -2147483648)
gen.add("far", double_t, 4, "Far", 1e300, -1e-7, float("inf"))
gen.add("any", double_t, 8, "Any", 1)
gen.const("Home", str_t, "/tmp", "Where")
gen.const("On", bool_t, True, "Whether")
empty = gen.add_group("An empty one")
exit(gen.generate("lamp", "lamp", "Lamp"))
"""


def header(tmp_path: Path) -> str:
    file = tmp_path / "Lamp.cfg"
    file.write_text(CFG, encoding="utf-8")
    folders = [tmp_path / name for name in ("share", "include", "python")]
    subprocess.run([sys.executable, str(file), str(SHARE), *map(str, folders)], check=True, timeout=60)
    return (tmp_path / "include" / "LampConfig.h").read_text(encoding="ascii")


def test_values_are_literals_of_cpp(tmp_path: Path) -> None:
    text = header(tmp_path)
    values = dict(re.findall(r"&LampConfig::(\w+), (.*)\);", text))
    assert values == {
        "label": r'"", "", "a \"b\" \\ \?\?/ \012 Zo\303\253 7"',
        "least": "(-2147483647 - 1), 2147483647, (-2147483647 - 1)",
        "far": "-1e-07, std::numeric_limits<double>::infinity(), 1e+300",
        "any": "-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(), 1.0",
    }
    assert 'const char * const Lamp_Home = "/tmp";' in text
    assert "const bool Lamp_On = true;" in text


def test_group_without_parameters_has_a_class(tmp_path: Path) -> None:
    text = header(tmp_path)
    assert "class AN_EMPTY_ONE" in text
    assert "} an_empty_one;" in text
    assert text.count("{") == text.count("}")
