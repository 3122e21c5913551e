#!/usr/bin/env python3
"""Makes from an IDL file of packed messages what writes and reads them, in C++ and in JavaScript.
  packed.py FILE.idl --header OUT.hpp --module OUT.js
Members are basic types and arrays of them. Tags: [@is N] the message's kind; [@bits A B …] flags; [@scale S] x travels as round(S·x)."""
import argparse
import sys
from pathlib import Path

sys.dont_write_bytecode = True
from idl_reader import IdlError, Reader  # noqa: E402

# IDL type: bytes, C++ type, accessor of DataView.
TYPES = {"octet": (1, "std::uint8_t", "Uint8"), "short": (2, "std::int16_t", "Int16"), "unsigned short": (2, "std::uint16_t", "Uint16"),
         "long": (4, "std::int32_t", "Int32"), "unsigned long": (4, "std::uint32_t", "Uint32"), "float": (4, "float", "Float32"),
         "double": (8, "double", "Float64")}
UNITS = {"m", "s", "rad", "Hz"}


class Field:
    def __init__(self, member, at):
        if member.type not in TYPES:
            raise IdlError(f"{member.place}: type {member.type}; allowed: {', '.join(TYPES)}, and arrays of them")
        self.size, self.cpp, self.view = TYPES[member.type]
        self.name, self.at, self.count, self.about = member.name, at, member.count, member.text()
        tags = member.tags
        self.scale, self.kind, self.bits = tags.get("scale", ""), tags.get("is", ""), tags.get("bits", "").split()
        self.unused = member.name == "unused"
        self.bytes = self.size * max(1, self.count)

    @property
    def camel(self):
        """arm_age_s → armAge_s: what follows is a unit."""
        first, *rest = self.name.split("_")
        units = next((i for i in range(len(rest) + 1) if all(part in UNITS for part in rest[i:])), len(rest))
        return first + "".join(part.capitalize() for part in rest[:units]) + "".join(f"_{part}" for part in rest[units:])


def camel(name):
    first, *rest = name.split("_")
    return first + "".join(part.capitalize() for part in rest)


def fields_of(struct):
    fields, at = [], 0
    for member in struct.members:
        fields.append(Field(member, at))
        at += fields[-1].bytes
    return fields, at


def header(file):
    lines = ["#pragma once", "", f"// Made by idl/packed.py from {file.name}.idl. Little endian, without padding.", "",
             "#include <algorithm>", "#include <array>", "#include <bit>", "#include <cmath>", "#include <cstdint>", "#include <cstring>",
             "#include <string>", "#include <string_view>", "",
             "static_assert(std::endian::native == std::endian::little);"]
    space = "::".join(file.structs[0].module) if file.structs else "none"
    lines += ["", f"namespace {space} {{"]
    for struct in file.structs:
        fields, size = fields_of(struct)
        lines += ["", *(f"/// {line}" for line in struct.comment.splitlines()), f"struct {struct.name} {{",
                  f"  static constexpr std::size_t kBytes = {size};"]
        for one in fields:
            if one.kind:
                lines.append(f"  static constexpr std::uint8_t kKind = {one.kind};")
            if one.bits:
                names = ", ".join(f"k{''.join(part.capitalize() for part in bit.split('_'))} = {1 << i}" for i, bit in enumerate(one.bits))
                lines.append(f"  enum : std::uint8_t {{ {names}, kAllFlags = {(1 << len(one.bits)) - 1} }};")
        for one in fields:
            if one.kind or one.unused:
                continue
            kind = "double" if one.scale else one.cpp
            kind = f"std::array<{kind}, {one.count}>" if one.count else kind
            lines.append(f"  {kind} {one.name}{{}};" + (f"  ///< {one.about}" if one.about else ""))
        least = {"std::int16_t": "-1.0", "std::int32_t": "-1.0"}
        lines += ["", "  void append_to(std::string& bytes) const {", "    const auto put = [&](const auto& value) {",
                  "      bytes.append(reinterpret_cast<const char*>(&value), sizeof value);", "    };"]
        for one in fields:
            if one.kind:
                lines.append("    put(kKind);")
            elif one.unused:
                lines.append(f"    bytes.append({one.bytes}, '\\0');")
            elif one.scale:
                value = f"put(static_cast<{one.cpp}>(std::lround({one.scale}.0 * std::clamp(x, {least.get(one.cpp, '0.0')}, 1.0))));"
                lines.append(f"    for (const double x : {one.name}) {value}" if one.count else f"    {{ const double x = {one.name}; {value} }}")
            else:
                lines.append(f"    put({one.name});")
        lines += ["  }", "", f"  /// Reads kBytes bytes{', of which the first must be kKind' if fields[0].kind else ''}.",
                  f"  static {struct.name} read(std::string_view bytes) {{", f"    {struct.name} m;",
                  "    const auto get = [&](auto& value, std::size_t at) { std::memcpy(&value, bytes.data() + at, sizeof value); };"]
        for one in fields:
            if one.kind or one.unused:
                continue
            if one.scale:
                each = f"for (std::size_t i = 0; i < {one.count}; ++i) " if one.count else ""
                at, to = (f"{one.at} + {one.size} * i", f"m.{one.name}[i]") if one.count else (str(one.at), f"m.{one.name}")
                lines += [f"    {each}{{", f"      {one.cpp} x;", f"      get(x, {at});", f"      {to} = x / {one.scale}.0;", "    }"]
            else:
                lines.append(f"    get(m.{one.name}, {one.at});")
        lines += ["    return m;", "  }", "};"]
    return "\n".join([*lines, "", f"}}  // namespace {space}", ""])


def script(file):
    lines = [f"// Made by idl/packed.py from {file.name}.idl. Little endian, without padding. read() throws RangeError if the bytes do not suffice.",
             "const list = (count, one) => Array.from({ length: count }, (_, i) => one(i));"]
    for struct in file.structs:
        fields, size = fields_of(struct)
        kind = next((one.kind for one in fields if one.kind), None)
        lines += ["", *(f"// {line}" for line in struct.comment.splitlines()), f"export const {struct.name} = {{",
                  f"  bytes: {size}," + (f" kind: {kind}," if kind else ""), "  read: (data, at = 0) => ({"]
        for one in fields:
            if one.kind or one.unused:
                continue
            little = "" if one.size == 1 else ", true"
            if one.bits:
                lines.append("    " + ", ".join(f"{camel(bit)}: (data.getUint8(at + {one.at}) & {1 << i}) !== 0" for i, bit in enumerate(one.bits)) + ",")
                continue
            scale = f" / {one.scale}" if one.scale else ""
            value = (f"list({one.count}, i => data.get{one.view}(at + {one.at} + {one.size} * i{little}){scale})" if one.count
                     else f"data.get{one.view}(at + {one.at}{little}){scale}")
            lines.append(f"    {one.camel}: {value},")
        lines += ["  }),", "  write: (data, at, m) => {"]
        for one in fields:
            little = "" if one.size == 1 else ", true"
            if one.unused:
                continue
            if one.kind:
                lines.append(f"    data.setUint8(at, {one.kind});")
            elif one.bits:
                flags = " | ".join(f"(m.{camel(bit)} ? {1 << i} : 0)" for i, bit in enumerate(one.bits))
                lines.append(f"    data.setUint8(at + {one.at}, {flags});")
            else:
                def written(at, x):
                    return f"data.set{one.view}(at + {at}, {f'Math.round({one.scale} * {x})' if one.scale else x}{little})"
                lines.append(f"    m.{one.camel}.forEach((x, i) => {written(f'{one.at} + {one.size} * i', 'x')});" if one.count
                             else f"    {written(one.at, f'm.{one.camel}')};")
        lines += ["  },", "};"]
    return "\n".join([*lines, ""])


def main(words):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--header", type=Path, required=True)
    parser.add_argument("--module", type=Path, required=True)
    options = parser.parse_args(words)
    try:
        file = Reader(options.file).read()
        made = {options.header: header(file), options.module: script(file)}
    except (IdlError, OSError) as problem:
        print(f"packed.py: {problem}", file=sys.stderr)
        return 2
    for path, text in made.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
