"""Write sdformat.json, the models to which sdformat converts sdf_robots.py's descriptions: `python make_recorded.py print_sdf`.

print_sdf is built from print_sdf.cc. The recorded ones are sdformat 12.3's (Debian 12).
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from sdf_robots import CASES, RANDOM, random_robot, resolve, summary

from minirospy.core.sdf.read import parse_model


def recorded(program: str, text: str) -> object:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "robot.urdf")
        file.write_text(text, encoding="utf-8")
        run = subprocess.run([program, str(file)], capture_output=True, check=False)
    if run.returncode or b"<link" not in run.stdout:
        return None  # sdformat returns a model without links, or refuses the robot
    return summary(parse_model(run.stdout, resolve))


def main() -> None:
    program = sys.argv[1]
    texts = {**CASES, **{f"random {seed}": random_robot(seed) for seed in RANDOM}}
    answers = {name: recorded(program, text) for name, text in texts.items()}
    lines = (f"{json.dumps(name)}: {json.dumps(answer)}" for name, answer in answers.items())
    Path(__file__).with_name("sdformat.json").write_text(
        "{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8"
    )


if __name__ == "__main__":
    main()
