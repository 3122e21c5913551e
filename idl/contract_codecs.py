"""Codecs of the IDL's messages: lists of their fields, conversions, and samples of messages that have none by hand."""
import re
from dataclasses import dataclass, field
from os.path import commonprefix

from contract_topics import MADE, topics
from idl_reader import IdlError

BASIC = {"octet": "std::uint8_t", "short": "std::int16_t", "unsigned short": "std::uint16_t", "long": "std::int32_t",
         "unsigned long": "std::uint32_t", "long long": "std::int64_t", "unsigned long long": "std::uint64_t",
         "float": "float", "double": "double", "boolean": "bool", "string": "std::string"}
# Types that a codec knows, and what samples have instead.
KNOWN = {"Stamp": "core::SampleId", "Echo": "core::SampleId", "Vector3": "Vector3", "Pose": "geometry::Pose", "JointArray": "core::JointArray"}
NUMBER = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"
TEXTS = {"": "any", "name": "name", "whole": "whole_text", "whole or empty": "whole_or_empty"}


@dataclass
class Places:
    """Content of places.txt. `messages`: name → header; `fields`: (message, field) → (places, test)."""
    enumerations: dict = field(default_factory=dict)
    messages: dict = field(default_factory=dict)
    fields: dict = field(default_factory=dict)
    own: set = field(default_factory=set)


def read_places(path):
    places, message = Places(), None
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines() if path else [], 1):
        words = line.split("#")[0].split()
        if not words:
            continue
        if line.startswith(" ") and message and len(words) > 1:
            of, _, test = " ".join(words[1:]).partition(" if ")
            places.fields[message, words[0]] = (of.split(", "), test)
        elif words[0] == "enum" and len(words) == 3:
            places.enumerations[words[1]] = words[2]
        elif words[0] == "message" and len(words) == 3:
            message, places.messages[words[1]] = words[1], words[2]
        elif words[0] == "own" and len(words) == 2:
            places.own.add(words[1])
        else:
            raise IdlError(f"{path.name}:{number}: '{line}'; allowed: enum NAME TYPE, message NAME HEADER, its fields, own NAME")
    return places


@dataclass
class Range:
    """`words`: "any", "joint limits", "links" or what a sequence's length counts ("items"); least, most: texts of numbers or empty."""
    words: str = ""
    least: str = ""
    most: str = ""

    def bounds(self):
        """As arguments of a codec: ', 0.0, 1.0', or less of it."""
        if not self.least and not self.most:
            return ""
        return f", {as_double(self.least) or '-kAnyNumber'}" + (f", {as_double(self.most)}" if self.most else "")


def as_double(text):
    return text if not text or "." in text or "e" in text else text + ".0"


def range_of(member):
    """The member's @range, widened by an @invalid number; raises IdlError."""
    text = member.tags.get("range")
    if text is None:
        return Range()
    if text in ("any", "joint limits", "links"):
        return Range(text)
    found = re.fullmatch(rf"({NUMBER})?\.\.({NUMBER})?(?: (\w+))?", text)
    if not found or not (found[1] or found[2]) or bool(found[3]) != (member.type == "sequence"):
        raise IdlError(f"{member.place}: @range '{text}'; allowed: A..B, A.., ..B, any, joint limits, links; of a sequence: A..B items")
    least, most = found[1] or "", found[2] or ""
    invalid = re.match(NUMBER, member.tags.get("invalid", ""))
    if invalid and least and float(invalid[0]) < float(least):
        least = invalid[0]
    return Range(found[3] or "", least, most)


class Contract:
    """All definitions of the IDL, by name."""

    def __init__(self, files, places):
        self.files, self.places = files, places
        self.structs = {struct.name: struct for file in files for struct in file.structs}
        self.enumerations = {one.name: one for file in files for one in file.enumerations}
        self.arrays = {name: array for file in files for name, array in file.arrays.items()}
        for message, name in places.fields:
            if message not in self.structs or name not in {member.name for member in self.structs[message].members}:
                raise IdlError(f"places.txt: {message} has no field {name}; allowed: those of the IDL")

    def prefix(self, struct):
        """What names of its fields begin with in messages: the list that holds it."""
        for other in self.structs.values():
            for member in other.members:
                if member.element == struct.name:
                    return member.name + "."
        return ""

    def field_line(self, struct, member):
        """The line of a codec's list that converts and checks a member; empty: none."""
        of, test = self.places.fields.get((struct.name, member.name), ([member.name], ""))
        if of == ["-"]:
            return ""
        m, s, name = f"m.{member.name}()", f"s.{of[0]}", f'"{self.prefix(struct)}{member.name}"'
        kind, limits = member.type, range_of(member)
        array = self.arrays.get(kind)
        if kind == "Stamp":
            line = f"codec.stamp({m}, {s});" + (f"\n  codec.any({m}.utc_ns(), s.{of[1]});" if len(of) > 1 else "")
        elif kind == "Echo":
            line = f"codec.echo({m}, {s});"
        elif kind == "Vector3":
            line = f"codec.vector({name}, {m}, {s}, {self.symmetric(member, limits)});" if limits.most else f"codec.place({name}, {m}, {s});"
        elif kind == "Pose":
            line = (f"codec.placement({name}, {m}, {s}, s.{of[1]}, {self.symmetric(member, limits)});" if len(of) > 1
                    else f"codec.pose({name}, {m}, {s});")
        elif kind == "JointArray":
            line = (f"codec.positions({name}, {m}, {s});" if limits.words == "joint limits"
                    else f"codec.joints({name}, {m}, {s}{limits.bounds()});")
        elif kind in self.enumerations:
            line = f"codec.enumeration({name}, {m}, {s}, {len(self.enumerations[kind].values)});"
        elif kind in self.structs:
            line = f"k{kind}(codec, {m}, {s});"
        elif kind == "sequence" and member.element in self.structs:
            most = limits.most or str(member.bound)
            if most == "0":
                raise IdlError(f"{member.place}: {member.name} has no bound; allowed: sequence<{member.element}, N>, or [@range 0..N items]")
            line = f"codec.list({name}, {m}, {s}, k{member.element}, {most});"
        elif kind == "sequence" and limits.most:
            line = f'codec.values({name}, "{limits.words}", {m}, {s}, {limits.least or 0}, {limits.most});'
        elif kind == "string":
            text = member.tags.get("text", "")
            if text not in TEXTS:
                raise IdlError(f"{member.place}: @text '{text}'; allowed: {', '.join(filter(None, TEXTS))}, or no tag")
            line = f"codec.any({m}, {s});" if not text else f"codec.{TEXTS[text]}({name}, {m}, {s});"
        elif member.name == "joint_count":
            line = f"codec.joint_count({m}, {s});"
        elif limits.words == "links":
            line = f"codec.link({m}, {s});"
        elif limits.words == "any" or kind in ("boolean", "sequence") or member.count or array:
            line = f"codec.any({m}, {s});"
        elif kind in ("float", "double") or limits.bounds():
            line = f"codec.number({name}, {m}, {s}{limits.bounds()});"
        else:
            line = f"codec.any({m}, {s});"
        return f"  if ({test}(s)) {line}" if test else f"  {line}"

    @staticmethod
    def symmetric(member, limits):
        if not limits.most or float(limits.least or "nan") != -float(limits.most):
            raise IdlError(f"{member.place}: a vector's range is symmetric; allowed: [@range -B..B]")
        return as_double(limits.most)

    def field_lists(self, file):
        """The part of a family's codecs that goes field by field."""
        lines = [f"// {MADE} Included by common/messages/codecs/{file.name}_codec.cpp."]
        for struct in file.structs:
            if struct.name in KNOWN:
                continue
            fields = list(filter(None, (self.field_line(struct, member) for member in struct.members)))
            fields.sort(key=lambda line: line.startswith("  if "))  # what depends on others comes after them
            lines += ["", f"constexpr auto k{struct.name} = [](auto& codec, auto& m, auto& s) {{", *fields, "};"]
        return "\n".join([*lines, ""])

    def topic_structs(self, file):
        return list(dict.fromkeys(topic.struct.name for topic in topics(self.files) if topic.family == file.name))

    def enumerator(self, enumeration, value):
        """LINK_VERY_CLOSE → kVeryClose, without what all enumerators begin with."""
        common = commonprefix([one + "_" for one in enumeration.values])
        common = common[:common.rindex("_") + 1] if "_" in common else ""
        return "k" + "".join(part.capitalize() for part in value[len(common):].split("_"))

    def conversions(self, file):
        lines = [f"// {MADE} Included by common/messages/codecs/{file.name}_codec.cpp, after its refusal() functions."]
        for one in file.enumerations:
            other = self.places.enumerations.get(one.name, "")
            if not other or other == "bool":
                continue
            lines += ["", f"// Enumerations travel as numbers: both lists count alike.\nstatic_assert(enumerators_agree<msg::{one.name}, {other}>({{"]
            lines += [f"    {{msg::{one.name}::{value}, {other}::{self.enumerator(one, value)}}}," for value in one.values]
            lines += ["}));"]
        for name in self.topic_structs(file):
            lines.append("")
            if name not in self.places.own:
                lines += [f"core::Status read(const msg::{name}& message, {name}& sample, const ArmBounds& arm) {{",
                          f"  return judged(decode(k{name}, message, arm, sample), sample, [](const auto& s) -> std::string {{",
                          "    if constexpr (requires { refusal(s); }) return refusal(s);", "    return {};", "  });", "}",
                          f"msg::{name} to_idl(const {name}& sample) {{ return encoded<msg::{name}>(k{name}, sample); }}"]
            lines += [f"core::Expected<{name}> from_idl(const msg::{name}& message, const ArmBounds& arm) {{",
                      f"  return read_whole<{name}>(message, arm);", "}"]
        return "\n".join([*lines, ""])

    def declarations(self, file):
        names = self.topic_structs(file)
        headers = sorted({self.places.messages.get(name, "-") for name in names} - {"-"})
        lines = ["#pragma once", "", f"// {MADE}", "", '#include "common/core/status.hpp"', '#include "common/messages/arm_bounds.hpp"',
                 *(f'#include "common/messages/{header}.hpp"' for header in headers), f'#include "phantom_contract/{file.name}_samples.hpp"',
                 f'#include "phantom_idl/{file.name}.hpp"', "", "namespace phantom::messages {", "",
                 "// from_idl: converts a message, or returns which field is wrong, its value and what is allowed. `arm`: the arm that the",
                 "// sample must describe. Allocates in errors only, but for texts and lists. Order and source are checked elsewhere",
                 "// (dds::SourceGuard). read: as from_idl, but leaves in `sample` what could be read of a message that is refused. to_idl:",
                 "// converts without checks but the length of names (throws core::ConfigError); the writer completes the stamp (dds::Stamper)."]
        for name in names:
            lines += ["", f"core::Expected<{name}> from_idl(const msg::{name}& message, const ArmBounds& arm = {{}});",
                      f"core::Status read(const msg::{name}& message, {name}& sample, const ArmBounds& arm = {{}});",
                      f"msg::{name} to_idl(const {name}& sample);"]
        return "\n".join([*lines, "", "}  // namespace phantom::messages", ""])

    def sample_type(self, member):
        """C++ type and initial value of a member of a sample."""
        kind = member.type
        if kind == "sequence":
            return f"std::vector<{self.element_type(member.element)}>", ""
        if member.count or kind in self.arrays and kind not in KNOWN:
            element, count = self.arrays.get(kind, (kind, member.count))
            return f"std::array<{self.element_type(element)}, {count}>", "{}"
        invalid = re.match(NUMBER, member.tags.get("invalid", ""))
        initial = "{}" if kind in ("Vector3", "JointArray") else ""
        if kind in BASIC and kind != "string":
            number = invalid[0] if invalid else "0"
            initial = " = " + ("false" if kind == "boolean" else as_double(number) if kind in ("float", "double") else number)
        elif kind in self.enumerations:
            initial = self.initial_enumerator(kind, member)
        return self.element_type(kind), initial

    def initial_enumerator(self, kind, member):
        """What a sample's enumeration is until somebody sets it: @default, else the first."""
        if "default" not in member.tags:
            return "{}"
        enumeration, value = self.enumerations[kind], member.tags["default"].strip()
        if value not in enumeration.values:
            raise IdlError(f"{member.place}: @default '{value}'; allowed: {', '.join(enumeration.values)}")
        return f" = {self.element_type(kind)}::{self.enumerator(enumeration, value)}"

    def element_type(self, kind):
        return BASIC.get(kind) or KNOWN.get(kind) or (self.places.enumerations.get(kind) if kind in self.enumerations else None) or kind

    def samples(self, file):
        """Samples, and their enumerations, of messages that have none by hand."""
        lines = ["#pragma once", "", f"// {MADE} Samples of the messages that common/messages/codecs/places.txt does not list.", "",
                 "#include <array>", "#include <cstdint>", "#include <string>", "#include <vector>", "",
                 '#include "common/core/joints.hpp"', '#include "common/core/sample_id.hpp"', '#include "common/geometry/pose.hpp"',
                 '#include "common/messages/received.hpp"', "", "namespace phantom::messages {"]
        for one in file.enumerations:
            if one.name not in self.places.enumerations:
                lines += ["", *(f"/// {line.strip()}" for line in one.comment.splitlines()), f"enum class {one.name} {{"]
                lines += [f"  {self.enumerator(one, value)}," + (f"  ///< {about}" if about else "")
                          for value, about in zip(one.values, one.about)]
                lines += ["};"]
        for struct in file.structs:
            if struct.name in self.places.messages or struct.name in KNOWN:
                continue
            comment = [line for line in re.sub(r"\[@[^\]]*\]", "", struct.comment).splitlines() if line.strip()]
            lines += ["", *(f"/// {line.strip()}" for line in comment), f"struct {struct.name} {{"]
            for member in struct.members:
                kind, initial = self.sample_type(member)
                about = " ".join(member.comment.split())
                lines.append(f"  {kind} {member.name}{initial};" + (f"  ///< {about}" if about else ""))
            lines += ["", f"  friend bool operator==(const {struct.name}&, const {struct.name}&) = default;", "};"]
        return "\n".join([*lines, "", "}  // namespace phantom::messages", ""])


def outputs(files, places):
    contract, made = Contract(files, places), {}
    for file in files:
        if not contract.topic_structs(file):
            continue
        made[f"phantom_contract/{file.name}_fields.inc"] = contract.field_lists(file)
        made[f"phantom_contract/{file.name}_codec.inc"] = contract.conversions(file)
        made[f"phantom_contract/{file.name}_codec.hpp"] = contract.declarations(file)
        made[f"phantom_contract/{file.name}_samples.hpp"] = contract.samples(file)
    return made
