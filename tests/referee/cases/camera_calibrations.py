"""camera_calibration_parsers and resource_retriever: valid and invalid files and URLs."""

import tempfile
from pathlib import Path

import resource_retriever
from camera_calibration_parsers import readCalibration
from referee import outcome, show

GOOD = """image_width: 640
image_height: 480
camera_name: cam
camera_matrix:
  rows: 3
  cols: 3
  data: [500.123456789012345, 0, 1e-17, 0, 510, 1e20, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.1, -0.2, 0.001, 0.002, 0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [490, 0, 321, 0, 0, 495, 241, 0, 0, 0, 1, 0]
"""
INI = """# Camera intrinsics

[image]

width
640

height
480

[my camera]

camera matrix
500.00000 0.00000 320.00000
0.00000 510.00000 240.00000
0.00000 0.00000 1.00000

distortion
0.10000 -0.20000 0.00100 0.00200 0.00000


rectification
1.00000 0.00000 0.00000
0.00000 1.00000 0.00000
0.00000 0.00000 1.00000

projection
490.00000 0.00000 321.00000 0.00000
0.00000 495.00000 241.00000 0.00000
0.00000 0.00000 1.00000 0.00000
"""
FILES = {
    "good.yaml": GOOD,
    "good.yml": GOOD,
    "good.txt": GOOD,
    "without_model.yaml": GOOD.replace("distortion_model: plumb_bob\n", ""),
    "without_name.yaml": GOOD.replace("camera_name: cam\n", ""),
    "number_as_name.yaml": GOOD.replace("cam\n", "00b09d0100a8fb8d\n"),
    "short.yaml": GOOD.replace("1e20, ", ""),
    "four.yaml": GOOD.replace("cols: 5", "cols: 4").replace("0.002, 0]", "0.002]"),
    "eight.yaml": GOOD.replace("cols: 5", "cols: 8").replace("0.002, 0]", "0.002, 0, 1, 2, 3]"),
    "word.yaml": GOOD.replace("640", "wide"),
    "open.yaml": "camera_matrix: [",
    "list.yaml": "- 1\n- 2\n",
    "empty.yaml": "",
    "good.ini": INI,
    "ini.yaml": INI,
    "cut.ini": INI[:200],
    "slash.ini": INI.replace("my camera", "narrow_stereo/left"),
    "four.ini": INI.replace("0.00200 0.00000", "0.00200"),
}

folder = Path(tempfile.mkdtemp())
for name, text in FILES.items():
    (folder / name).write_text(text)
for name in [*FILES, "missing", "."]:
    found = readCalibration(str(folder / name))
    show(name, found and (found[0], type(found[1].D).__name__, type(found[1].K).__name__))
    show(found and " ".join(str(found[1]).split()))

(folder / "a b.txt").write_bytes(b"spaces\0")
prefix = folder.as_uri()
for url in (
    f"{prefix}/a%20b.txt",
    f"{prefix}/missing",
    f"{prefix}/",
    "data:,hello",
    "package://std_msgs",
    "package://",
    "http://127.0.0.1:9/x",
    "nothing://x",
    "/x",
    "",
):
    outcome("get", lambda url=url: resource_retriever.get(url))
    outcome("get_filename", lambda url=url: resource_retriever.get_filename(url))
show(b"<name>std_msgs</name>" in resource_retriever.get("package://std_msgs/package.xml"))
path = resource_retriever.get_filename("package://std_msgs/x/y", use_protocol=False)
show(
    path.endswith("std_msgs/x/y"),
    resource_retriever.get_filename("package://std_msgs/x/y") == f"file://{path}",
)
try:
    resource_retriever.get("package://no_such_package/x")
except Exception as error:  # noqa: BLE001 - any error is printed
    show(type(error).__name__, str(error).split()[0])
