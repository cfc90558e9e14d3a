"""`sovo topic`, on-demand topics and `sovo vo --left --right`, over DDS."""

import json
import pathlib
import signal

import harness
from bus_test import FRAMES, TRUTH, BusTest
from harness import DATASET, FAILED, OK, USAGE, largest_error, read_tum, sovo


class Topics(BusTest):
    def topic(self, *words, code=OK):
        return self.expect(sovo("topic", *words, *self.bus), code).stdout

    def test_list_hz_bw_and_echo_of_a_running_camera(self):
        ns = self.bus[3]
        self.start("camera", "dataset", "--path", DATASET, "--rate", "0.1")
        self.topic("echo", "left/camera_info", "--count", "1")  # the camera is up
        topics = {t["name"]: t for t in map(json.loads, self.topic("list", "--json").splitlines())}
        self.assertEqual(topics[f"/{ns}/stereo"]["type"], "sovo_msgs/msg/StereoFrame")
        self.assertEqual(topics[f"/{ns}/left/image_raw"]["readers"], 0)
        self.assertIn("/tf_static", topics)
        self.assertIn(f"/{ns}/right/preview/compressed", self.topic("list"))

        hz = json.loads(self.topic("hz", "stereo", "--count", "1", "--json"))
        self.assertGreaterEqual(hz["messages"], 2)
        self.assertGreater(hz["hz"], 0.0)
        self.assertIn("MB/s", self.topic("bw", "left/image_raw", "--count", "1"))

        image = json.loads(self.topic("echo", "left/image_raw", "--count", "1", "--json"))
        self.assertEqual((image["width"], image["height"]), (320, 240))
        self.assertEqual(len(image["data"]), 320 * 240)
        stamp = image["header"]["stamp"]
        file = f"{stamp['sec']}{stamp['nanosec']:09d}.png"
        self.assertTrue((pathlib.Path(DATASET) / "mav0/cam0/data" / file).is_file(), file)
        text = self.topic("echo", "/tf_static", "--count", "1")
        self.assertIn("child_frame_id", text)

    def test_what_nobody_writes_and_wrong_words(self):
        result = self.expect(sovo("topic", "echo", "nothing", *self.bus), FAILED)
        self.assertIn("nobody writes", result.stderr)
        self.expect(sovo("topic", "echo", *self.bus), USAGE)


class RosImages(BusTest):
    def test_images_of_any_driver_are_tracked_like_our_own_frames(self):
        out = self.folder / "out.txt"
        vo = self.start("vo", "--left", "left/image_raw", "--right", "right/image_raw",
                        "--idle-exit", 3, "--set", "wait_for_mapping=true", "--out", out)
        self.start("camera", "dataset", "--path", DATASET, "--rate", "0.25")
        _, log = self.finish(vo)
        self.assertIn("lost in transport 0", log)
        poses = read_tum(out)
        # Frames from before the processes had found each other are not heard.
        self.assertGreater(len(poses), FRAMES // 2)
        self.assertLess(largest_error(poses, read_tum(TRUTH), poses[0][0]), 0.03)

    def test_what_is_missing_is_said(self):
        self.expect(sovo("vo", "--left", "left/image_raw", *self.bus), USAGE)
        vo = self.start("vo", "--left", "/cam/left/image_raw", "--right", "/cam/right/image_raw")
        self.wait_for_line(vo.stderr, "/cam/left/camera_info")
        vo.send_signal(signal.SIGINT)
        self.finish(vo, FAILED)


if __name__ == "__main__":
    harness.main()
