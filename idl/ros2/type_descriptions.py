#!/usr/bin/env python3
"""What ROS 2 says of its types, computed from the definitions in this folder: names, RIHS01 hashes (REP 2016) and message definitions as text.
  type_descriptions.py IDL …                 a line per type: name and hash
  type_descriptions.py --header OUT IDL …    a C++ header with a table of all types
"""
import hashlib
import json
import sys
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import idl_reader  # noqa: E402

NESTED, BOUNDED_STRING = 1, 21
# Field types of type_description_interfaces/msg/FieldType, and their names in .msg files. IDL's octet is ROS 2's byte.
BASIC = {"int8": (2, "int8"), "uint8": (3, "uint8"), "int16": (4, "int16"), "uint16": (5, "uint16"), "int32": (6, "int32"), "uint32": (7, "uint32"),
         "int64": (8, "int64"), "uint64": (9, "uint64"), "float": (10, "float32"), "double": (11, "float64"), "boolean": (15, "bool"),
         "octet": (16, "byte"), "string": (17, "string")}
ARRAY, BOUNDED_SEQUENCE, SEQUENCE = 48, 96, 144  # added to the type of one element

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


def ros_name(word, package):
    """Header_, std_msgs::msg::dds_::Header_ → std_msgs/msg/Header; basic types as they are."""
    if word in BASIC:
        return word
    return (word.replace("::dds_::", "/").replace("::", "/") if "::" in word else f"{package}/msg/{word}").removesuffix("_")


def read(path):
    """{type name: its fields} of a file, in its order; raises IdlError with file and line."""
    types = {}
    for struct in idl_reader.Reader(path).read().structs:
        package = struct.module[0]
        if struct.module != (package, "msg", "dds_"):
            raise idl_reader.IdlError(f"{struct.place}: modules {'::'.join(struct.module)}; allowed: PACKAGE::msg::dds_")
        fields = types[f"{package}/msg/{struct.name.removesuffix('_')}"] = []
        for member in struct.members:
            shape, capacity = (ARRAY, member.count) if member.count else (0, 0)
            if member.type == "sequence":
                shape, capacity = (BOUNDED_SEQUENCE, member.bound) if member.bound else (SEQUENCE, 0)
            element = ros_name(member.element or member.type, package)
            fields.append(Field(member.name, element, member.bound if member.type == "string" else 0, shape, capacity))
    return types


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
        types.update(read(path))
    if out:
        Path(out).write_text(header(types))
    else:
        print("\n".join(f"{name} {type_hash(name, types)}" for name in sorted(types)))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
