"""Reads ROS 2 .msg files and this folder's IDL files, and computes RIHS01 type hashes.

The hash is the SHA-256 of the type description in JSON, as ROS 2's REP-2011 and
rosidl_generator_type_description define it: fields with their type ids, then every type they
refer to, sorted by name; constants, default values and comments do not enter.
"""

import hashlib
import json
import pathlib
import re
from dataclasses import dataclass

NESTED_TYPE_ID = 1
PRIMITIVE_TYPE_IDS = {
    "int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8,
    "uint64": 9, "float32": 10, "float64": 11, "char": 3, "bool": 15, "byte": 16, "string": 17,
}
BOUNDED_STRING_ID = 21
ARRAY_OFFSET, BOUNDED_SEQUENCE_OFFSET, SEQUENCE_OFFSET = 48, 96, 144

IDL_PRIMITIVES = {
    "int8": "int8", "uint8": "uint8", "int16": "int16", "uint16": "uint16", "int32": "int32",
    "uint32": "uint32", "int64": "int64", "uint64": "uint64", "float": "float32",
    "double": "float64", "boolean": "bool", "octet": "byte", "string": "string",
}


class InterfaceError(Exception):
    """A file that cannot be read as an interface; the text says which, where and why."""


@dataclass(frozen=True)
class Field:
    name: str
    base: str              # a primitive of .msg files, or "package/Name"
    string_bound: int = 0  # of string<=N
    array: str = ""        # "", "array" (fixed), "sequence"
    size: int = 0          # of a fixed array

    def nested(self):
        return "/" in self.base


@dataclass(frozen=True)
class Message:
    package: str
    name: str
    fields: tuple
    constants: tuple = ()  # (type, name, value)

    def key(self):
        return f"{self.package}/{self.name}"

    def ros_name(self):
        return f"{self.package}/msg/{self.name}"


def parse_msg(text, package, name, origin):
    """Message of a .msg text."""
    fields, constants = [], []
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.split("#")[0].strip()
        if not line:
            continue
        constant = re.fullmatch(r"(\w+)\s+([A-Z][A-Z0-9_]*)\s*=\s*(\S+)", line)
        if constant:
            constants.append(constant.groups())
            continue
        match = re.fullmatch(r"([\w/]+)(?:<=(\d+))?(\[(\d*)\])?\s+([a-z]\w*)(\s+\S+)?", line)
        if not match:
            raise InterfaceError(f"{origin}:{number}: cannot read '{line}'")
        base, bound, brackets, size, field = match.group(1, 2, 3, 4, 5)
        if base not in PRIMITIVE_TYPE_IDS and "/" not in base:
            base = f"{package}/{base}"
        array = "" if brackets is None else ("array" if size else "sequence")
        fields.append(Field(field, base, int(bound or 0), array, int(size or 0)))
    return Message(package, name, tuple(fields), tuple(constants))


def parse_idl(text, package, name, origin):
    """Message of an IDL file with one @final struct in module PACKAGE::msg::dds_."""
    text = re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.S)
    shape = re.search(r"module (\w+) \{\s*module msg \{\s*module dds_ \{\s*@final\s*"
                      r"struct (\w+) \{(.*?)\};\s*\};\s*\};\s*\};", text, re.S)
    if not shape:
        raise InterfaceError(f"{origin}: not one @final struct in a module ...::msg::dds_")
    if shape.group(1) != package or shape.group(2) != name + "_":
        raise InterfaceError(f"{origin}: holds {shape.group(1)}::msg::dds_::{shape.group(2)}, "
                             f"expected {package}::msg::dds_::{name}_")
    fields = [parse_idl_member(m.strip(), origin) for m in shape.group(3).split(";") if m.strip()]
    return Message(package, name, tuple(fields))


def parse_idl_member(member, origin):
    match = re.fullmatch(r"(sequence<(.+)>|\S+)\s+_?(\w+)(?:\[(\d+)\])?", member)
    if not match:
        raise InterfaceError(f"{origin}: cannot read member '{member}'")
    whole, element, field, size = match.groups()
    base = element or whole
    bound = re.fullmatch(r"string<(\d+)>", base)
    nested = re.fullmatch(r"(\w+)::msg::dds_::(\w+)_", base)
    if nested:
        base = f"{nested.group(1)}/{nested.group(2)}"
    elif bound:
        base = "string"
    elif base in IDL_PRIMITIVES:
        base = IDL_PRIMITIVES[base]
    else:
        raise InterfaceError(f"{origin}: unknown type in '{member}'")
    array = "sequence" if element else ("array" if size else "")
    return Field(field, base, int(bound.group(1)) if bound else 0, array, int(size or 0))


def differences(idl, msg):
    """Sentences that say where two forms of one message disagree; none when they agree."""

    def comparable(field):
        # .msg files write char where IDL has uint8.
        base = "uint8" if field.base == "char" else field.base
        return (field.name, base, field.string_bound, field.array, field.size)

    result = []
    for index, (a, b) in enumerate(zip(idl.fields, msg.fields)):
        if comparable(a) != comparable(b):
            result.append(f"{msg.key()} field {index}: IDL has {comparable(a)}, "
                          f".msg has {comparable(b)}")
    if len(idl.fields) != len(msg.fields):
        result.append(f"{msg.key()}: IDL has {len(idl.fields)} fields, "
                      f".msg has {len(msg.fields)}")
    return result


def load_messages(root):
    """Every message of the folders that hold PACKAGE/msg/NAME.msg, by "package/Name"."""
    return load(root, "*/msg/*.msg", parse_msg)


def load_idl(root):
    return load(root, "*/msg/*.idl", parse_idl)


def load(root, pattern, parse):
    result = {}
    for path in sorted(pathlib.Path(root).glob(pattern)):
        message = parse(path.read_text(), path.parent.parent.name, path.stem, path)
        result[message.key()] = message
    return result


def referenced(message, messages):
    """Keys of all types that a message refers to, directly or not, sorted."""
    found, queue = set(), [message]
    while queue:
        for field in queue.pop().fields:
            if not field.nested() or field.base in found:
                continue
            if field.base not in messages:
                raise InterfaceError(f"{message.key()}: no .msg file for {field.base}")
            found.add(field.base)
            queue.append(messages[field.base])
    return sorted(found)


def type_description(message):
    return {"type_name": message.ros_name(), "fields": [describe(f) for f in message.fields]}


def describe(field):
    if field.nested():
        type_id = NESTED_TYPE_ID
    elif field.string_bound:
        type_id = BOUNDED_STRING_ID
    else:
        type_id = PRIMITIVE_TYPE_IDS[field.base]
    type_id += {"": 0, "array": ARRAY_OFFSET, "sequence": SEQUENCE_OFFSET}[field.array]
    package, _, name = field.base.partition("/")
    return {"name": field.name, "type": {
        "type_id": type_id, "capacity": field.size, "string_capacity": field.string_bound,
        "nested_type_name": f"{package}/msg/{name}" if field.nested() else ""}}


def type_hash(message, messages):
    """RIHS01_ and 64 hexadecimal digits."""
    description = {
        "type_description": type_description(message),
        "referenced_type_descriptions": [
            type_description(messages[key]) for key in referenced(message, messages)],
    }
    text = json.dumps(description, separators=(", ", ": "), ensure_ascii=True)
    return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()
