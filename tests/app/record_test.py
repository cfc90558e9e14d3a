"""`sovo record`, `replay`, `recover` and `replay-test`: what was recorded is what was sent."""

import json
import shutil
import signal
import subprocess
import time

import harness
import mcap_bag
from bus_test import FRAMES, BusTest
from harness import BAD_INPUT, DATASET, FAILED, OK, ROOT, SOVO, USAGE, sovo


class RecordTest(BusTest):
    """A test that records the synthetic dataset from the bus."""

    def setUp(self):
        super().setUp()
        self.dive = self.folder / "dive"

    def record(self, *options):
        """A recorder that is ready for the first frame."""
        recorder = self.start("record", "-o", self.dive, "--min-free", "1MB", *options)
        self.wait_for_line(recorder.stderr, "recording to")
        return recorder

    def record_dataset(self, *options):
        """The dataset as recorded from the bus; what the recorder said at its end."""
        recorder = self.record(*options)
        self.expect(self.camera("--rate", "8"), OK)
        time.sleep(0.5)
        recorder.send_signal(signal.SIGINT)
        return self.finish(recorder)[1]

    def run_on(self, *source):
        """Bytes of the refined and the live trajectory."""
        out, live = self.folder / "out.txt", self.folder / "live.txt"
        self.expect(sovo("run", *source, "--deterministic", "--out", out, "--out-live", live), OK)
        return out.read_bytes() + live.read_bytes()


class Recordings(RecordTest):
    def test_a_run_on_the_recording_is_that_on_the_dataset_to_the_bit(self):
        log = self.record_dataset("--split", "3MB")
        self.assertIn(" 0 dropped", log)
        self.assertGreater(len(list(self.dive.glob("dive_*.mcap"))), 1)
        metadata = (self.dive / "metadata.yaml").read_text()
        self.assertIn("storage_identifier: mcap", metadata)
        self.assertIn("name: /" + self.bus[-1] + "/stereo", metadata)
        expected = self.run_on("--dataset", DATASET)
        self.assertEqual(self.run_on("--mcap", self.dive), expected)
        self.assertEqual(self.run_on("--mcap", self.dive), expected)

    def test_replay_gives_the_odometry_what_the_camera_gave(self):
        self.record_dataset()
        out, live = self.folder / "replayed.txt", self.folder / "replayed_live.txt"
        vo = self.start("vo", "--deterministic", "--frames", FRAMES, "--out", out,
                        "--out-live", live)
        replay = sovo("replay", self.dive, "--rate", "max", *self.bus)
        self.expect(replay, OK)
        self.finish(vo)
        self.assertEqual(out.read_bytes() + live.read_bytes(), self.run_on("--dataset", DATASET))

    def test_a_killed_recording_is_read_and_mended(self):
        recorder = self.record()
        self.expect(self.camera("--rate", "8"), OK)
        time.sleep(2.5)
        recorder.kill()
        recorder.wait()
        expected = self.run_on("--dataset", DATASET)
        self.assertEqual(self.run_on("--mcap", self.dive), expected)
        mended = self.expect(sovo("recover", self.dive), OK)
        self.assertIn("mended", mended.stdout)
        self.assertIn("nothing to mend", self.expect(sovo("recover", self.dive), OK).stdout)
        self.assertTrue((self.dive / "dive_0.mcap.cut").exists())
        self.assertIn("message_count", (self.dive / "metadata.yaml").read_text())
        self.assertEqual(self.run_on("--mcap", self.dive), expected)

    def test_a_full_disk_ends_the_recording_and_is_told(self):
        recorder = self.start("record", "-o", self.dive, "--min-free", "900000TB")
        _, log = self.finish(recorder, FAILED)
        self.assertIn("less than", log)
        self.assertIn("--min-free", log)


class RecordedRosImages(RecordTest):
    def test_images_are_recorded_in_place_of_frames(self):
        self.dive = self.folder / "images.mcap"
        self.record_dataset("--ros-images", "--topics", "left/image_raw", "--compression", "none")
        messages = mcap_bag.read_messages(self.dive)
        name = "/" + self.bus[-1] + "/"
        for side in ("left/", "right/"):
            images = [m for m in messages if m.topic == name + side + "image_raw"]
            infos = [m for m in messages if m.topic == name + side + "camera_info"]
            self.assertEqual(len(images), FRAMES)
            # The calibration may be heard a little later than the first frame.
            stamps = [m.data[4:12] for m in images]
            self.assertGreater(len(infos), FRAMES // 2)
            self.assertEqual([m.data[4:12] for m in infos], stamps[FRAMES - len(infos):])
        self.assertNotIn(name + "stereo", {m.topic for m in messages})
        self.assertEqual(self.run_on("--mcap", self.dive),
                         self.run_on("--dataset", DATASET))


class FullDisk(RecordTest):
    """A disk of 3 MB, which is a tmpfs of a mount namespace."""

    def setUp(self):
        super().setUp()
        disk = self.folder / "disk"
        disk.mkdir()
        process = subprocess.Popen(
            ["unshare", "-m", "sh", "-c", f"mount -t tmpfs -o size=3m none {disk} && echo up && "
             "exec sleep 600"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end, process)
        if not process.stdout.readline():
            self.skipTest("no small disk can be made here: " + process.stderr.read().strip())
        self.on_disk = ["nsenter", "-t", str(process.pid), "-m", SOVO]
        self.dive = disk / "dive"

    def test_everything_before_is_readable_and_the_odometry_goes_on(self):
        words = [*self.on_disk, "record", "-o", self.dive, "--min-free", "0", "--compression",
                 "none", "--set", "record.chunk=500kB", *self.bus]
        recorder = subprocess.Popen(list(map(str, words)), stdout=subprocess.PIPE,
                                    stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.end, recorder)
        self.wait_for_line(recorder.stderr, "recording to")
        states = self.start("topic", "echo", "record_status", "--json")
        vo = self.start("vo", "--frames", FRAMES)
        self.expect(self.camera("--rate", "max"), OK)
        _, log = self.finish(vo)
        self.assertIn(f"received {FRAMES} frames; lost in transport 0, dropped 0", log)
        _, log = self.finish(recorder, FAILED)
        self.assertIn("No space left", log)
        states.send_signal(signal.SIGINT)
        heard = [json.loads(line) for line in self.finish(states)[0].splitlines()]
        self.assertFalse(heard[-1]["recording"])
        self.assertIn("No space left", heard[-1]["reason"])
        out = self.folder / "out.txt"
        read = subprocess.run([*self.on_disk, "run", "--mcap", str(self.dive), "--out", str(out)],
                              capture_output=True, text=True, timeout=300, check=False)
        self.expect(read, OK)
        self.assertGreater(len(harness.read_tum(out)), 3)
        subprocess.run([*self.on_disk, "recover", str(self.dive)], capture_output=True, timeout=60,
                       check=False)  # there is no room for it, and nothing is lost by trying
        again = subprocess.run([*self.on_disk, "run", "--mcap", str(self.dive)],
                               capture_output=True, text=True, timeout=300, check=False)
        self.expect(again, OK)


class ReplayTests(RecordTest):
    def test_golden_files_hold_a_run_to_what_it_was(self):
        self.record_dataset()
        golden = self.folder / "golden.json"
        command = ["replay-test", self.dive, "--golden", golden]
        self.assertIn("--update", self.expect(sovo(*command), BAD_INPUT).stderr)
        self.expect(sovo(*command, "--update"), OK)
        agreed = self.expect(sovo(*command), OK)
        self.assertIn("frames agree: position within 0.00e+00 m", agreed.stdout)

        content = json.loads(golden.read_text())
        self.assertIn("kernels", content)
        content["frames"][7]["position"][0] += 1.0
        golden.write_text(json.dumps(content))
        self.assertIn("frame 7 (stamp", self.expect(sovo(*command), FAILED).stderr)
        golden.write_text("{}")
        self.assertIn("not a golden file", self.expect(sovo(*command), BAD_INPUT).stderr)


class IndependentReaders(RecordTest):
    """Readers that are not ours: @mcap/core and the ROS 2 message parser of npm."""

    CHECK = ROOT / "build" / "mcap"

    def setUp(self):
        super().setUp()
        if shutil.which("node") is None or not (self.CHECK / "installed.json").is_file():
            self.skipTest("node and the packages of tests/mcap are missing: scripts/test fetches them")

    def test_they_read_every_message_and_field(self):
        vo = self.start("vo", "--set", "wait_for_mapping=true")
        for compression in ("lz4", "zstd", "none"):
            with self.subTest(compression=compression):
                self.dive = self.folder / (compression + ".mcap")
                self.record_dataset("--compression", compression)
                check = subprocess.run(["node", "check.mjs", self.dive], cwd=self.CHECK,
                                       capture_output=True, text=True, timeout=120, check=False)
                self.assertEqual(check.returncode, 0, check.stderr)
                seen = json.loads(check.stdout)
                topics = seen["topics"]
                name = "/" + self.bus[-1] + "/"
                self.assertEqual(topics[name + "stereo"]["messages"], FRAMES)
                self.assertGreater(topics[name + "stereo"]["fields"], FRAMES * 100_000)
                for topic in ("calibration", "odom", "scaled_odometry", "status", "keyframe"):
                    self.assertIn(name + topic, topics)
                self.assertIn("/tf_static", topics)
                self.assertEqual(seen["attachments"], ["calibration.yaml"])
                self.assertEqual(seen["streamed"], sum(t["messages"] for t in topics.values()))
        vo.send_signal(signal.SIGINT)
        self.finish(vo)


class RecordingRefusals(harness.CommandTest):
    def test_what_cannot_be_is_said(self):
        nothing = self.folder / "nothing"
        for command, code, text in [
                (["replay", nothing], BAD_INPUT, "does not exist"),
                (["recover", nothing], BAD_INPUT, "does not exist"),
                (["run", "--mcap", nothing], BAD_INPUT, "does not exist"),
                (["run", "--mcap", self.folder], BAD_INPUT, "no .mcap file"),
                (["replay", nothing, "--rate", "fast"], USAGE, "--rate"),
                (["record", "-o", nothing, "--split", "much"], USAGE, "record.split")]:
            with self.subTest(command=command):
                self.assertIn(text, self.expect(sovo(*command), code).stderr)


if __name__ == "__main__":
    harness.main()
