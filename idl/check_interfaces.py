#!/usr/bin/env python3
"""Fails when IDL and .msg files disagree, or a type hash differs from the one ROS 2 has.

Usage: check_interfaces.py IDL_DIR MSG_DIR...
"""

import pathlib
import sys

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
    for error in errors:
        print(error, file=sys.stderr)
    print(f"{len(idl)} types and {len(golden)} hashes checked, {len(errors)} errors")
    return 1 if errors or not idl or not golden else 0


if __name__ == "__main__":
    sys.exit(main())
