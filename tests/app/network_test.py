"""Two hosts, each a network namespace, and the cable between them."""

import json
import os
import re
import signal
import subprocess
import threading
import time

import harness
from bus_test import FRAMES, BusTest
from harness import DATASET, SOVO


class TwoHosts(BusTest):
    """A test with two network namespaces and a cable between them."""

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

    def start_on(self, host, *arguments, **variables):
        words = ["nsenter", "-t", str(self.hosts[host]), "-n", SOVO, *map(str, arguments),
                 *map(str, self.bus), "--network", "near" if host == 0 else "far"]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   env={**os.environ, **variables})
        self.addCleanup(self.end, process)
        return process

    def listen_to_status(self, host):
        """Numbers of the frames whose status came to a host, and what ends the listening."""
        listener = self.start_on(host, "topic", "echo", "status", "--json")
        heard = []

        def listen():
            for line in listener.stdout:
                heard.append(json.loads(line)["sequence"])

        thread = threading.Thread(target=listen)
        thread.start()

        def end():
            listener.send_signal(signal.SIGINT)
            thread.join(60)

        return heard, end

    @staticmethod
    def eventually(condition):
        end = time.monotonic() + 60
        while not condition():
            if time.monotonic() > end:
                return False
            time.sleep(0.05)
        return True


class CutCable(TwoHosts):
    def test_the_odometry_goes_on_and_subscribers_catch_up(self):
        vo = self.start_on(0, "vo", "--frames", FRAMES)
        heard, end = self.listen_to_status(1)
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
        end()
        self.assertEqual(heard, sorted(set(heard)))


class LossyNetwork(TwoHosts):
    """One packet in twenty is lost on its way, in both directions: Cyclone DDS leaves them out
    itself, so that no kernel module is needed."""

    LOSS = ("<CycloneDDS><Domain Id='any'><General><Interfaces><NetworkInterface name='{}'/>"
            "</Interfaces></General><Internal><Test><XmitLossiness>50</XmitLossiness></Test>"
            "</Internal></Domain></CycloneDDS>")

    def start_on(self, host, *arguments, **variables):
        cable = "near" if host == 0 else "far"
        return super().start_on(host, *arguments, CYCLONEDDS_URI=self.LOSS.format(cable))

    def test_the_odometry_goes_on_and_subscribers_have_everything(self):
        vo = self.start_on(1, "vo", "--idle-exit", 8)
        heard, end = self.listen_to_status(0)
        camera = self.start_on(0, "camera", "dataset", "--path", DATASET, "--rate", "0.2")
        self.finish(camera)
        _, log = self.finish(vo)
        received = int(re.search(r"received (\d+) frames", log)[1])
        self.assertGreater(received, FRAMES // 2, log)
        end()
        self.assertGreater(len(heard), received // 2)
        self.assertEqual(heard, list(range(heard[0], heard[0] + len(heard))), "a gap was not filled")
        self.assertGreaterEqual(heard[-1], FRAMES - 2)


if __name__ == "__main__":
    harness.main()
