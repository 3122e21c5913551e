#!/usr/bin/env python3
"""What ROS 2 says of its types, computed from the definitions in this folder: names, RIHS01 hashes (REP 2016) and message definitions as text.
  type_descriptions.py IDL …                 a line per type: name and hash
  type_descriptions.py --header OUT IDL …    a C++ header with a table of all types
"""
import hashlib
import json
import re
import sys
from pathlib import Path

NESTED, BOUNDED_STRING = 1, 21
# Field types of type_description_interfaces/msg/FieldType, and their names in .msg files. IDL's octet is ROS 2's byte.
BASIC = {"int8": (2, "int8"), "uint8": (3, "uint8"), "int16": (4, "int16"), "uint16": (5, "uint16"), "int32": (6, "int32"), "uint32": (7, "uint32"),
         "int64": (8, "int64"), "uint64": (9, "uint64"), "float": (10, "float32"), "double": (11, "float64"), "boolean": (15, "bool"),
         "octet": (16, "byte"), "string": (17, "string")}
ARRAY, BOUNDED_SEQUENCE, SEQUENCE = 48, 96, 144  # added to the type of one element

TOKEN = re.compile(r'\s+|//[^\n]*|#[^\n]*|(?P<word>[A-Za-z_][\w:]*|\d+|[{}<>\[\];,])')


class Field:
    def __init__(self, name, element, string_capacity, shape, capacity):
        self.name, self.element, self.string_capacity, self.shape, self.capacity = name, element, string_capacity, shape, capacity

    def described(self):
        """As the hash has it: in the order and with the keys of type_description_interfaces."""
        basic = BOUNDED_STRING if self.string_capacity else BASIC[self.element][0] if self.element in BASIC else NESTED
        return {"name": self.name, "type": {"type_id": basic + self.shape, "capacity": self.capacity, "string_capacity": self.string_capacity,
                                            "nested_type_name": "" if self.element in BASIC else self.element}}

    def text(self):
        """As a line of a .msg file."""
        element = BASIC[self.element][1] if self.element in BASIC else self.element.replace("/msg/", "/")
        element += f"<={self.string_capacity}" if self.string_capacity else ""
        return element + {0: "", ARRAY: f"[{self.capacity}]", BOUNDED_SEQUENCE: f"[<={self.capacity}]", SEQUENCE: "[]"}[self.shape] + " " + self.name


class Reader:
    """Reads the part of IDL that these files use: modules, structs, basic types, strings, sequences and arrays. Throws ValueError with file and line."""

    def __init__(self, path):
        self.path, self.words, at, text = path, [], 0, Path(path).read_text()
        while at < len(text):
            found = TOKEN.match(text, at)
            line = text.count("\n", 0, at) + 1
            if not found:
                raise ValueError(f"{path}:{line}: unexpected character '{text[at]}'")
            if found["word"]:
                self.words.append((found["word"], line))
            at = found.end()

    def next(self, *allowed):
        word, line = self.words.pop(0) if self.words else ("the end", 0)
        if allowed and word not in allowed:
            raise ValueError(f"{self.path}:{line}: found '{word}'; allowed: {', '.join(allowed)}")
        return word

    def read(self):
        """{type name: its fields}, in the file's order."""
        types = {}
        while self.words:
            self.next("module")
            package = self.next()
            for word in ("{", "module", "msg", "{", "module", "dds_", "{"):
                self.next(word)
            while self.next("struct", "}") == "struct":
                name = f"{package}/msg/{self.next().removesuffix('_')}"
                self.next("{")
                types[name] = self.fields(package)
                self.next(";")
            for word in (";", "}", ";", "}", ";"):
                self.next(word)
        return types

    def fields(self, package):
        fields = []
        while (word := self.next()) != "}":
            shape, capacity = 0, 0
            if word == "sequence":
                self.next("<")
                element, string_capacity = self.element(self.next(), package)
                shape = SEQUENCE
                if self.next(",", ">") == ",":
                    shape, capacity = BOUNDED_SEQUENCE, int(self.next())
                    self.next(">")
            else:
                element, string_capacity = self.element(word, package)
            name = self.next()
            if self.next(";", "[") == "[":
                shape, capacity = ARRAY, int(self.next())
                self.next("]")
                self.next(";")
            fields.append(Field(name, element, string_capacity, shape, capacity))
        return fields

    def element(self, word, package):
        if word == "string" and self.words[0][0] == "<":
            self.next("<")
            capacity = int(self.next())
            self.next(">")
            return word, capacity
        if word in BASIC:
            return word, 0
        if "::" in word:
            return word.replace("::dds_::", "/").replace("::", "/").removesuffix("_"), 0
        return f"{package}/msg/{word.removesuffix('_')}", 0


def referenced(name, types):
    """The types that a type is made of, however deep, by name."""
    found = {field.element for field in types[name] if field.element not in BASIC}
    return sorted(found.union(*(referenced(one, types) for one in found)))


def type_hash(name, types):
    def described(one):
        return {"type_name": one, "fields": [field.described() for field in types[one]]}
    whole = {"type_description": described(name), "referenced_type_descriptions": [described(one) for one in referenced(name, types)]}
    return "RIHS01_" + hashlib.sha256(json.dumps(whole).encode()).hexdigest()


def definition(name, types):
    """The message definition as MCAP's schema encoding ros2msg has it: the type's own, then all that it is made of."""
    parts = ["\n".join(field.text() for field in types[name])]
    parts += [f"MSG: {one.replace('/msg/', '/')}\n" + "\n".join(field.text() for field in types[one]) for one in referenced(name, types)]
    return ("\n" + "=" * 80 + "\n").join(parts) + "\n"


def dds_name(name):
    package, _, short = name.split("/")
    return f"{package}::msg::dds_::{short}_"


def header(types):
    rows = "".join(f'    {{"{name}", "{dds_name(name)}", "{type_hash(name, types)}",\n     R"({definition(name, types)})"}},\n' for name in sorted(types))
    return ("#pragma once\n\n// Made by idl/ros2/type_descriptions.py.\n\n#include <array>\n\n#include \"common/ros2/message_types.hpp\"\n\n"
            f"namespace phantom::ros2 {{\n\ninline constexpr std::array<MessageType, {len(types)}> kMessageTypes{{{{\n{rows}}}}};\n\n}}  // namespace phantom::ros2\n")


def main(arguments):
    out = None
    if arguments[:1] == ["--header"] and len(arguments) > 2:
        out, arguments = arguments[1], arguments[2:]
    if not arguments or arguments[0].startswith("-"):
        print(__doc__.strip(), file=sys.stderr)
        return 2
    types = {}
    for path in arguments:
        types.update(Reader(path).read())
    if out:
        Path(out).write_text(header(types))
    else:
        print("\n".join(f"{name} {type_hash(name, types)}" for name in sorted(types)))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
