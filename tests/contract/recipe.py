#!/usr/bin/env python3
"""Follows docs/new_topic.md in a copy: recipe.py DIR leaves there idl/, the codec, and in include/ what idl/contract.py makes."""
import re
import subprocess
import sys
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
CODEC = SOURCE / "common/messages/codecs/teleoperation_codec.cpp"


def blocks():
    """The recipe's two edits: of the IDL, of the codec."""
    text = (SOURCE / "docs/new_topic.md").read_text(encoding="utf-8")
    return [re.search(rf"^```{language}\n(.*?)^```", text, re.S | re.M)[1] for language in ("idl", "cpp")]


def follow(folder):
    idl, rule = blocks()
    (folder / "idl").mkdir(parents=True, exist_ok=True)
    for file in (SOURCE / "idl").glob("*.idl"):
        text = file.read_text(encoding="utf-8")
        if file.stem == "teleoperation":
            text = text.rstrip().removesuffix("};\n};") + idl + "\n};\n};\n"
        (folder / "idl" / file.name).write_text(text, encoding="utf-8")
    before, after = CODEC.read_text(encoding="utf-8").split("}  // namespace\n\n#include", 1)
    (folder / "teleoperation_codec.cpp").write_text(f"{before}{rule}\n}}  // namespace\n\n#include{after}", encoding="utf-8")
    subprocess.run([sys.executable, SOURCE / "idl/contract.py", "--idl", folder / "idl", "--out", folder / "include"], check=True)


if __name__ == "__main__":
    follow(Path(sys.argv[1]))
