#!/usr/bin/env python3
"""Makes from the IDL files of this folder what else would be written by hand for each topic (README.md, "What a topic's tags say").
  contract.py --out DIR        all of it, into the folder DIR; what has not changed keeps its time
  contract.py --rights         who may publish and subscribe what, for deploy/security/make
  contract.py --topics         the table of topics, as Markdown
  --idl DIR                    another folder of IDL files;  --places FILE  another common/messages/codecs/places.txt
"""
import argparse
import sys
from pathlib import Path

sys.dont_write_bytecode = True  # the sources may be read-only

import contract_codecs  # noqa: E402
import contract_samples  # noqa: E402
import contract_topics  # noqa: E402
from idl_reader import IdlError, Reader  # noqa: E402

HERE = Path(__file__).resolve().parent
PLACES = HERE.parent / "common/messages/codecs/places.txt"


def read_files(folder):
    """The IDL files of a folder, those without includes first; raises IdlError."""
    files = [Reader(path).read() for path in sorted(folder.glob("*.idl"))]
    if not files:
        raise IdlError(f"{folder}: no .idl file there")
    return sorted(files, key=lambda file: file.name != "types")


def outputs(files, places):
    """{file name: text} of all that is made."""
    return {**contract_topics.outputs(files), **contract_codecs.outputs(files, places), **contract_samples.outputs(files)}


def write(folder, name, text):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def main(words):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--idl", type=Path, default=HERE)
    parser.add_argument("--places", type=Path, default=PLACES)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--out", type=Path)
    what.add_argument("--rights", action="store_true")
    what.add_argument("--topics", action="store_true")
    options = parser.parse_args(words)
    try:
        files = read_files(options.idl)
        if options.rights:
            print(contract_topics.rights(files), end="")
        elif options.topics:
            print(contract_topics.table(files), end="")
        else:
            for name, text in outputs(files, contract_codecs.read_places(options.places)).items():
                write(options.out, name, text)
    except (IdlError, OSError) as problem:
        print(f"contract.py: {problem}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
