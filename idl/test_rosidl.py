#!/usr/bin/env python3
"""Tests of rosidl.py and check_interfaces.py: every kind of disagreement must be found."""

import pathlib
import shutil
import tempfile
import unittest

import check_interfaces
import rosidl

MSG = """# comment
uint8 ON=1
std_msgs/Header header  # trailing
float64[4] k
uint8[] data
string<=8 tag
Other[] others
"""
IDL = """module p { module msg { module dds_ { @final struct Thing_ {
  std_msgs::msg::dds_::Header_ header; double k[4]; sequence<uint8> data; string<8> tag;
  sequence<p::msg::dds_::Other_> others; }; }; }; };"""


def idl_of(text):
    return rosidl.parse_idl(text, "p", "Thing", "test")


class AgreementTest(unittest.TestCase):
    def setUp(self):
        self.msg = rosidl.parse_msg(MSG, "p", "Thing", "test")

    def test_the_same_message_agrees(self):
        self.assertEqual(rosidl.differences(idl_of(IDL), self.msg), [])
        self.assertEqual(self.msg.constants, (("uint8", "ON", "1"),))

    def test_each_change_is_found(self):
        changes = [("double k[4]", "double k[5]"), ("double k[4]", "float k[4]"),
                   ("double k[4]", "double q[4]"), ("sequence<uint8> data", "uint8 data"),
                   ("string<8>", "string<9>"), ("Other_", "Another_"),
                   ("sequence<uint8> data; string<8> tag;", "string<8> tag; sequence<uint8> data;"),
                   ("double k[4];", ""), ("others;", "others; boolean more;")]
        for old, new in changes:
            with self.subTest(old=old, new=new):
                self.assertIn(old, IDL)
                self.assertNotEqual(rosidl.differences(idl_of(IDL.replace(old, new)), self.msg), [])

    def test_other_shapes_are_refused(self):
        for old, new in [("@final", "@appendable"), ("dds_ {", "idl_ {"), ("Thing_", "Thong_"),
                         ("double k[4]", "wchar k[4]")]:
            with self.subTest(new=new), self.assertRaises(rosidl.InterfaceError):
                idl_of(IDL.replace(old, new))

    def test_unreadable_msg_line_is_named(self):
        with self.assertRaisesRegex(rosidl.InterfaceError, "here:2"):
            rosidl.parse_msg("uint8 a\nuint8\n", "p", "Thing", "here")


class CheckTest(unittest.TestCase):
    def test_missing_files_and_wrong_hashes_are_found(self):
        time = rosidl.parse_msg("int32 sec\nuint32 nanosec\n", "builtin_interfaces", "Time", "t")
        key = time.key()
        good = {key: rosidl.type_hash(time, {key: time})}
        self.assertEqual(check_interfaces.check({key: time}, {key: time}, good), [])
        self.assertEqual(len(check_interfaces.check({}, {key: time}, {})), 1)
        self.assertEqual(len(check_interfaces.check({key: time}, {}, {})), 1)
        bad = {key: good[key][:-1] + "x"}
        self.assertEqual(len(check_interfaces.check({key: time}, {key: time}, bad)), 1)


class PackageTest(unittest.TestCase):
    PACKAGE = pathlib.Path(__file__).parent.parent / "ros2" / "sovo_msgs"

    def test_what_colcon_needs_is_missed(self):
        self.assertEqual(check_interfaces.check_package(self.PACKAGE), [])
        for file, old, new in [("package.xml", "<depend>std_msgs</depend>", ""),
                               ("package.xml", "rosidl_interface_packages", "others"),
                               ("package.xml", "<name>sovo_msgs", "<name>other"),
                               ("CMakeLists.txt", "find_package(geometry_msgs REQUIRED)", ""),
                               ("CMakeLists.txt", " geometry_msgs std_msgs)", " std_msgs)")]:
            with self.subTest(file=file, old=old), tempfile.TemporaryDirectory() as folder:
                package = pathlib.Path(folder) / "sovo_msgs"
                shutil.copytree(self.PACKAGE, package)
                text = (package / file).read_text()
                self.assertIn(old, text)
                (package / file).write_text(text.replace(old, new))
                self.assertEqual(len(check_interfaces.check_package(package)), 1)


if __name__ == "__main__":
    unittest.main()
