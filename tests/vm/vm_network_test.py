#!/usr/bin/env python3
"""A camera in a virtual machine, the odometry on the host, and a virtual network between them.

Usage: vm_network_test.py --bin DIRECTORY --work DIRECTORY [--prepare]

What it needs is in machine.py, and that a network namespace and a tap device can be made. The
camera is v4l2loopback, which shows a rendered walk; `sovo camera v4l2` publishes it from there, and
`sovo vo` and `sovo record` listen here.
"""

import concurrent.futures
import fcntl
import hashlib
import itertools
import math
import os
import pathlib
import re
import select
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time
import unittest

import machine
from machine import Missing, cases_of, checked

APP_TESTS = pathlib.Path(__file__).resolve().parent.parent / "app"
sys.path.append(str(APP_TESTS))
import mcap_bag  # noqa: E402
import trajectory  # noqa: E402

SMALL_RIG = APP_TESTS / "golden/small.yaml"
WIDTH, HEIGHT = 640, 200  # of both sides together
FRAMES = 60  # at 20 Hz of the walk's time
RATE = 5  # at which they are fed [Hz]
HOST, GUEST = "10.77.1.1", "10.77.1.2"
INTERFACE = "sovo0"
# Largest distance [m] between the trajectory over the network and the one from disk. What tracking
# has of mapping, which is on another thread, is chance: seven runs from disk, beside other work on
# both cores, were at most 0.017 m apart. Images that were lost add to that.
SPREAD = 0.05


def enter_private_network():
    """Goes on in a network namespace of its own: nothing that is made here is seen outside."""
    inside = "SOVO_PRIVATE_NETWORK"
    if os.environ.get(inside):
        return
    for flags in ("-n", "-rn"):
        if machine.run("unshare", flags, "true").returncode == 0:
            os.environ[inside] = "1"
            os.execvp("unshare", ["unshare", flags, sys.executable, *sys.argv])
    raise Missing("no network namespace can be made here")


def make_tap():
    """A tap device with the host's address; it is there as long as the descriptor is open."""
    set_interface, tap, no_packet_info = 0x400454CA, 0x0002, 0x1000  # linux/if_tun.h
    try:
        descriptor = os.open("/dev/net/tun", os.O_RDWR)
        fcntl.ioctl(descriptor, set_interface,
                    struct.pack("16sH22x", INTERFACE.encode(), tap | no_packet_info))
    except OSError as error:
        raise Missing(f"no tap device can be made here: /dev/net/tun: {error.strerror}") from error
    checked("ip", "link", "set", "lo", "up")
    checked("ip", "address", "add", f"{HOST}/24", "dev", INTERFACE)
    checked("ip", "link", "set", INTERFACE, "up")
    return descriptor


def enter():
    enter_private_network()
    Network.tap = make_tap()


def wait_until(condition, end):
    """Until `condition` holds, or `end`; whether it holds."""
    while not (held := condition()) and not end():
        time.sleep(0.1)
    return held


class Listener:
    """A command of sovo on this side of the network; its log is in a file."""

    def __init__(self, program, file, *arguments):
        self.file = file
        with open(self.file, "wb") as out:
            self.process = subprocess.Popen(
                [program, *map(str, arguments), "--network", INTERFACE],
                stdout=subprocess.DEVNULL, stderr=out)

    @property
    def log(self):
        return self.file.read_text(errors="replace")

    def ended(self):
        return self.process.poll() is not None

    def stop(self):
        """Ends it as a user does; its exit code."""
        if not self.ended():
            self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(120)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise


def checksum(rows):
    return hashlib.sha256(b"".join(rows)).hexdigest()


def source_numbers(images):
    """Checksums of the left and the right half's luma -> number of the image."""
    size = 2 * WIDTH * HEIGHT
    halves = {}
    for number in range(len(images) // size):
        luma = images[number * size:(number + 1) * size:2]
        rows = [luma[y * WIDTH:(y + 1) * WIDTH] for y in range(HEIGHT)]
        halves[checksum(r[:WIDTH // 2] for r in rows),
               checksum(r[WIDTH // 2:] for r in rows)] = number
    return halves


class Network(unittest.TestCase):
    """One boot for all of them."""

    machine = None
    tap = None

    @classmethod
    def setUpClass(cls):
        cls.sovo, cls.folder = cls.machine.bin / "sovo", cls.machine.work / "network"
        shutil.rmtree(cls.folder, ignore_errors=True)
        cls.folder.mkdir()
        cls.walk, cls.images = cls.folder / "walk", cls.folder / "walk.yuyv"
        cls.out, cls.recording = cls.folder / "vo.txt", cls.folder / "dive.mcap"
        cls.prepare_images()
        cls.run_over_the_network()
        reason = cls.reason_to_boot_again()
        if reason:
            print(f"booting once more: {reason}")
            cls.recording.unlink(missing_ok=True)
            cls.run_over_the_network()
        if "GUEST ENDED with 0" not in cls.console:
            raise RuntimeError("the machine did not end as it should:\n" + cls.console[-3000:])
        cls.camera_log = "\n".join(cases_of(cls.console)["network"])
        cls.take_results()

    @classmethod
    def reason_to_boot_again(cls):
        """A kernel that panics and a host that stands still for seconds are no fault of the
        camera's code; twice in a row, they are."""
        if "GUEST ENDED with 0" not in cls.console:
            return "the machine did not end as it should"
        if " 0 disconnects, 0 stalls" not in cls.console:
            return "the camera stalled"
        cls.take_results()
        received = len({number for _, number in cls.frames})
        return "" if received > FRAMES // 2 else f"only {received} of {FRAMES} images came"

    @classmethod
    def prepare_images(cls):
        """The walk as files, as the camera's images, and as `sovo run` sees it."""
        # The camera does not tell its exposure, and its calibration knows no vignette.
        checked(cls.sovo, "camera", "sim", "--world", "lawn", "--calib", SMALL_RIG,
                "--frames", FRAMES, "--export", cls.walk, "--set", "sim.sensor.auto_exposure=false",
                "--set", "sim.sensor.vignette=0")
        checked(cls.machine.bin / "side_by_side", cls.walk, cls.images)
        checked(cls.sovo, "run", "--dataset", cls.walk, "--deterministic",
                "--out", cls.folder / "disk.txt")

    @classmethod
    def run_over_the_network(cls):
        recorder = Listener(cls.sovo, cls.folder / "record.log", "record", "-o", cls.recording,
                            "--compression", "none", "--min-free", "1MB")
        vo = Listener(cls.sovo, cls.folder / "vo.log", "vo", "--out", cls.out)
        try:
            if not wait_until(lambda: "recording to" in recorder.log, recorder.ended):
                raise RuntimeError("nothing is recorded:\n" + recorder.log)
            with socket.create_server((HOST, 0)) as control, \
                    concurrent.futures.ThreadPoolExecutor() as worker:
                booted = worker.submit(cls.boot, control.getsockname()[1])
                cls.begin_when_heard(control, vo, booted)
                cls.console = booted.result()
        finally:
            cls.codes = [vo.stop(), recorder.stop()]
        cls.vo_log = vo.log

    @classmethod
    def boot(cls, port):
        words = {"address": f"{GUEST}/24", "control": f"{HOST}/{port}", "images": cls.images,
                 "calibration": cls.walk / "mav0/cam0/sensor.yaml", "width": WIDTH,
                 "height": HEIGHT, "rate": RATE, "frames": FRAMES}
        return cls.machine.boot(
            "guest_network.sh", 600, files=[cls.tap],
            devices=["-netdev", f"tap,id=n,fd={cls.tap}", "-device",
                     "virtio-net-pci,netdev=n,romfile="],
            words=[f"{key}={value}" for key, value in words.items()])

    @classmethod
    def begin_when_heard(cls, control, vo, booted):
        """The camera shows the first image until everybody here hears it."""

        def heard():
            return "tracking frames" in vo.log and \
                cls.recording.stat().st_size > 4 * WIDTH * HEIGHT

        def called():
            return select.select([control], [], [], 0)[0]

        if wait_until(called, booted.done):
            with control.accept()[0] as camera:
                if wait_until(heard, lambda: booted.done() or vo.ended()):
                    camera.sendall(b"begin\n")
                    booted.result()

    @classmethod
    def take_results(cls):
        """What was recorded, as (frame, number of the source's image or nothing)."""
        source = source_numbers(cls.images.read_bytes())
        assert len(source) == FRAMES, "two images of the walk are equal"
        cls.frames = []
        for message in mcap_bag.read_messages(cls.recording):
            if message.topic == "/sovo/stereo":
                frame = mcap_bag.read_stereo_frame(message.data)
                sides = tuple(checksum([side.data]) for side in (frame.left, frame.right))
                cls.frames.append((frame, source.get(sides)))
        cls.stamps = {f"{frame.stamp_ns // 10**9}.{frame.stamp_ns % 10**9:09d}": number
                      for frame, number in cls.frames}  # as trajectories have them

    def count(self, pattern, text):
        found = re.search(pattern, text)
        self.assertIsNotNone(found, pattern + " is not in:\n" + text[-3000:])
        return int(found[1])

    def test_everything_ends_cleanly(self):
        self.assertIn("WRITER ENDED with 0", self.camera_log)
        self.assertIn("CAMERA ENDED with 0", self.camera_log)
        self.assertEqual(self.codes, [0, 0], self.vo_log)

    def test_received_frames_are_the_source_s(self):
        for frame, number in self.frames:
            self.assertIsNotNone(number, f"frame {frame.sequence} is none of the source")
            for side in (frame.left, frame.right):
                self.assertEqual((side.valid, side.width, side.height, side.encoding),
                                 (True, WIDTH // 2, HEIGHT, "mono8"))
        numbers = [number for _, number in self.frames]
        self.assertGreater(len(set(numbers)), FRAMES // 2, numbers)
        moving = numbers[numbers.count(numbers[0]) - 1:]  # the first one was shown for a while
        self.assertEqual(moving, sorted(set(moving)))

    def test_every_loss_is_a_gap_in_the_sequence(self):
        self.assertIn(" 0 damaged, 0 short, 0 without room, 0 disconnects, 0 stalls",
                      self.camera_log)
        self.assertEqual(len({frame.session for frame, _ in self.frames}), 1)
        for (before, m), (frame, n) in itertools.pairwise(self.frames):
            self.assertGreater(frame.stamp_ns, before.stamp_ns)
            if m > 0:  # the first one came more than once
                self.assertEqual(frame.sequence - before.sequence, n - m, f"from {m} to {n}")

    def test_every_loss_is_counted(self):
        log = self.camera_log
        images, skipped = (self.count(p, log) for p in (r"(\d+) images,", r"images, (\d+) skipped"))
        published = self.count(r"published (\d+) frames", log)
        late = re.search(r"(\d+) frames dropped: publishing was too slow", log)
        unsent = images - published - (int(late[1]) if late else 0)
        self.assertIn(unsent, range(5), log)  # what its queue may hold at the end
        lost = self.count(r"lost in transport (\d+)", self.vo_log)
        dropped = self.count(r"dropped (\d+), malformed 0, foreign 0", self.vo_log)
        posed, recorded = self.poses(), {number for _, number in self.frames}
        print(f"{FRAMES} images fed, {len(recorded)} recorded, {len(posed)} with a pose; "
              f"camera: {skipped} skipped, {published} published; odometry: {lost} lost, "
              f"{dropped} dropped")
        self.assertNotIn("LOST", self.vo_log)
        # Which image a pose is of is known from the recording.
        unknown = sum(stamp not in self.stamps for stamp, _, _ in trajectory.read_tum(self.out))
        self.assertLessEqual(max(posed) + 1 - len(posed), lost + dropped + unknown)

    def poses(self):
        """Number of an image -> pose of the left camera by the odometry: the last of an image that
        came more than once."""
        return {self.stamps[stamp]: (p, q) for stamp, p, q in trajectory.read_tum(self.out)
                if stamp in self.stamps}

    def test_the_trajectory_is_that_from_disk(self):
        disk = [(n, p, q) for n, (_, p, q) in
                enumerate(trajectory.read_tum(self.folder / "disk.txt"))]
        self.assertEqual(len(disk), FRAMES)
        self.assertGreater(math.dist(disk[0][1], disk[-1][1]), 2.0)
        poses = self.poses()
        self.assertGreater(len(poses), FRAMES // 2)
        self.assertGreater(max(poses), FRAMES // 2)
        received = [(n, p, q) for n, (p, q) in poses.items()]
        error = trajectory.largest_error(received, disk, min(poses))
        print(f"over the network and from disk: at most {error:.4f} m apart")
        self.assertLess(error, SPREAD)


if __name__ == "__main__":
    sys.exit(machine.main(Network, enter))
