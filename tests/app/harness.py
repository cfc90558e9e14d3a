"""What the tests of the command share: starting it, reading trajectories, comparing them."""

import errno
import functools
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import unittest

from trajectory import largest_error, largest_step_error, read_tum, rotate_back  # noqa: F401

SOVO = os.environ["SOVO"]
DATASET = os.environ["SOVO_SYNTHETIC"]
ROOT = pathlib.Path(os.environ["SOVO_ROOT"])
SMALL_RIG = ROOT / "tests/app/golden/small.yaml"  # 320x200, quick to render
SHARED = pathlib.Path(os.environ.get("SOVO_SHARED", ROOT / ".." / "shared"))

OK, FAILED, USAGE, BAD_INPUT = 0, 1, 2, 3


def sovo(*arguments, timeout=300):
    """Runs the command to its end."""
    return subprocess.run([SOVO, *map(str, arguments)], capture_output=True, text=True,
                          timeout=timeout, check=False)


def start(*arguments):
    """Starts the command; the caller ends it."""
    return subprocess.Popen([SOVO, *map(str, arguments)], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True)


@functools.cache
def hold_domain():
    """A DDS domain, 1 to 100, and what holds it for this process as long as it lives.

    It is a name in the abstract space of Unix sockets, which belongs to the network namespace as
    the domain does; tests/bridge/own_domain.h takes the same names."""
    holder = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    for i in range(100):
        domain = 1 + (os.getpid() + i) % 100
        try:
            holder.bind(f"\0sovo_test_domain_{domain}")
            return domain, holder
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
    raise RuntimeError("all DDS domains for tests are taken")


def own_domain():
    """The DDS domain that no other test process on this network has."""
    return hold_domain()[0]


class CommandTest(unittest.TestCase):
    """A test with a folder of its own."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def expect(self, result, code):
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result

    def wait_for_line(self, stream, text):
        """Reads lines until one has `text`; the lines read."""
        lines = []
        for line in stream:
            lines.append(line)
            if text in line:
                return lines
        self.fail(f"no line with {text!r} in:\n" + "".join(lines))


def main():
    """Runs the test case named on the command line; all skipped is the exit code 77."""
    program = unittest.main(module="__main__", argv=[sys.argv[0], "-v", *sys.argv[1:]], exit=False)
    result = program.result
    if not result.wasSuccessful():
        sys.exit(1)
    if result.skipped and len(result.skipped) == result.testsRun:
        sys.exit(77)
