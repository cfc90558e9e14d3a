"""`sovo camera` and `sovo vo`: source and odometry in two processes, over DDS."""

import json
import os
import pathlib
import signal
import subprocess

import harness
from harness import (DATASET, FAILED, OK, CommandTest, largest_error, own_domain, read_tum, sovo,
                     start)

FRAMES = 40
TRUTH = pathlib.Path(DATASET) / "groundtruth_cam0_tum.txt"


class BusTest(CommandTest):
    """A test in a DDS domain and namespace of its own."""

    def setUp(self):
        super().setUp()
        self.bus = ["--domain", own_domain(), "--ns", f"test{os.getpid()}"]

    def start(self, *arguments):
        process = start(*arguments, *self.bus)
        self.addCleanup(self.end, process)
        return process

    @staticmethod
    def end(process):
        if process.poll() is None:
            process.kill()
        process.communicate()

    def camera(self, *options):
        return sovo("camera", "dataset", "--path", DATASET, *self.bus, *options)

    def finish(self, process, code=OK):
        stdout, stderr = process.communicate(timeout=120)
        self.assertEqual(process.returncode, code, stdout + stderr)
        return stdout, stderr


class TwoProcesses(BusTest):
    def test_every_frame_arrives_and_the_answer_is_that_of_one_process(self):
        out, live = self.folder / "out.txt", self.folder / "live.txt"
        vo = self.start("vo", "--deterministic", "--frames", FRAMES, "--out", out,
                        "--out-live", live)
        camera = self.expect(self.camera("--rate", "max"), OK)
        self.assertIn(f"published {FRAMES} frames", camera.stderr)
        _, log = self.finish(vo)
        self.assertIn(f"received {FRAMES} frames; lost in transport 0, dropped 0", log)
        alone, alone_live = self.folder / "alone.txt", self.folder / "alone_live.txt"
        self.expect(sovo("run", "--dataset", DATASET, "--deterministic", "--out", alone,
                         "--out-live", alone_live), OK)
        self.assertEqual(out.read_bytes(), alone.read_bytes())
        self.assertEqual(live.read_bytes(), alone_live.read_bytes())

    def test_live_odometry_tells_its_state_every_frame(self):
        out = self.folder / "out.txt"
        status = self.start("status", "--json")
        vo = self.start("vo", "--set", "wait_for_mapping=true", "--idle-exit", 2, "--out", out)
        self.expect(self.camera("--rate", "max"), OK)
        self.finish(vo)
        status.send_signal(signal.SIGINT)
        stdout, _ = self.finish(status)
        states = [json.loads(line) for line in stdout.splitlines()]
        self.assertEqual([s["sequence"] for s in states], list(range(FRAMES)))
        last = states[-1]
        self.assertEqual(last["state"], 1, last["reason"])
        for counter in ("lost_transport", "dropped_queue", "rejected", "reset_counter"):
            self.assertEqual(last[counter], 0)
        self.assertIn("bundle_adjustment", [stage["name"] for stage in last["stages"]])
        poses = read_tum(out)
        self.assertEqual(len(poses), FRAMES)
        self.assertLess(largest_error(poses, read_tum(TRUTH), poses[0][0]), 0.03)

    def test_sigint_ends_cleanly_with_the_trajectory_written(self):
        out = self.folder / "out.txt"
        vo = self.start("vo", "--out", out)
        self.expect(self.camera("--frames", 10, "--rate", "max"), OK)
        vo.send_signal(signal.SIGINT)
        self.finish(vo)
        self.assertGreater(len(read_tum(out)), 0)

    def test_without_a_source_it_says_what_is_missing(self):
        vo = self.start("vo")
        self.wait_for_line(vo.stderr, "no calibration")
        vo.send_signal(signal.SIGINT)
        self.finish(vo, FAILED)


class Commands(BusTest):
    def command(self, name):
        return self.expect(sovo("command", name, *self.bus), OK).stdout

    def state(self):
        return json.loads(self.expect(sovo("status", "--once", "--json", *self.bus), OK).stdout)

    def test_pause_resume_reset_and_a_second_source(self):
        vo = self.start("vo")
        camera = self.start("camera", "dataset", "--path", DATASET, "--rate", "0.1")
        self.wait_for_line(vo.stderr, "tracking frames")
        self.assertIn("paused", self.command("pause"))
        self.assertEqual(self.state()["state"], 6)
        self.assertIn("resumed", self.command("resume"))
        self.assertNotEqual(self.state()["state"], 6)
        before = self.state()
        self.assertIn("new segment", self.command("reset"))
        after = self.state()
        self.assertEqual(after["reset_counter"], before["reset_counter"] + 1)
        self.assertGreater(after["segment"], before["segment"])
        self.assertEqual(after["last_command_result"], "done: a new segment begins")
        screen = self.expect(sovo("status", "--once", *self.bus), OK).stdout
        self.assertIn("segment", screen)
        camera.send_signal(signal.SIGINT)
        self.finish(camera)

        self.expect(self.camera("--frames", 5, "--rate", "max"), OK)
        self.wait_for_line(vo.stderr, "the odometry begins anew")
        vo.send_signal(signal.SIGINT)
        self.finish(vo)

    def test_nobody_answers(self):
        both = [subprocess.Popen([harness.SOVO, *words, *map(str, self.bus)],
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
                for words in (["status", "--once"], ["command", "pause"])]
        for process in both:
            _, log = self.finish(process, FAILED)
            self.assertIn("is sovo vo running" if process is both[0] else "no sovo vo", log)


if __name__ == "__main__":
    harness.main()
