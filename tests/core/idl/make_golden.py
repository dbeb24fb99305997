"""Write golden.json: real genpy's results for every type in msgs/.

Run it with real ROS 1's Python:

/usr/bin/python3 tests/core/idl/make_golden.py

The types of packages that Debian does not have come from golden_elsewhere.json: real genmsg's md5sums of noetic's definitions
(control_msgs, tf, the tutorials, theora_image_transport, sick_safetyscanners), for actions after genaction.py.
"""

import importlib
import json
from collections.abc import Iterator
from pathlib import Path

HERE = Path(__file__).parent
MSGS = HERE.parents[2] / "msgs"


def types() -> Iterator[tuple[str, str]]:
    """Yield the kind and pkg/Name of every definition; an action has seven messages."""
    for folder in sorted(MSGS.iterdir()):
        for path in sorted(path for kind in KINDS for path in folder.glob(f"{kind}/*.{kind}")):
            names = [path.stem]
            kind = path.suffix[1:]
            if kind == "action":
                kind = "msg"
                names = [path.stem + part for part in PARTS]
            for name in names:
                yield kind, folder.name + "/" + name


KINDS = ["action", "msg", "srv"]
PARTS = ["Action", "ActionGoal", "ActionResult", "ActionFeedback", "Goal", "Result", "Feedback"]


def main() -> None:
    elsewhere = json.loads((HERE / "golden_elsewhere.json").read_text())
    golden: dict[str, dict[str, str]] = {"msg": {}, "srv": {}}
    for kind, full_name in types():
        package, name = full_name.split("/")
        try:
            found = getattr(importlib.import_module(package + "." + kind), name)
        except (ImportError, AttributeError):
            if full_name in elsewhere[kind]:
                golden[kind][full_name] = elsewhere[kind][full_name]
            else:
                print("real ROS does not have", full_name)
            continue
        golden[kind][full_name] = found._md5sum
    (HERE / "golden.json").write_text(json.dumps(golden, indent=1, sort_keys=True) + "\n")
    print(sum(map(len, golden.values())), "types")


if __name__ == "__main__":
    main()
