"""Record the responses of the real tf2_py (Debian's) in recorded.json. Run it with the project's Python."""

from __future__ import annotations

import json
from pathlib import Path

from tests.core.tf2.conversation import edge_cases, query_real, questions, shortened

FOLDER = Path(__file__).parent


def main() -> None:
    """Query the real tf2_py, and write the file."""
    conversations = [*edge_cases(), *(questions(seed, 40) for seed in range(12))]
    real = query_real(conversations)
    lines = [
        json.dumps([queries, [shortened(answer) for answer in answers]])
        for queries, answers in zip(conversations, real, strict=True)
    ]
    (FOLDER / "recorded.json").write_text("[\n" + ",\n".join(lines) + "\n]\n", encoding="utf-8")


if __name__ == "__main__":
    main()
