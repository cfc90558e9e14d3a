#!/usr/bin/env python3
"""Fails when IDL and .msg files disagree, or a type hash differs from the one ROS 2 has.

Usage: check_interfaces.py IDL_DIR MSG_DIR...
"""

import pathlib
import re
import sys
import xml.etree.ElementTree

import rosidl


def load_golden(path):
    lines = [line.split() for line in path.read_text().splitlines() if line[:1] not in ("", "#")]
    return {key: expected for key, expected in lines}


def check(idl, messages, golden):
    """Sentences about everything that is wrong."""
    errors = [f"{key}: has IDL but no .msg file" for key in sorted(idl.keys() - messages.keys())]
    errors += [f"{key}: has a .msg file but no IDL" for key in sorted(messages.keys() - idl.keys())]
    for key in sorted(idl.keys() & messages.keys()):
        errors += rosidl.differences(idl[key], messages[key])
    for key, expected in golden.items():
        computed = rosidl.type_hash(messages[key], messages) if key in messages else "no such type"
        if computed != expected:
            errors.append(f"{key}: type hash {computed}, ROS 2 has {expected}")
    return errors


def check_package(folder):
    """Sentences about what keeps colcon from building a package of messages."""
    texts = [path.read_text() for path in sorted((folder / "msg").glob("*.msg"))]
    used = {name for text in texts for name in re.findall(r"^\s*(\w+)/\w+", text, re.MULTILINE)}
    root = xml.etree.ElementTree.parse(folder / "package.xml").getroot()
    depends = {element.text for element in root.iter("depend")}
    cmake = (folder / "CMakeLists.txt").read_text()
    found = set(re.findall(r"find_package\((\w+) REQUIRED\)", cmake))
    generated = set(re.search(r"DEPENDENCIES ([\w ]+)\)", cmake)[1].split())
    errors = [] if texts else [f"{folder}: has no messages"]
    for place, names in [("<depend>", depends), ("find_package", found), ("DEPENDENCIES", generated)]:
        errors += [f"{folder}: {name} is used and not in {place}" for name in sorted(used - names)]
    if f"project({root.findtext('name')})" not in cmake:
        errors.append(f"{folder}: package.xml and CMakeLists.txt have different names")
    groups = {element.text for element in root.iter("member_of_group")}
    if "rosidl_interface_packages" not in groups:
        errors.append(f"{folder}: not a member of rosidl_interface_packages")
    return errors


def main():
    idl_dir, *msg_dirs = (pathlib.Path(a) for a in sys.argv[1:])
    messages = {}
    for directory in msg_dirs:
        messages.update(rosidl.load_messages(directory))
    idl = rosidl.load_idl(idl_dir)
    golden = load_golden(idl_dir / "golden_type_hashes.txt")
    try:
        errors = check(idl, messages, golden)
    except rosidl.InterfaceError as error:
        errors = [str(error)]
    for directory in msg_dirs:
        for package in sorted(directory.glob("*/package.xml")):
            errors += check_package(package.parent)
    for error in errors:
        print(error, file=sys.stderr)
    print(f"{len(idl)} types and {len(golden)} hashes checked, {len(errors)} errors")
    return 1 if errors or not idl or not golden else 0


if __name__ == "__main__":
    sys.exit(main())
