"""Writes `dalean/keys.py`, the typed keys of experiments, from what the program says of them.

    dalean keys --json | python stubs.py > dalean/keys.py
"""

import json
import sys

HEAD = '''"""Every key of an experiment with what it takes, for type checkers and editors; `docs/CONFIG.md` is made of the same.
Made by `stubs.py` from `dalean keys --json`.
"""

from __future__ import annotations

from typing import Any, Literal, TypedDict

Keys = TypedDict(
    "Keys",
    {
'''


def taken(key: dict) -> str:
    """The type of a value."""
    values = key["values"]
    match values["type"]:
        case "integer":
            kind = "int"
        case "number":
            kind = "float"
        case "boolean":
            kind = "bool"
        case "string" if "of" in values:
            kind = "Literal[" + ", ".join(json.dumps(word) for word in values["of"]) + "]"
        case "string":
            kind = "str"
        case _:
            kind = "Any"
    several = kind != "Any" and (key.get("layers") or key.get("windows"))
    return f"{kind} | list[{kind}]" if several else kind


def main() -> None:
    lines = [HEAD]
    for line in sys.stdin:
        key = json.loads(line)
        if key["event"] != "key" or key["file"] == "sweep":
            continue
        name = key["key"]
        name = name if key["file"] == "experiment" or name.startswith("hw.") else f"hw.{name}"
        unit = f" [{key.get('unit')}]" if key.get("unit") else ""
        default = "" if key.get("default") is None else f" Default: {json.dumps(key['default'])}."
        meaning = " ".join(key["meaning"].split())
        lines.append(f"        # {meaning}{unit}{default}\n        {json.dumps(name)}: {taken(key)},\n")
    lines.append("    },\n    total=False,\n)\n")
    sys.stdout.write("".join(lines))


if __name__ == "__main__":
    main()
