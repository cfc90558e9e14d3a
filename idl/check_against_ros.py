#!/usr/bin/env python3
"""Fails when ROS 2's own tools do not read our messages as rosidl.py does, or refuse the package.

Usage: check_against_ros.py MSG_DIR...

Needs Debian's python3-rosidl and python3-catkin-pkg; without them it says so and returns 77.
"""

import pathlib
import sys

import rosidl

try:
    import catkin_pkg.package
    from rosidl_adapter.parser import InvalidSpecification, InvalidValue, parse_message_file
except ImportError as missing:
    print(f"Skipped\n{missing}; scripts/install-deps --dev installs it")
    sys.exit(77)


def as_ros_reads_it(package, path):
    """A message by ROS 2's parser."""
    specification = parse_message_file(package, str(path))
    fields = []
    for field in specification.fields:
        kind = field.type
        base = f"{kind.pkg_name}/{kind.type}" if kind.pkg_name else kind.type
        fixed = kind.is_array and kind.array_size is not None and not kind.is_upper_bound
        array = "array" if fixed else "sequence" if kind.is_array else ""
        fields.append(rosidl.Field(field.name, base, kind.string_upper_bound or 0, array,
                                   kind.array_size if fixed else 0))
    constants = [(c.type, c.name, str(c.value)) for c in specification.constants]
    return rosidl.Message(package, specification.msg_name, tuple(fields), tuple(constants))


def main():
    errors, count = [], 0
    for directory in map(pathlib.Path, sys.argv[1:]):
        for key, ours in rosidl.load_messages(directory).items():
            path = directory / ours.package / "msg" / f"{ours.name}.msg"
            count += 1
            try:
                theirs = as_ros_reads_it(ours.package, path)
            except (InvalidSpecification, InvalidValue, NameError, TypeError, ValueError) as error:
                errors.append(f"{key}: ROS 2 refuses it: {error}")
                continue
            if theirs != ours:
                errors.append(f"{key}: ROS 2 reads {theirs}, rosidl.py {ours}")
        for package in sorted(directory.glob("*/package.xml")):
            try:
                catkin_pkg.package.parse_package(str(package)).validate()
            except catkin_pkg.package.InvalidPackage as error:
                errors.append(f"{package}: {error}")
    for error in errors:
        print(error, file=sys.stderr)
    print(f"{count} messages read, {len(errors)} errors")
    return 1 if errors or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
