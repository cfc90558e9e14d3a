"""The bus as RTPS implementations other than Cyclone DDS see it (tests/interop)."""

import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import zlib

import harness
from harness import DATASET, ROOT
from bus_test import BusTest

MODULES = ROOT / "build" / "interop" / "node_modules"


def decode_png(path):
    """Rows of an 8-bit grey PNG, as one byte string."""
    data, at, body, width = path.read_bytes(), 8, b"", 0
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            width = struct.unpack(">I", data[at + 8:at + 12])[0]
        if kind == b"IDAT":
            body += data[at + 8:at + 8 + length]
        at += length + 12
    raw, above, out = zlib.decompress(body), bytearray(width), b""
    for start in range(0, len(raw), width + 1):
        filtering, row = raw[start], bytearray(raw[start + 1:start + 1 + width])
        for x in range(width):
            a, b, c = (row[x - 1] if x else 0), above[x], (above[x - 1] if x else 0)
            nearest = min((a, b, c), key=lambda v: abs(a + b - c - v))
            row[x] = (row[x] + (0, a, b, (a + b) // 2, nearest)[filtering]) & 255
        out, above = out + bytes(row), row
    return out


class Interop(BusTest):
    """Reads what our processes write with a program of another vendor."""

    def read(self, program, topics, environment=None):
        """A message of each topic, by its name without the namespace."""
        domain, ns = self.bus[1], self.bus[3]
        wanted = [f"/{ns}/{topic}={kind}" for topic, kind in topics.items()]
        result = subprocess.run([*map(str, program), str(domain), "60", *wanted],
                                capture_output=True, text=True, timeout=120, check=False,
                                env={**os.environ, **(environment or {})})
        self.assertEqual(result.returncode, 0, result.stderr)
        lines = [json.loads(line) for line in result.stdout.splitlines()]
        return {line["topic"].split("/", 2)[2]: line for line in lines}

    def start_processes(self):
        self.start("vo")
        self.start("camera", "dataset", "--path", DATASET, "--rate", "0.1")

    def check_odometry(self, odometry):
        self.assertEqual(odometry["child_frame_id"].split("/")[-1], "base_link")
        q = odometry["pose"]["pose"]["orientation"]
        self.assertAlmostEqual(sum(v * v for v in q.values()), 1.0, places=6)
        self.assertEqual(len(odometry["pose"]["covariance"]), 36)
        self.assertGreaterEqual(odometry["pose"]["covariance"][0], 0.0)

    def check_camera_info(self, info):
        sensor = (pathlib.Path(DATASET) / "mav0/cam0/sensor.yaml").read_text()
        numbers = re.search(r"^intrinsics: *\[(.*)\]", sensor, re.M).group(1)
        fu, fv, cu, cv = (float(n) for n in numbers.split(","))
        self.assertEqual(info["k"], [fu, 0, cu, 0, fv, cv, 0, 0, 1])
        self.assertEqual(info["distortion_model"], "plumb_bob")

    def check_image(self, image):
        stamp = image["header"]["stamp"]
        name = f"{stamp['sec']}{stamp['nanosec']:09d}.png"
        file = pathlib.Path(DATASET) / "mav0/cam0/data" / name
        self.assertTrue(file.is_file(), f"no frame of the dataset has the stamp of {name}")
        self.assertEqual(image["encoding"], "mono8")
        self.assertEqual(bytes(image["data"]), decode_png(file))


TYPES = {"odom": "nav_msgs/Odometry", "left/camera_info": "sensor_msgs/CameraInfo",
         "left/image_raw": "sensor_msgs/Image"}


class IndependentReader(Interop):
    def setUp(self):
        super().setUp()
        if shutil.which("node") is None:
            self.skipTest("node is not installed")
        if not MODULES.is_dir():
            self.skipTest(f"no node packages in {MODULES}; scripts/test installs them")

    def test_odometry_camera_info_and_images_are_decoded(self):
        self.start_processes()
        read = self.read(["node", ROOT / "tests" / "interop" / "read_topics.cjs"],
                         {**TYPES, "left/preview/compressed": "sensor_msgs/CompressedImage"},
                         {"NODE_PATH": str(MODULES)})
        self.check_camera_info(read["left/camera_info"]["message"])
        self.check_image(read["left/image_raw"]["message"])
        self.check_odometry(read["odom"]["message"])
        self.assertEqual(read["odom"]["dds_type"], "nav_msgs::msg::dds_::Odometry_")
        self.assertTrue(read["odom"]["user_data"].startswith("typehash=RIHS01_"))
        preview = bytes(read["left/preview/compressed"]["message"]["data"])
        self.assertEqual((preview[:2], preview[-2:]), (b"\xff\xd8", b"\xff\xd9"))


class FastDds(Interop):
    def test_odometry_camera_info_and_images_are_decoded(self):
        reader = pathlib.Path(harness.SOVO).parent / "fastdds_reader"
        if not reader.exists():
            self.skipTest("fastdds_reader is not built: no libfastrtps-dev, or a sanitized build")
        self.start_processes()
        read = self.read([reader], TYPES)
        self.check_camera_info(read["left/camera_info"]["message"])
        self.check_image(read["left/image_raw"]["message"])
        self.check_odometry(read["odom"]["message"])


if __name__ == "__main__":
    harness.main()
