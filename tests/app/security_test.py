"""DDS Security: who has no key neither reads nor writes."""

import os
import pathlib
import re
import signal
import subprocess
import time

import harness
from bus_test import FRAMES, BusTest
from camera_test import CALIBRATION
from harness import DATASET, FAILED, OK, ROOT, sovo


class Security(BusTest):
    def setUp(self):
        super().setUp()
        self.keys = self.make_keys("vehicle")

    def make_keys(self, name):
        """Options of a participant whose keys a CA of that name has signed."""
        folder = self.folder / name
        subprocess.run([ROOT / "config/security/make-keys", folder], check=True, timeout=60,
                       capture_output=True)
        return ["--set", f"dds.security={folder / 'sovo'}"]

    def test_a_stranger_can_neither_read_nor_inject(self):
        vo = self.start("vo", "--idle-exit", 5, *self.keys)
        injector = self.start("camera", "dataset", "--path", DATASET, "--rate", "max")
        self.finish(injector)
        command = sovo("command", "reset", *self.bus)
        self.assertIn("no sovo vo on", self.expect(command, FAILED).stderr)

        friend = self.start("topic", "echo", "status", "--json", *self.keys)
        strangers = [self.start("topic", "echo", topic, "--json", *keys)
                     for topic in ("status", "stereo")
                     for keys in ([], self.make_keys("elsewhere"))]
        self.expect(self.camera("--rate", "max", *self.keys), OK)
        _, log = self.finish(vo)
        self.assertIn("nothing is exchanged with those who have none", log)
        self.assertIn("malformed 0, foreign 0", log)
        received = int(re.search(r"received (\d+) frames", log)[1])
        self.assertTrue(0 < received <= FRAMES, log)
        friend.send_signal(signal.SIGINT)
        self.assertIn('"sequence"', friend.communicate(timeout=60)[0])
        for stranger in strangers:
            stranger.send_signal(signal.SIGINT)
            self.assertEqual(stranger.communicate(timeout=60)[0], "")

    def test_what_is_missing_is_said(self):
        folder = self.folder / "vehicle" / "sovo"
        (folder / "governance.p7s").unlink()
        refused = self.expect(sovo("vo", *self.keys, *self.bus), FAILED)
        self.assertIn("governance.p7s is missing", refused.stderr)
        both = sovo("vo", *self.keys, *self.bus, "--set", "dds.transport=shm")
        self.assertIn("exclude each other", self.expect(both, FAILED).stderr)


class SharedMemory(BusTest):
    SHM = ["--set", "dds.transport=shm"]

    def test_without_its_daemon_it_says_so_at_once(self):
        hidden = ["unshare", "-m", "sh", "-c", "mount -t tmpfs none /tmp && exec \"$@\"", "sh"]
        words = [*hidden, harness.SOVO, "vo", *self.SHM, *map(str, self.bus)]
        refused = subprocess.run(words, capture_output=True, text=True, timeout=30, check=False)
        if "unshare" in refused.stderr:
            self.skipTest("no mount namespaces here: " + refused.stderr.strip())
        self.assertEqual(refused.returncode, FAILED)
        self.assertIn("RouDi does not run", refused.stderr)
        # Those that pass bytes on never use it, and need no daemon.
        words = [*hidden, harness.SOVO, "status", "--once", *self.SHM, *map(str, self.bus)]
        silent = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
        self.assertNotIn("RouDi", silent.stderr)

    def start_daemon(self):
        if os.environ.get("SOVO_SANITIZED") == "1":
            self.skipTest("iceoryx's own memory is not for sanitizers")
        try:
            daemon = subprocess.Popen(["iox-roudi"], stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, text=True)
        except FileNotFoundError:
            self.skipTest("iox-roudi is not installed (Debian's package iceoryx)")
        self.addCleanup(daemon.communicate)
        self.addCleanup(daemon.terminate)
        for line in daemon.stdout:
            if "ready for clients" in line:
                break
        else:
            self.skipTest("RouDi does not start here; another one may run")

    def test_images_go_through_it_and_are_recorded_without(self):
        self.start_daemon()
        dive = self.folder / "dive.mcap"
        recorder = self.start("record", "-o", dive, "--min-free", "1MB", *self.SHM)
        self.wait_for_line(recorder.stderr, "recording to")
        vo = self.start("vo", "--frames", FRAMES, *self.SHM)
        self.wait_for_line(vo.stderr, "through shared memory")

        def uses_it(process):
            maps = pathlib.Path(f"/proc/{process.pid}/maps").read_text()
            return "/dev/shm/iceoryx_mgmt" in maps

        self.assertTrue(uses_it(vo))
        self.assertFalse(uses_it(recorder))
        camera = self.camera("--rate", "max", *self.SHM)
        self.assertIn("through shared memory", self.expect(camera, OK).stderr)
        _, log = self.finish(vo)
        self.assertIn(f"received {FRAMES} frames; lost in transport 0, dropped 0", log)
        time.sleep(0.5)
        recorder.send_signal(signal.SIGINT)
        self.assertIn(" 0 dropped", self.finish(recorder)[1])
        self.expect(sovo("run", "--mcap", dive), OK)

    def test_who_comes_later_is_told_the_calibration_again(self):
        self.start_daemon()
        rig = self.folder / "rig.yaml"
        rig.write_text(CALIBRATION)
        hears = self.start("topic", "echo", "calibration", "--json")
        camera = self.start("camera", "v4l2", "--device", "not-there", "--calib", rig, *self.SHM)
        self.wait_for_line(camera.stderr, "waiting for it")
        self.wait_for_line(hears.stdout, '"right_from_left"')
        vo = self.start("vo", *self.SHM)
        self.wait_for_line(vo.stderr, "through shared memory")
        for _ in range(3):
            self.wait_for_line(hears.stdout, '"right_from_left"')


if __name__ == "__main__":
    harness.main()
