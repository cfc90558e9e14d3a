"""Two hosts, each a network namespace, and the cable between them."""

import json
import signal
import subprocess
import threading
import time

import harness
from bus_test import FRAMES, BusTest
from harness import DATASET, SOVO


class CutCable(BusTest):
    def setUp(self):
        super().setUp()
        self.hosts = [self.make_host(), self.make_host()]
        link = subprocess.run(
            ["ip", "link", "add", "near", "netns", str(self.hosts[0]), "type", "veth",
             "peer", "name", "far", "netns", str(self.hosts[1])],
            capture_output=True, text=True, check=False)
        if link.returncode != 0:
            self.skipTest("no virtual cable can be laid here: " + link.stderr.strip())
        for host, (name, address) in enumerate([("near", "10.1.1.1/24"), ("far", "10.1.1.2/24")]):
            self.on(host, "ip", "address", "add", address, "dev", name)
            self.on(host, "ip", "link", "set", "lo", "up")
            self.on(host, "ip", "link", "set", name, "up")

    def make_host(self):
        """Process id of a process in a network of its own."""
        process = subprocess.Popen(["unshare", "-n", "sh", "-c", "echo up; exec sleep 600"],
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end, process)
        if not process.stdout.readline():
            self.skipTest("no network namespaces here: " + process.stderr.read().strip())
        return process.pid

    def on(self, host, *command):
        subprocess.run(["nsenter", "-t", str(self.hosts[host]), "-n", *command], check=True,
                       capture_output=True, timeout=60)

    def start_on(self, host, *arguments):
        words = ["nsenter", "-t", str(self.hosts[host]), "-n", SOVO, *map(str, arguments),
                 *map(str, self.bus), "--network", "near" if host == 0 else "far"]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end, process)
        return process

    def test_the_odometry_goes_on_and_subscribers_catch_up(self):
        vo = self.start_on(0, "vo", "--frames", FRAMES)
        listener = self.start_on(1, "topic", "echo", "status", "--json")
        heard = []

        def listen():
            for line in listener.stdout:
                heard.append(json.loads(line)["sequence"])

        thread = threading.Thread(target=listen)
        thread.start()
        camera = self.start_on(0, "camera", "dataset", "--path", DATASET, "--rate", "0.1")
        self.assertTrue(self.eventually(lambda: len(heard) >= 3), camera.stderr)
        self.on(1, "ip", "link", "set", "far", "down")
        before = len(heard)
        time.sleep(4)
        self.assertLess(len(heard) - before, 4, "the cable was not cut")
        self.on(1, "ip", "link", "set", "far", "up")
        self.assertTrue(self.eventually(lambda: len(heard) > before + 3))
        _, log = self.finish(vo)
        self.assertIn(f"received {FRAMES} frames; lost in transport 0, dropped 0", log)
        listener.send_signal(signal.SIGINT)
        thread.join(60)
        self.assertEqual(heard, sorted(set(heard)))

    @staticmethod
    def eventually(condition):
        end = time.monotonic() + 60
        while not condition():
            if time.monotonic() > end:
                return False
            time.sleep(0.05)
        return True


if __name__ == "__main__":
    harness.main()
