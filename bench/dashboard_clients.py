#!/usr/bin/env python3
"""What watching costs: the odometry's latency without clients of the dashboard, and with ten.

Usage: bench/dashboard_clients.py [--clients N] [--rounds N] [--frames N] [--sovo FILE]

Simulated cameras are rendered once, then played in real time to `sovo vo`, with `sovo dashboard`
beside it: in turn without clients, and with N (default 10) that subscribe to every channel and
throw away what comes, one of which stops reading. Prints medians and 95 % quantiles of
VoStatus.latency_s over all rounds and their ratios. Clients run on the same machine, at the lowest
priority; the kernel's work of handing them what they take is in the numbers nevertheless.

Exit codes: 0 measured, 1 something failed, 2 wrong arguments.
"""

import argparse
import base64
import json
import os
import pathlib
import re
import selectors
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time

SUBPROTOCOL = "foxglove.sdk.v1"


class Clients(threading.Thread):
    """Clients of Foxglove's protocol on one thread; the first one stops reading."""

    def __init__(self, port, count):
        super().__init__(daemon=True)
        self.selector = selectors.DefaultSelector()
        self.ending = False
        self.received = 0
        self.stalled = None
        self.sockets = []
        for number in range(count):
            client = self.connect(port)
            self.sockets.append(client)
            if number == 0:
                self.stalled = client
            else:
                client.setblocking(False)
                self.selector.register(client, selectors.EVENT_READ)

    def connect(self, port):
        client = socket.create_connection(("127.0.0.1", port))
        key = base64.b64encode(os.urandom(16)).decode()
        client.sendall((f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\n"
                        f"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                        f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Protocol: {SUBPROTOCOL}\r\n"
                        "\r\n").encode())
        stream = client.makefile("rb")
        while stream.readline().strip():
            pass
        channels = []
        while not channels:
            message = json.loads(self.read_message(stream))
            if message["op"] == "advertise":
                channels = [channel["id"] for channel in message["channels"]]
        wanted = [{"id": channel, "channelId": channel} for channel in channels]
        self.send(client, json.dumps({"op": "subscribe", "subscriptions": wanted}).encode())
        return client

    @staticmethod
    def read_message(stream):
        """The next message, put together from its frames."""
        message, is_last = b"", False
        while not is_last:
            head = stream.read(2)
            if len(head) < 2:
                raise RuntimeError("the dashboard closed the connection")
            is_last, length = bool(head[0] & 0x80), head[1]
            if length == 126:
                length = int.from_bytes(stream.read(2), "big")
            elif length == 127:
                length = int.from_bytes(stream.read(8), "big")
            message += stream.read(length)
        return message

    @staticmethod
    def send(client, text):
        size = len(text)
        head = bytes([0x81]) + (bytes([0x80 | size]) if size < 126 else
                                bytes([0xFE]) + size.to_bytes(2, "big"))
        client.sendall(head + bytes(4) + text)  # a mask of zeros

    def run(self):
        # Clients elsewhere take none of this machine's time: here they get what is left.
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), 19)
        while not self.ending:
            for key, _ in self.selector.select(timeout=0.2):
                data = key.fileobj.recv(1 << 18)
                self.received += len(data)
                if not data:
                    self.selector.unregister(key.fileobj)

    def end(self):
        self.ending = True
        self.join()
        for client in self.sockets:
            client.close()


class Bench:
    def __init__(self, options, folder):
        self.sovo, self.options, self.folder = options.sovo, options, folder
        self.bus = ["--network", "lo", "--domain", str(120 + os.getpid() % 80)]
        self.vehicle = [*self.bus, "--ns", "bench"]
        self.pairs = folder / "pairs"

    def run(self, *arguments):
        subprocess.run([self.sovo, *map(str, arguments)], check=True, capture_output=True)

    def start(self, *arguments, **streams):
        return subprocess.Popen([self.sovo, *map(str, arguments)], text=True, **streams)

    def render(self):
        self.run("camera", "sim", "--world", "lawn", "--frames", self.options.frames, "--export",
                 self.pairs)

    def latencies(self, clients):
        """Latency of every frame [s] of one play, and the bytes that clients received."""
        dashboard = self.start("dashboard", *self.bus, "--listen", "127.0.0.1:0",
                               stderr=subprocess.PIPE)
        log = ""
        while "Foxglove connects to" not in log:
            line = dashboard.stderr.readline()
            if not line:
                raise RuntimeError("the dashboard did not start: " + log)
            log += line
        port = int(re.search(r"ws://127\.0\.0\.1:(\d+)/", log).group(1))
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        vo = self.start("vo", *self.vehicle, **quiet)
        status = self.start("status", "--json", *self.vehicle, stdout=subprocess.PIPE,
                            stderr=subprocess.DEVNULL)
        time.sleep(2.0)  # until they know each other
        camera = self.start("camera", "dataset", "--path", self.pairs, "--rate", "1.0",
                            "--restamp", *self.vehicle, **quiet)
        first = status.stdout.readline()
        watchers = Clients(port, clients) if clients else None
        if watchers:
            watchers.start()
        camera.wait()
        for process in (vo, status):
            process.send_signal(signal.SIGINT)
        lines = [first, *status.stdout.read().splitlines()]
        received = 0
        if watchers:
            watchers.end()
            received = watchers.received
        dashboard.send_signal(signal.SIGINT)
        dashboard.communicate()
        vo.wait()
        # The first frames find everybody starting.
        return [json.loads(line)["latency_s"] for line in lines[20:] if line.strip()], received


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--clients", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--frames", type=int, default=300, help="of 20 a second")
    parser.add_argument("--sovo", default="build/release/bin/sovo")
    options = parser.parse_args()
    samples = {0: [], options.clients: []}
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(options, pathlib.Path(folder))
        bench.render()
        for number in range(options.rounds):
            for clients in samples:
                latencies, received = bench.latencies(clients)
                samples[clients] += latencies
                print(f"round {number + 1}, {clients:2} clients: median "
                      f"{1e3 * statistics.median(latencies):.1f} ms of {len(latencies)} frames, "
                      f"{received / 1e6:.1f} MB taken by clients", flush=True)
    results = {}
    for clients, values in samples.items():
        results[clients] = statistics.median(values), statistics.quantiles(values, n=20)[-1]
        print(f"{clients:2} clients: median {1e3 * results[clients][0]:.2f} ms, "
              f"95 % {1e3 * results[clients][1]:.2f} ms, {len(values)} frames")
    ratios = [b / a for a, b in zip(results[0], results[options.clients])]
    print(f"ratio: median {ratios[0]:.3f}, 95 % {ratios[1]:.3f}; "
          f"load of this machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    try:
        main()
    except (OSError, RuntimeError, subprocess.CalledProcessError, statistics.StatisticsError) as error:
        sys.exit(f"dashboard_clients: {error}")
