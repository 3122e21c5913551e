"""A topology file, read as the components read it: keys, ranges and messages are those of
common/runtime/configuration/topology.yaml and deployment.cpp."""
import os
import re
import socket
from pathlib import Path


class TopologyError(Exception):
    """A fault of a topology file: file, line, key, value, and what is allowed."""


def is_ipv4(text):
    try:
        socket.inet_pton(socket.AF_INET, text)
    except (OSError, ValueError):
        return False
    return True


def is_server(text):
    address, _, port = text.rpartition(":")
    return is_ipv4(address) and re.fullmatch(r"[0-9]{1,5}", port) is not None and 1 <= int(port) <= 65535


def is_partition(text):
    return re.fullmatch(r"[A-Za-z0-9_.\-/]{1,64}", text) is not None


# What common/runtime/configuration/deployment.cpp asks of texts beyond the table of keys, in its words.
NO_ADDRESS = "is no address; allowed: IPv4, as 10.0.1.2"
RULES = {
    "interfaces": (is_ipv4, NO_ADDRESS),
    "initial_peers": (is_ipv4, NO_ADDRESS),
    "discovery_servers": (is_server, "is no server; allowed: IPv4 address and port, as 10.0.1.2:11811"),
    "partition": (is_partition, "is no name of a partition; allowed: 1 to 64 of A-Z a-z 0-9 _ - . /"),
}
FLAGS = {"y": True, "yes": True, "true": True, "on": True, "n": False, "no": False, "false": False, "off": False}
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.IGNORECASE)


class TableKey:
    """A key of common/runtime/configuration/topology.yaml: what its example value and the brackets of its comment allow."""

    def __init__(self, key, example, lines):
        brackets = re.search(r"# \[([^\]]*)\]", lines[key.start_mark.line])
        allowed = brackets.group(1) if brackets else ""
        bounds = re.search(r"(-?\d+) to (-?\d+)", allowed)
        self.name = key.value
        self.required = allowed.startswith("required")
        self.least, self.most = (int(bounds.group(1)), int(bounds.group(2))) if bounds else (None, None)
        mappings = [item for item in example.value if example.id == "sequence" and item.id == "mapping"]
        inner = example if example.id == "mapping" else mappings[0] if mappings else None
        self.keys = table_keys(inner, lines) if inner else []
        self.kind = self.kind_of(example)

    def kind_of(self, example):
        """In the words of the components' messages."""
        if example.id == "sequence":
            return "a list of mappings" if self.keys else "a list of texts"
        if example.id == "mapping":
            return "a mapping"
        if example.tag.endswith(":bool"):
            return "true or false"
        return f"{self.least} to {self.most}" if example.tag.endswith(":int") else "a text"


def table_keys(node, lines):
    return [TableKey(key, example, lines) for key, example in node.value]


def shown(node):
    return f"'{node.value}'" if node.id == "scalar" else f"a {'list' if node.id == 'sequence' else 'mapping'}"


class TopologyFile:
    """Reads a topology as the components do: the same keys, ranges and messages. `values`: by key, texts as they stand there."""

    def __init__(self, file, compose, keys):
        self.file, self.nodes = Path(file), {}
        root = self.root(compose)
        if root is not None and root.id != "mapping":
            raise TopologyError(f"{file}:1: the file must be a mapping of keys to values; it is {shown(root)}")
        self.values = self.mapping(root, keys, "")
        self.values.setdefault("hosts", [])
        for index, host in enumerate(self.values["hosts"]):
            self.refuse_equal_names(host, f"hosts[{index}]")
        self.refuse_mixed_discovery(self.values.get("network", {}))

    def root(self, compose):
        """None of an empty file."""
        try:
            root = compose(self.file.read_bytes().decode())
        except OSError as problem:
            raise TopologyError(f"{self.file}: cannot be read ({problem.strerror}); check that the file exists and may be read") from None
        except UnicodeDecodeError as problem:
            line = problem.object[:problem.start].count(b"\n") + 1
            raise TopologyError(f"{self.file}:{line}: holds a byte that is no text; allowed: UTF-8") from None
        return None if root is None or root.tag.endswith(":null") else root

    def refuse(self, node, place, problem):
        raise TopologyError(f"{self.file}:{node.start_mark.line + 1 if node else 1}: {place}: {problem}")

    def refuse_value(self, node, place, problem):
        self.refuse(node, place, f"{shown(node)} {problem}" if node.id == "scalar" else problem)

    def mapping(self, node, keys, place):
        given = self.given(node, keys, place) if node else {}
        values = {}
        for key in keys:
            if key.name in given:
                self.nodes[place + key.name] = given[key.name]
                values[key.name] = self.value(given[key.name], key, place + key.name)
            elif key.required:
                self.refuse(node, place + key.name, f"is missing; allowed: {key.kind}")
        return values

    def given(self, node, keys, place):
        """Value of each key that has one."""
        names, found = sorted(key.name for key in keys), {}
        for key, value in node.value:
            name = key.value if key.id == "scalar" else shown(key)
            if name not in names:
                self.refuse(key, place + name, f"unknown key; allowed: {', '.join(names)}")
            if name in found:
                self.refuse(key, place + name, "stands twice; allowed: once")
            found[name] = value
        return {name: value for name, value in found.items() if not value.tag.endswith(":null")}

    def value(self, node, key, place):
        if key.kind == "a list of mappings":
            return self.mappings(node, key, place)
        if key.kind == "a list of texts":
            return self.texts(node, key, place)
        if key.kind == "a mapping":
            if node.id != "mapping":
                self.refuse(node, place, f"is {shown(node)}; allowed: a mapping")
            return self.mapping(node, key.keys, place + ".")
        if key.kind == "true or false":
            return self.flag(node, place)
        return self.number(node, key, place) if key.least is not None else self.text(node, key, place)

    def mappings(self, node, key, place):
        if node.id != "sequence":
            self.refuse(node, place, f"is {shown(node)}; allowed: a list of mappings")
        for index, item in enumerate(node.value):
            if item.id != "mapping":
                self.refuse(item, place, f"holds {shown(item)} at {key.name}[{index}]; allowed: mappings")
        return [self.mapping(item, key.keys, f"{place}[{index}].") for index, item in enumerate(node.value)]

    def texts(self, node, key, place):
        if node.id != "sequence":
            self.refuse_value(node, place, "is not a list; allowed: a list of texts")
        return [self.text(item, key, place) for item in node.value]

    def text(self, node, key, place):
        if node.id != "scalar":
            self.refuse(node, place, f"is or holds {shown(node)}; allowed: a text")
        fits, problem = RULES.get(key.name, (None, ""))
        if fits and not fits(node.value):
            self.refuse_value(node, place, problem)
        return node.value

    def number(self, node, key, place):
        number = float(node.value) if node.id == "scalar" and NUMBER.fullmatch(node.value) else None
        problem = None
        if number is None:
            problem = "is not a number"
        elif not key.least <= number <= key.most:
            problem = "is out of range"
        elif number != int(number):
            problem = "is not a whole number"
        if problem:
            self.refuse_value(node, place, f"{problem}; allowed: {key.kind}")
        return int(number)

    def flag(self, node, place):
        text = node.value if node.id == "scalar" else ""
        if text.lower() not in FLAGS or text not in (text.lower(), text.upper(), text.capitalize()):
            self.refuse_value(node, place, "is not true or false; allowed: one of these")
        return FLAGS[text.lower()]

    def refuse_equal_names(self, host, place):
        names = []
        for index, process in enumerate(host.get("processes", [])):
            entry = f"{place}.processes[{index}]"
            name = process.get("name", process["component"])
            if name in names:
                key = "name" if "name" in process else "component"
                self.refuse_value(self.nodes[f"{entry}.{key}"], f"{entry}.{key}", "is there already; allowed: each name once per host (key name)")
            names.append(name)

    def refuse_mixed_discovery(self, network):
        place = "network.discovery_servers"
        if network.get("discovery_servers") and network.get("security"):
            self.refuse(self.nodes[place], place, "do not work together with security in this Fast DDS; allowed: initial_peers instead")
        if network.get("discovery_servers") and network.get("initial_peers"):
            self.refuse(self.nodes[place], place, "and initial_peers exclude each other; allowed: one of the two")

    def path(self, value):
        return self.file.parent / value

    def require_files(self, addresses):
        """QoS profiles, cell, and what the processes name of the host that has these addresses."""
        places = ["qos_profiles", "cell"]
        for host in self.own_hosts(addresses):
            processes = self.values["hosts"][host].get("processes", [])
            places += [f"hosts[{host}].processes[{index}].{key}" for index in range(len(processes)) for key in ("config", "cell")]
        for place in places:
            if place in self.nodes:
                self.require_file(self.nodes[place], place)

    def require_file(self, node, place):
        path = self.path(node.value)
        if os.path.isdir(path):
            self.refuse_value(node, place, f"is a folder ({path}); allowed: a file")
        if not os.path.exists(path):
            self.refuse_value(node, place, f"is not there ({path}); allowed: a file; relative paths begin at the topology's folder")

    def own_hosts(self, addresses):
        """Index of the host that has these addresses; the only one, if it names none; else no index."""
        pinned = {index: host["interfaces"] for index, host in enumerate(self.values["hosts"]) if host.get("interfaces")}
        if not pinned and len(self.values["hosts"]) == 1:
            return [0]
        return [index for index, wanted in pinned.items() if all(address in addresses for address in wanted)][:1]


def composed(yaml, file):
    """A function that parses text into YAML nodes."""
    def compose(text):
        try:
            return yaml.compose(text, yaml.SafeLoader)
        except yaml.MarkedYAMLError as problem:
            said = ", ".join(filter(None, (problem.context, problem.problem)))
            raise TopologyError(f"{file}:{(problem.problem_mark or problem.context_mark).line + 1}: not valid YAML: {said}") from None
        except yaml.reader.ReaderError as problem:
            raise TopologyError(f"{file}:{text[:problem.position].count(chr(10)) + 1}: not valid YAML: {problem.reason}") from None
        except RecursionError:
            raise TopologyError(f"{file}: not valid YAML: lists or mappings lie too deep in each other") from None
    return compose
