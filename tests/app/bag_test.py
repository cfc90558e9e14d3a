"""Recordings in other forms: bags of other systems, `sovo convert`, files that stand alone."""

import json
import shutil
import subprocess

import harness
import mcap_bag
from bus_test import FRAMES, TRUTH, BusTest
from harness import (BAD_INPUT, DATASET, OK, ROOT, SMALL_RIG, USAGE, CommandTest, largest_error,
                     read_tum, sovo)

LEFT, RIGHT = "/sovo/left/", "/sovo/right/"


class BagTest(CommandTest):
    def convert(self, source, name, *options):
        out = self.folder / name
        self.expect(sovo("convert", source, "-o", out, *options), OK)
        return out

    def run_on(self, *source):
        """Bytes of the refined and the live trajectory."""
        out, live = self.folder / "out.txt", self.folder / "live.txt"
        self.expect(sovo("run", *source, "--deterministic", "--out", out, "--out-live", live), OK)
        return out.read_bytes() + live.read_bytes()

    def images(self):
        """Messages of the dataset as Image and CameraInfo."""
        if not hasattr(self, "image_messages"):
            bag = self.convert(DATASET, "images.mcap", "--ros-images", "--compression", "none")
            self.image_messages = mcap_bag.read_messages(bag)
        return self.image_messages

    def foreign(self, name, rename, change=lambda image, is_left: image, order="<"):
        """A bag as another system would have written it: its names, encodings and stamps, and
        nothing of ours."""
        messages = []
        for m in self.images():
            topic = rename(m.topic)
            if topic is None:
                continue
            data = m.data
            if m.type == "sensor_msgs/msg/Image":
                image = change(mcap_bag.read_image(data), m.topic.startswith(LEFT))
                if image is None:
                    continue
                data = mcap_bag.write_image(image, order)
            messages.append(m._replace(topic=topic, data=data))
        path = self.folder / name
        mcap_bag.write_messages(path, messages)
        return path


def cam0_cam1(topic):
    """Names as those of EuRoC's bags; the calibration of sovo is no topic of theirs."""
    if topic.startswith(LEFT):
        return topic.replace(LEFT, "/cam0/")
    return topic.replace(RIGHT, "/cam1/") if topic.startswith(RIGHT) else None


def to_rgb(image, is_left):
    """Colour, with padded rows; the right camera's stamps are 2 ms later."""
    rows = []
    for y in range(image.height):
        row = bytearray(b"\x55" * (3 * image.width + 8))
        for channel in range(3):
            row[channel:3 * image.width:3] = image.data[y * image.step:y * image.step + image.width]
        rows.append(bytes(row))
    return image._replace(encoding="rgb8", step=3 * image.width + 8, data=b"".join(rows),
                          stamp_ns=image.stamp_ns + (0 if is_left else 2_000_000))


class ForeignBags(BagTest):
    def test_grey_and_colour_bags_give_the_true_trajectory(self):
        grey = self.foreign("grey.mcap", cam0_cam1)
        result = self.run_on("--mcap", grey)
        poses = read_tum(self.folder / "out.txt")
        self.assertEqual(len(poses), FRAMES)
        self.assertLess(largest_error(poses, read_tum(TRUTH), poses[0][0]), 0.03)
        colour = self.foreign("colour.mcap", cam0_cam1, to_rgb, ">")
        as_one = ("--set", "exposure_motion=false")  # whatever the stamps say
        self.assertEqual(self.run_on("--mcap", colour, *as_one), result)
        named = self.run_on("--mcap", colour, *as_one, "--left", "/cam0/image_raw", "--right",
                            "cam1/image_raw")
        self.assertEqual(named, result)
        apart = self.folder / "apart.txt"
        sovo("run", "--deterministic", "--mcap", colour, "--set", "node.pair_tolerance_s=0.001",
             "--out", apart)  # without a right image it tracks what it can
        self.assertNotEqual(apart.read_bytes() if apart.exists() else b"",
                            (self.folder / "out.txt").read_bytes())

    def test_a_lost_image_costs_no_more_than_its_pair(self):
        lost = iter(range(10**6))

        def lose(image, is_left):
            return None if not is_left and next(lost) == 20 else image

        bag = self.foreign("lossy.mcap", cam0_cam1, lose)
        self.run_on("--mcap", bag)
        self.assertEqual(len(read_tum(self.folder / "out.txt")), FRAMES)

    def test_what_cannot_be_paired_is_said(self):
        no_info = self.foreign("no_info.mcap", lambda topic: None if "camera_info" in topic
                               else cam0_cam1(topic))
        odd = self.foreign("odd.mcap", lambda topic: (cam0_cam1(topic) or "").replace(
            "/cam0/", "/near/").replace("/cam1/", "/far/") or None)
        for bag, options, text in [
                (no_info, [], "no camera_info on /cam0/camera_info"),
                (odd, [], "/far/image_raw, /near/image_raw"),
                (odd, ["--left", "/near/image_raw", "--right", "/else"], "/else is no image topic")]:
            with self.subTest(text=text):
                failed = self.expect(sovo("run", "--mcap", bag, *options), BAD_INPUT)
                self.assertIn(text, failed.stderr)
        self.run_on("--mcap", odd, "--left", "/near/image_raw", "--right", "/far/image_raw")

    def test_bags_of_the_mcap_project_s_writer_are_read(self):
        check = ROOT / "build" / "mcap"
        if shutil.which("node") is None or not (check / "installed.json").is_file():
            self.skipTest("node and the packages of tests/mcap are missing: scripts/test fetches them")
        ours = self.convert(DATASET, "ours.mcap", "--ros-images")
        theirs = self.folder / "theirs.mcap"
        # Where the packages are, imports find them.
        shutil.copy(ROOT / "tests" / "mcap" / "rewrite.mjs", check / "rewrite.mjs")
        done = subprocess.run(["node", "rewrite.mjs", ours, theirs], cwd=check, timeout=120,
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.run_on("--mcap", theirs),
                         self.run_on("--mcap", self.foreign("grey.mcap", cam0_cam1)))


class ForeignReplay(BusTest, BagTest):
    def test_the_odometry_hears_what_a_run_on_the_bag_sees(self):
        bag = self.foreign("grey.mcap", cam0_cam1)
        expected = self.run_on("--mcap", bag)
        out, live = self.folder / "bus.txt", self.folder / "bus_live.txt"
        vo = self.start("vo", "--left", "/cam0/image_raw", "--right", "/cam1/image_raw",
                        "--deterministic", "--frames", FRAMES, "--out", out, "--out-live", live)
        self.expect(sovo("replay", bag, "--rate", "max", *self.bus), OK)
        _, log = self.finish(vo)
        self.assertIn(f"received {FRAMES} frames; lost in transport 0, dropped 0", log)
        self.assertEqual(out.read_bytes() + live.read_bytes(), expected)


class Conversion(BagTest):
    def pixels(self, bag):
        return [mcap_bag.read_image(m.data).data for m in mcap_bag.read_messages(bag)
                if m.type == "sensor_msgs/msg/Image"]

    def test_every_form_gives_the_same_pixels_and_trajectory(self):
        expected = self.run_on("--dataset", DATASET)
        frames = self.convert(DATASET, "frames", "--compression", "zstd")
        self.assertTrue((frames / "metadata.yaml").is_file())
        images = self.convert(frames, "images.mcap", "--ros-images", "--compression", "none")
        again = self.convert(images, "again.mcap", "--stereo-frames", "--compression", "none")
        back = self.convert(again, "back.mcap", "--ros-images", "--compression", "none")
        for recording in (frames, images, again):
            with self.subTest(recording=recording.name):
                self.assertEqual(self.run_on("--mcap", recording), expected)
        pixels = self.pixels(images)
        self.assertEqual(len(pixels), 2 * FRAMES)
        self.assertEqual(self.pixels(back), pixels)
        types = {m.type for m in mcap_bag.read_messages(images)}
        self.assertEqual(types, {"sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo",
                                 "sovo_msgs/msg/StereoCalibration"})
        once = self.convert(images, "once.mcap", "--stereo-frames", "--compression", "none")
        self.assertEqual(once.read_bytes(), again.read_bytes())

    def test_every_file_of_a_split_recording_stands_alone(self):
        dive = self.convert(DATASET, "dive", "--split", "2MB")
        files = sorted(dive.glob("dive_*.mcap"))
        self.assertGreater(len(files), 2)
        for file in files:
            with self.subTest(file=file.name):
                self.run_on("--mcap", file)
        expected = self.run_on("--dataset", DATASET)
        self.assertEqual(self.run_on("--mcap", dive), expected)
        whole = self.convert(dive, "whole.mcap", "--compression", "none")
        types = [m.type for m in mcap_bag.read_messages(whole)]
        self.assertEqual(types.count("sovo_msgs/msg/StereoCalibration"), 1)
        self.assertEqual(types.count("sovo_msgs/msg/StereoFrame"), FRAMES)
        files[0].unlink()
        self.run_on("--mcap", dive)

    def test_refusals_leave_nothing_behind(self):
        out = self.folder / "out.mcap"
        images = self.convert(DATASET, "images.mcap", "--ros-images")
        for source, options, code, text in [
                (self.folder / "nothing", [], BAD_INPUT, "does not exist"),
                (images, ["--ros-images"], BAD_INPUT, "no stereo frames"),
                (images, ["--ros-images", "--stereo-frames"], USAGE, "exclude each other"),
                (images, ["--split", "much"], USAGE, "record.split"),
                (images, ["-o", images], USAGE, "never overwritten")]:
            with self.subTest(text=text):
                failed = sovo("convert", source, *([] if "-o" in options else ["-o", out]),
                              *options)
                self.assertIn(text, self.expect(failed, code).stderr)
                self.assertFalse(out.exists())


class GoldenDives(BagTest):
    """Dives that are made anew from the simulator, and what the odometry made of them."""

    DIVES = {"lawn": ("lawn", 24), "pool": ("pool", 24)}

    def dive(self, name):
        world, frames = self.DIVES[name]
        dataset = self.folder / (name + "_dataset")
        self.expect(sovo("camera", "sim", "--world", world, "--calib", SMALL_RIG, "--frames",
                         frames, "--export", dataset), OK)
        return self.convert(dataset, name + ".mcap")

    def test_the_runs_are_those_of_the_golden_files(self):
        for name in self.DIVES:
            with self.subTest(dive=name):
                dive = self.dive(name)
                self.assertEqual(self.run_on("--mcap", dive), self.run_on("--mcap", dive))
                golden = ROOT / "tests/app/golden" / (name + ".golden.json")
                agreed = self.expect(sovo("replay-test", dive, "--golden", golden), OK)
                self.assertIn("frames agree", agreed.stdout)
                other = json.loads(golden.read_text())
                other["frames"][-1]["position"][2] += 0.5
                changed = self.folder / "changed.json"
                changed.write_text(json.dumps(other))
                failed = sovo("replay-test", dive, "--golden", changed)
                self.assertIn("is the first that differs", self.expect(failed, harness.FAILED).stderr)


if __name__ == "__main__":
    harness.main()
