"""Samples of all topics for tests, and what of each message a codec must refuse."""
from contract_codecs import BASIC, KNOWN, Contract, Places, as_double, range_of
from contract_topics import MADE, topics

MOST_ITEMS, OCTETS, NUMBERS = 1500, 100_003, 60_000  # of lists: larger than a datagram's fragment
LONGEST_TEXT = 255                                   # longer ones are filled to their bound
WHOLE = {"octet": (0, 255), "short": (-32768, 32767), "unsigned short": (0, 65535), "long": (-2**31, 2**31 - 1),
         "unsigned long": (0, 2**32 - 1), "long long": (-2**62, 2**62), "unsigned long long": (0, 2**62)}


class Samples:
    def __init__(self, files):
        self.contract, self.topics = Contract(files, Places()), topics(files)

    def arguments(self, member, limits):
        """Least and most of a number, as C++ arguments."""
        if member.type in WHOLE:
            least, most = WHOLE[member.type]
            least, most = max(least, int(float(limits.least or least))), min(most, int(float(limits.most or most)))
            if limits.words == "links":
                least, most = 0, 7
            return f"{least}, {most}" if most < 2**31 and least > -2**31 else f"{least}LL, {most}LL"
        least = as_double(limits.least) or ("-1000.0" if not limits.most else as_double(limits.most) + " - 1000.0")
        return f"{least}, {as_double(limits.most) or least + ' + 1000.0'}"

    def assignment(self, member):
        kind, limits = member.type, range_of(member)
        array = self.contract.arrays.get(kind) or ((kind, member.count) if member.count else None)
        f = f"m.{member.name}"
        if kind in ("Stamp", "Echo"):
            return f"set({f}());"
        if kind in ("Vector3", "Pose"):
            return f"set({f}(), {as_double(limits.most) or '1000.0'});"
        if array:
            bounds = f"{as_double(limits.least) or '-1.0'}, {as_double(limits.most) or '1.0'}"
            value = f"number({bounds})" if array[0] in ("float", "double") else f"count<{BASIC[array[0]]}>(0, 0x7fffffffLL)"
            return f"for (auto& one : {f}()) one = {value};"
        if kind in self.contract.enumerations:
            return f"{f}(msg::{kind}::{self.contract.enumerations[kind].values[-1]});"
        if kind in self.contract.structs:
            return f"set({f}());"
        if kind == "sequence":
            element = member.element
            most = int(limits.most or member.bound or 10**9)
            if element in self.contract.structs:
                return f"{f}().resize({min(most, MOST_ITEMS)});\n  for (auto& one : {f}()) set(one);"
            size = min(most, OCTETS if element == "octet" else NUMBERS)
            value = "number(-1.0, 1.0)" if element in ("float", "double") else f"count<{BASIC[element]}>(0, 255)"
            return f"{f}().resize({size});\n  for (auto& one : {f}()) one = static_cast<{BASIC[element]}>({value});"
        if kind == "string":
            return f"{f}(text({member.bound}));"
        if kind == "boolean":
            return f"{f}(true);"
        if member.name == "joint_count":
            return f"{f}({limits.most});"
        if kind in ("float", "double"):
            return f"{f}(static_cast<{kind}>(number({self.arguments(member, limits)})));"
        return f"{f}(count<{BASIC[kind]}>({self.arguments(member, limits)}));"

    def text(self):
        lines = [f"// {MADE} Included by tests/support/topic_samples.cpp."]
        for struct in self.contract.structs.values():
            if struct.name in KNOWN:
                continue
            lines += ["", f"void set(msg::{struct.name}& m) {{", *(f"  {self.assignment(member)}" for member in struct.members), "}"]
        lines += ["", "template <class Entries>", "Entries entries() {", "  return {"]
        lines += [f"      entry(dds::{topic.constant})," for topic in self.topics]
        return "\n".join([*lines, "  };", "}", ""])

    def faults(self, struct, prefix, name):
        """(field's name in the refusal, statement that spoils it) of each field of a struct that is checked."""
        for member in struct.members:
            kind, limits, f = member.type, range_of(member), f"{prefix}.{member.name}"
            label, bounds = f"{name}{member.name}", [(limits.least, "below"), (limits.most, "above")]
            if limits.words == "any":
                continue
            if kind == "Stamp":
                yield f"{label}.sequence_number", f"{f}().sequence_number(0)"
            elif kind in ("Vector3", "Pose"):
                most, place = as_double(limits.most) or "10000.0", f"{f}()" if kind == "Vector3" else f"{f}().position_m()"
                yield from ((label, f"{place}.{axis}({value})")
                            for axis, value in (("y", "kNaN"), ("z", f"above<double>({most})"), ("x", f"below<double>(-{most})")))
                if kind == "Pose":
                    yield label, f"{f}().qw(2.0)"
            elif kind == "JointArray":
                yield from ((label, f"{f}()[{place}] = {value}") for place, value in ((3, "kNaN"), (0, "-kInfinite")))
                if limits.least:
                    yield label, f"{f}()[1] = below<double>({as_double(limits.least)})"
            elif kind in self.contract.enumerations:
                yield label, f"{f}(static_cast<msg::{kind}>({len(self.contract.enumerations[kind].values)}))"
            elif kind == "sequence" and member.element in self.contract.structs:
                yield from self.faults(self.contract.structs[member.element], f"{f}().back()", f"{member.name}.")
                yield label, f"{f}().resize({int(limits.most or member.bound) + 1}, {f}().back())"
            elif kind == "sequence" and limits.most:
                yield label, f"{f}().resize({int(limits.most) + 1})"
                if int(limits.least or 0) > 0:
                    yield label, f"{f}().clear()"
            elif kind == "string" and member.tags.get("text") == "name":
                yield label, f'{f}("two\\nlines")'
            elif kind in ("float", "double") and not member.count:
                yield from ((label, f"{f}(number_as<{kind}>({value}))") for value in ("kNaN", "-kInfinite"))
                yield from ((label, f"{f}({side}<{kind}>({as_double(bound)}))") for bound, side in bounds if bound)
            elif kind in WHOLE and not member.count:
                for (bound, _), end, step in zip(bounds, WHOLE[kind], (-1, 1)):
                    if bound and (int(float(bound)) - end) * step < 0:
                        yield label, f"{f}({int(float(bound)) + step}{'U' if step > 0 else ''})"

    def cases(self):
        lines = [f"// {MADE} Included by common/messages/tests/contract_test.cpp: each field beyond its range."]
        first = {topic.struct.name: topic for topic in reversed(self.topics)}
        for name, topic in sorted(first.items()):
            lines += ["", "template <>", f"struct Of<msg::{name}> {{",
                      f"  static const dds::TopicDescription& topic() {{ return dds::{topic.constant}; }}",
                      f"  static std::vector<Fault<msg::{name}>> faults() {{", "    return {"]
            lines += [f'        {{"{label}", [](auto& m) {{ {statement}; }}}},' for label, statement in self.faults(topic.struct, "m", "")]
            lines += ["    };", "  }", "};"]
        return "\n".join([*lines, "", f"using Messages = testing::Types<{', '.join(f'msg::{name}' for name in sorted(first))}>;", ""])

    def list(self):
        """An X-macro: TOPIC(constant, message) for each topic."""
        return "\n".join([f"/* {MADE} */", *(f"TOPIC({topic.constant}, {topic.struct.name})" for topic in self.topics), ""])


def outputs(files):
    samples = Samples(files)
    return {"phantom_contract/topic_samples.inc": samples.text(), "phantom_contract/topic_faults.inc": samples.cases(),
            "phantom_contract/topics.def": samples.list()}
