"""Reads the part of IDL that this folder uses, with its comments: modules, structs, enumerations, typedefs of arrays, constants.

A tag [@NAME VALUE] in a comment says what IDL itself does not: unit, range, quality of service, rights. A comment belongs to the member on
whose line it begins, also where it goes on below it in the same column; else to the definition or member that follows.
"""
import re
from dataclasses import dataclass, field
from pathlib import Path

TOKEN = re.compile(r"(?P<space>\s+)|//(?P<comment>[^\n]*)|(?P<directive>#[^\n]*)|(?P<word>@?[A-Za-z_][\w:]*|-?[\d.]+)|(?P<sign>[{}<>\[\]();,=])")
TAG = re.compile(r"\[@(\w+)\s*([^\]]*)\]")


class IdlError(ValueError):
    """What is wrong, with file and line, and what is allowed."""


@dataclass
class Member:
    """A member of a struct: `type` is "double", "string", "sequence" or a type's name; `element` a sequence's; `bound` of a string or
    sequence, 0: none; `count` of an array, 0: none."""
    name: str
    type: str
    place: str
    element: str = ""
    bound: int = 0
    count: int = 0
    key: bool = False
    comment: str = ""

    @property
    def tags(self):
        return dict((name, value.strip()) for name, value in TAG.findall(self.comment))

    def text(self):
        """The comment without its tags."""
        return " ".join(TAG.sub("", self.comment).split())


@dataclass
class Struct:
    name: str
    module: tuple
    place: str
    comment: str
    members: list = field(default_factory=list)


@dataclass
class Enumeration:
    name: str
    module: tuple
    place: str
    comment: str
    values: list = field(default_factory=list)
    about: list = field(default_factory=list)   # the comment of each value


@dataclass
class File:
    name: str
    structs: list = field(default_factory=list)
    enumerations: list = field(default_factory=list)
    arrays: dict = field(default_factory=dict)  # typedefs: name → (element, count)
    head: str = ""                              # comment at the top


class Reader:
    """Reads one file; raises IdlError."""

    def __init__(self, path, text=None):
        self.path, self.tokens = Path(path), []
        text = self.path.read_text(encoding="utf-8") if text is None else text
        at, line, begin = 0, 1, 0
        while at < len(text):
            found = TOKEN.match(text, at)
            if not found:
                raise IdlError(f"{self.path.name}:{line}: unexpected character '{text[at]}'")
            kind = found.lastgroup
            if kind in ("comment", "word", "sign"):
                self.tokens.append((kind, found[kind], line, at - begin))
            at = found.end()
            if "\n" in found[0]:
                line += found[0].count("\n")
                begin = text.rindex("\n", 0, at) + 1

    def place(self):
        return f"{self.path.name}:{self.tokens[0][2]}" if self.tokens else f"{self.path.name}: the end"

    def comments(self):
        """The comments that stand before the next word, joined."""
        parts = []
        while self.tokens and self.tokens[0][0] == "comment":
            parts.append(self.tokens.pop(0)[1].strip())
        return "\n".join(parts)

    def trailing(self, line):
        """The comment on `line`, behind what was read, and what goes on below it in the same column."""
        parts, column = [], None
        while self.tokens and self.tokens[0][0] == "comment":
            _, text, at, its_column = self.tokens[0]
            if at != line or (column is not None and its_column != column):
                break
            parts.append(text.strip())
            column, line = its_column, line + 1
            self.tokens.pop(0)
        return "\n".join(parts)

    def next(self, *allowed):
        where = self.place()
        kind, text, self.line, _ = self.tokens.pop(0) if self.tokens else ("end", "the end", 0, 0)
        if kind == "comment":
            return self.next(*allowed)
        if allowed and text not in allowed:
            raise IdlError(f"{where}: found '{text}'; allowed: {', '.join(allowed)}")
        return text

    def read(self):
        file, module = File(self.path.stem), []
        comment = file.head = self.comments()
        while self.tokens:
            comment = self.comments() or comment
            if not self.tokens:
                break
            place, word = self.place(), self.next()
            if word == "module":
                module.append(self.next())
                self.next("{")
            elif word == "}":
                module.pop()
                self.next(";")
            elif word == "struct":
                file.structs.append(self.struct(tuple(module), place, comment))
            elif word == "enum":
                file.enumerations.append(self.enumeration(tuple(module), place, comment))
            elif word == "typedef":
                member = self.member("")
                file.arrays[member.name] = (member.type, member.count)
            elif word == "const":
                while self.next() != ";":
                    pass
            elif word.startswith("@"):
                continue
            else:
                raise IdlError(f"{place}: found '{word}'; allowed: module, struct, enum, typedef, const")
            comment = ""
        return file

    def struct(self, module, place, comment):
        struct = Struct(self.next(), module, place, comment)
        self.next("{")
        while True:
            before = self.comments()
            if self.tokens and self.tokens[0][1] == "}":
                break
            struct.members.append(self.member(before))
        self.next("}")
        self.next(";")
        return struct

    def member(self, comment):
        place, word, key = self.place(), self.next(), False
        if word == "@key":
            key, word = True, self.next()
        kind, element, bound = self.type(word)
        name, count = self.next(), 0
        if self.next(";", "[") == "[":
            count = int(self.next())
            self.next("]")
            self.next(";")
        comment = "\n".join(filter(None, (comment, self.trailing(self.line))))
        return Member(name, kind, place, element, bound, count, key, comment)

    def type(self, word):
        """Returns type, element and bound."""
        if word == "sequence":
            self.next("<")
            element, _, _ = self.type(self.next())
            bound = int(self.next()) if self.next(",", ">") == "," else 0
            if bound:
                self.next(">")
            return "sequence", element, bound
        if word == "string" and self.tokens[0][1] == "<":
            self.next("<")
            bound = int(self.next())
            self.next(">")
            return "string", "", bound
        words = [word]
        while words[-1] in ("unsigned", "long") and self.tokens[0][1] in ("long", "short"):
            words.append(self.next())
        return " ".join(words), "", 0

    def enumeration(self, module, place, comment):
        enumeration = Enumeration(self.next(), module, place, comment)
        self.next("{")
        while True:
            self.comments()
            enumeration.values.append(self.next())
            line = self.line
            sign = self.tokens and self.tokens[0][1]
            if sign == ",":
                self.next()
            enumeration.about.append(" ".join(TAG.sub("", self.trailing(line)).split()))
            if sign != ",":
                self.next("}")
                break
        self.next(";")
        return enumeration
