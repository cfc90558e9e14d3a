#!/usr/bin/env python3
"""Writes type_hashes.h and message_traits.h from the .msg files.

Usage: generate_headers.py OUTPUT_DIR MSG_DIR...
"""

import pathlib
import sys

import rosidl

BANNER = "// Generated from the .msg files by idl/generate_headers.py.\n#pragma once\n\n"
SEPARATOR = "=" * 80
CONSTANT_TYPES = {"byte": "std::uint8_t", "uint8": "std::uint8_t"}

TRAITS_TOP = """
namespace sovo::bridge {{

/// What the bridge knows about a message type: its ROS 2 name, type hash, descriptor, .msg text
/// with those of all types in it, constants, and a visitor of its fields in wire order.
template <class T>
struct MessageTraits;

namespace msg {{
{aliases}
}}  // namespace msg

"""
TRAITS = """template <>
struct MessageTraits<{c_name}> {{
  static constexpr const char* kRosName = "{ros_name}";
  static constexpr const char* kHash = type_hash::{hash_name};
  static constexpr const char* kDefinition = R"msg({definition})msg";
  static const dds_topic_descriptor_t& descriptor() {{ return {c_name}_desc; }}
{constants}
  /// Calls visitor("name", field) for every field.
  template <class Message, class Visitor>
  static void visit([[maybe_unused]] Message& m, Visitor&& visitor) {{
{visits}
  }}
}};

"""
FOR_EACH = """/// Calls f.template operator()<T>() for every message type.
template <class F>
void for_each_message_type(F&& f) {{
{calls}
}}

}}  // namespace sovo::bridge
"""


def c_name(message):
    return f"{message.package}_msg_dds__{message.name}_"


def alias(message):
    return message.name + ("Humble" if message.package.endswith("_humble") else "")


def hash_name(message):
    return "k" + "".join(part.capitalize() for part in message.package.split("_")) + message.name


def definition(message, messages, texts):
    """The schema that recordings carry: the .msg text, then those of all types in it."""
    parts = [texts[message.key()].rstrip("\n")]
    for key in rosidl.referenced(message, messages):
        parts.append(f"MSG: {key}\n" + texts[key].rstrip("\n"))
    return f"\n{SEPARATOR}\n".join(parts) + "\n"


def write_hashes(path, messages):
    out = BANNER + "/// RIHS01 type hashes, as ROS 2 computes them.\nnamespace sovo::type_hash {\n\n"
    for message in messages.values():
        value = rosidl.type_hash(message, messages)
        out += f"inline constexpr char {hash_name(message)}[] =\n    \"{value}\";\n"
    path.write_text(out + "\n}  // namespace sovo::type_hash\n")


def write_traits(path, messages, texts):
    includes = [f'#include "{m.package}/msg/{m.name}.h"' for m in messages.values()]
    out = BANNER + "#include <cstdint>\n\n" + "\n".join(includes) + '\n#include "type_hashes.h"\n'
    aliases = "\n".join(f"using {alias(m)} = ::{c_name(m)};" for m in messages.values())
    out += TRAITS_TOP.format(aliases=aliases)
    for m in messages.values():
        constants = "".join(f"  static constexpr {CONSTANT_TYPES[t]} {n} = {v};\n"
                            for t, n, v in m.constants)
        visits = "\n".join(f'    visitor("{f.name}", m.{f.name});' for f in m.fields)
        out += TRAITS.format(c_name=c_name(m), ros_name=m.ros_name(), hash_name=hash_name(m),
                             definition=definition(m, messages, texts), constants=constants,
                             visits=visits)
    calls = "\n".join(f"  f.template operator()<msg::{alias(m)}>();" for m in messages.values())
    path.write_text(out + FOR_EACH.format(calls=calls))


def main():
    output, *directories = (pathlib.Path(a) for a in sys.argv[1:])
    messages, texts = {}, {}
    for directory in directories:
        messages.update(rosidl.load_messages(directory))
        for path in directory.glob("*/msg/*.msg"):
            texts[f"{path.parent.parent.name}/{path.stem}"] = path.read_text()
    messages = dict(sorted(messages.items()))
    output.mkdir(parents=True, exist_ok=True)
    write_hashes(output / "type_hashes.h", messages)
    write_traits(output / "message_traits.h", messages, texts)


if __name__ == "__main__":
    main()
