"""Topics of the IDL: specifications, profiles of QoS, rights, and the table that people read."""
import re
from dataclasses import dataclass
from xml.sax.saxutils import escape

from idl_reader import TAG, IdlError

MADE = "Made by idl/contract.py from the IDL."


MIN_ROOM = 64  # samples of a reader: what a writer of 1 kHz sends between two heartbeats


@dataclass
class Qos:
    """`keys`, `reader_keys`: instances that a writer, a reader has room for."""
    kind: str
    reliable: bool
    durable: bool = False
    depth: int = 1
    deadline_ms: int = 0
    lease_ms: int = 0
    heartbeat_ms: int = 50
    keys: int = 1
    reader_keys: int = 1
    growing: bool = False
    fragments: bool = False

    def samples(self, reader):
        """The limit of samples. Fast DDS's reader refuses a sample while as many before it are missing as it has room for, even if
        those have been replaced meanwhile (DataReaderHistory::received_change): so it has room for more than it keeps."""
        return max(MIN_ROOM, self.depth * self.reader_keys) if reader else self.depth * self.keys

    def memory(self):
        """How Fast DDS keeps samples: at most of the type's size, grown as needed, or as large as each is."""
        if self.kind in ("durable", "large"):
            return "DYNAMIC_REUSABLE"
        return "PREALLOCATED_WITH_REALLOC" if self.kind == "event" or self.growing else "PREALLOCATED"


# What a class stands for, and what may follow it.
CLASSES = {
    "periodic": (dict(reliable=False), {"deadline", "lease", "growing", "fragments"}),
    "event": (dict(reliable=True, depth=64), set()),
    "durable": (dict(reliable=True, durable=True), {"keys", "reader keys", "heartbeat", "fragments"}),
    "large": (dict(reliable=True, fragments=True), set()),
}


@dataclass
class Topic:
    name: str
    struct: object
    family: str
    place: str
    about: str
    qos: Qos
    rate: str
    writers: list
    readers: list

    @property
    def constant(self):
        return "k" + "".join(part.capitalize() for part in self.name.split("_"))


def fail(place, what):
    raise IdlError(f"{place}: {what}")


def read_qos(text, place):
    kind, *more = [part.strip() for part in text.split(",")]
    if kind not in CLASSES:
        fail(place, f"@qos '{kind}'; allowed: {', '.join(CLASSES)}")
    fixed, allowed = CLASSES[kind]
    qos = Qos(kind=kind, **fixed)
    for part in more:
        found = re.fullmatch(r"(growing|fragments)|(deadline|lease|heartbeat) (\d+) ms|(keys|reader keys) (\d+)", part)
        name = found and (found[1] or found[2] or found[4])
        if not found or name not in allowed:
            fail(place, f"@qos {kind}: '{part}'; allowed: {', '.join(sorted(allowed)) or 'nothing more'} (times as '20 ms')")
        if found[1]:
            setattr(qos, name, True)
        else:
            setattr(qos, name.replace(" ", "_") + ("_ms" if found[2] else ""), int(found[3] or found[5]))
    if kind == "periodic":
        if not qos.deadline_ms or not qos.lease_ms:
            fail(place, "@qos periodic needs a deadline and a lease")
        qos.reliable = qos.fragments  # a best-effort reader of Fast DDS 3.1 ends its process after a lost fragment
    if kind == "durable":
        qos.reader_keys = max(qos.reader_keys, qos.keys)
    return qos


def topics(files):
    """All topics, in the order of the files."""
    result = []
    for file in files:
        for struct in file.structs:
            for part in re.split(r"(?m)^(?=Topic \w+:)", struct.comment):
                found = re.match(r"Topic (\w+): (.*)", part, re.S)
                if not found:
                    continue
                tags = {name: " ".join(value.split()) for name, value in TAG.findall(part)}
                unknown = set(tags) - {"qos", "rate", "writers", "readers", "frame", "range"}
                if unknown or "qos" not in tags:
                    fail(struct.place, f"topic {found[1]} {'has a tag @' + min(unknown) if unknown else 'lacks @qos'}; "
                                       "allowed: @qos (needed), @rate, @writers, @readers")
                if any(known.name == found[1] for known in result):
                    fail(struct.place, f"topic {found[1]} comes twice; allowed: once")
                result.append(Topic(found[1], struct, file.name, struct.place, " ".join(TAG.sub("", found[2]).split()),
                                    read_qos(tags["qos"], struct.place), tags.get("rate", ""),
                                    tags.get("writers", "").split(), tags.get("readers", "").split()))
    return result


def observers(files):
    return [name for file in files for tag, value in TAG.findall(file.head) if tag == "observers" for name in value.split()]


def type_name(topic):
    return "::".join((*topic.struct.module, topic.struct.name))


def declarations(all_topics):
    families = sorted({topic.family for topic in all_topics})
    lines = ["#pragma once", "", f"// {MADE} A topic's name, type and QoS contract are one constant.", "",
             '#include "common/dds/endpoints/topic_spec.hpp"', *(f'#include "phantom_idl/{family}.hpp"' for family in families), "",
             "namespace phantom::dds {", ""]
    for topic in all_topics:
        lines += [f"/// {topic.about}", *([f"/// Rate: {topic.rate}."] if topic.rate else []),
                  f"extern const TopicSpec<msg::{topic.struct.name}> {topic.constant};"]
    return "\n".join([*lines, "", "}  // namespace phantom::dds", ""])


def definitions(all_topics):
    families = sorted({topic.family for topic in all_topics})
    lines = [f"// {MADE} Included by common/dds/endpoints/topics.cpp.", ""]
    head = [*(f'#include "phantom_idl/{family}PubSubTypes.hpp"' for family in families), ""]
    for topic in all_topics:
        qos = topic.qos
        lines.append(
            f"const TopicSpec<msg::{topic.struct.name}> {topic.constant}{{\n"
            f'    {{"{topic.name}",\n     "{type_name(topic)}",\n'
            f"     {{.reliability = Reliability::{'kReliable' if qos.reliable else 'kBestEffort'},\n"
            f"      .durability = Durability::{'kTransientLocal' if qos.durable else 'kVolatile'},\n"
            f"      .history_depth = {qos.depth},\n      .deadline_ms = {qos.deadline_ms},\n      .liveliness_ms = {qos.lease_ms}}},\n"
            f"     &make_type<msg::{topic.struct.name}PubSubType>}}}};")
    names = "".join(f"    &{topic.constant},\n" for topic in all_topics)
    lines += ["", f"constexpr std::array<const TopicDescription*, {len(all_topics)}> kAllTopics{{\n{names}}};", ""]
    return "\n".join(head), "\n".join(lines)


def duration(ms):
    return f"<sec>{ms // 1000}</sec><nanosec>{ms % 1000 * 1_000_000}</nanosec>"


def profile(topic, reader):
    qos, end = topic.qos, "data_reader" if reader else "data_writer"
    lines = [f'    <{end} profile_name="{escape(topic.name)}">', "      <topic>",
             f"        <historyQos><kind>KEEP_LAST</kind><depth>{qos.depth}</depth></historyQos>"]
    if qos.kind != "periodic":
        samples, keys = qos.samples(reader), qos.reader_keys if reader else qos.keys
        lines.append(f"        <resourceLimitsQos><max_samples>{samples}</max_samples><max_instances>{keys}</max_instances>"
                     f"<max_samples_per_instance>{qos.depth}</max_samples_per_instance>"
                     f"<allocated_samples>{min(64, qos.samples(False))}</allocated_samples></resourceLimitsQos>")
    lines += ["      </topic>", "      <qos>",
              f"        <reliability><kind>{'RELIABLE' if qos.reliable else 'BEST_EFFORT'}</kind></reliability>",
              f"        <durability><kind>{'TRANSIENT_LOCAL' if qos.durable else 'VOLATILE'}</kind></durability>"]
    if qos.deadline_ms:
        lines.append(f"        <deadline><period>{duration(qos.deadline_ms)}</period></deadline>")
    if qos.lease_ms:
        announcement = "" if reader else f"<announcement_period>{duration(qos.lease_ms // 3)}</announcement_period>"
        lines.append(f"        <liveliness><kind>MANUAL_BY_TOPIC</kind><lease_duration>{duration(qos.lease_ms)}</lease_duration>"
                     f"{announcement}</liveliness>")
    if not reader:
        lines.append("        <publishMode><kind>SYNCHRONOUS</kind></publishMode>")
    lines += ["        <data_sharing><kind>OFF</kind></data_sharing>", "      </qos>"]
    if qos.reliable and reader:
        lines.append(f"      <times><initialAcknackDelay>{duration(0)}</initialAcknackDelay>"
                     f"<heartbeatResponseDelay>{duration(0)}</heartbeatResponseDelay></times>")
    elif qos.reliable:
        lines.append(f"      <times><heartbeatPeriod>{duration(qos.heartbeat_ms)}</heartbeatPeriod>"
                     f"<nackResponseDelay>{duration(0)}</nackResponseDelay>"
                     f"<nackSupressionDuration>{duration(40 if qos.fragments else 0)}</nackSupressionDuration></times>")
    return "\n".join([*lines, f"      <historyMemoryPolicy>{qos.memory()}</historyMemoryPolicy>", f"    </{end}>", ""])


def profiles(all_topics):
    """The XML profiles that Fast DDS reads: a data_writer and a data_reader of each topic."""
    return (f'<?xml version="1.0" encoding="UTF-8"?>\n<!-- {MADE} A site\'s own file (topology: qos_profiles) overrides elements of it. Data sharing\n'
            "     stays off: at depth 1 it loses samples, and it matches across separate shared memories without delivering. A reader of a\n"
            "     keyed topic takes more keys than one writer may have (common/dds/arbitration/key_quota.hpp). -->\n"
            '<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">\n  <profiles>\n'
            + "".join(profile(topic, reader) for topic in all_topics for reader in (False, True)) + "  </profiles>\n</dds>\n")


def rights(files):
    """A line for each participant: NAME | publishes | subscribes."""
    all_topics, names = topics(files), {}
    for topic in all_topics:
        for which, participants in enumerate((topic.writers, topic.readers)):
            for name in participants:
                names.setdefault(name, ([], []))[which].append(topic.name)
    for name in observers(files):
        names.setdefault(name, ([], []))[1][:] = ["*"]
    width = max(map(len, names), default=0)
    lines = [f"# {MADE} What each participant may publish and subscribe, by topic; `*` is every topic. Nobody may do anything else.",
             "# `make` signs it into permissions; tests/hosts holds it against what the running components really open."]
    lines += [f"{name:{width}} | {' '.join(names[name][0])} | {' '.join(names[name][1])}".rstrip() for name in sorted(names)]
    return "\n".join(lines) + "\n"


def table(files):
    def milliseconds(value):
        return f"{value} ms" if value else "–"
    lines = ["| topic | type | rate | reliability | durability | depth | deadline | liveliness | written by | read by |", "|---" * 10 + "|"]
    for topic in topics(files):
        qos = topic.qos
        lines.append(f"| `{topic.name}` | `{type_name(topic)}` | {topic.rate or '–'} | {'reliable' if qos.reliable else 'best effort'} | "
                     f"{'transient local' if qos.durable else 'volatile'} | {qos.depth} | {milliseconds(qos.deadline_ms)} | "
                     f"{milliseconds(qos.lease_ms)} | {', '.join(topic.writers)} | {', '.join(topic.readers)} |")
    return "\n".join(lines) + "\n"


def outputs(files):
    all_topics = topics(files)
    includes, constants = definitions(all_topics)
    xml = profiles(all_topics)
    return {"phantom_contract/topics.hpp": declarations(all_topics),
            "phantom_contract/topic_types.inc": f"// {MADE} Included by common/dds/endpoints/topics.cpp.\n{includes}",
            "phantom_contract/topics.inc": constants,
            "phantom_contract/qos_profiles.inc": f'// {MADE} Included by common/dds/endpoints/profiles.cpp.\nR"__xml__({xml})__xml__"\n',
            "qos_profiles.xml": xml,
            "rights": rights(files),
            "topics.md": f"# Topics\n{MADE}\n\n{table(files)}"}
