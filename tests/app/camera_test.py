"""`sovo camera v4l2` and `aravis`, `sovo camera list` and `sovo doctor` where no camera is attached;
real drivers are in tests/vm, simulated GigE Vision cameras in tests/driver/aravis."""

import signal

import harness
from harness import BAD_INPUT, FAILED, OK, USAGE, CommandTest, own_domain, sovo, start

CALIBRATION = """sovo_calibration: 1
left: {width: 672, height: 376, fx: 350, fy: 350, cx: 336, cy: 188, distortion: none}
right: {width: 672, height: 376, fx: 350, fy: 350, cx: 336, cy: 188, distortion: none}
T_right_left: [1, 0, 0, -0.12, 0, 1, 0, 0, 0, 0, 1, 0]
"""


class RealCameras(CommandTest):
    def test_wrong_options_say_what_is_wrong(self):
        for options, part in ((["--left", "a"], "--left and --right go together"),
                              (["--left", "a", "--right", "a"], "the same device"),
                              (["--device", "a", "--left", "b", "--right", "c"], "either --device"),
                              (["--control", "gain"], "NAME=WHOLE NUMBER"),
                              (["--size", "640"], "WIDTHxHEIGHT"),
                              (["--format", "RGB3"], "YUYV"),
                              (["--set", "camera.v4l2.buffers=2"], "4 to 32")):
            result = self.expect(sovo("camera", "v4l2", *options), USAGE)
            self.assertIn(part, result.stderr, options)

    def test_wrong_options_of_network_cameras_say_what_is_wrong(self):
        both = ["--left", "1", "--right", "2"]
        for options, part in ((["--left", "1"], "give both cameras"),
                              (["--left", "1", "--right", "1"], "the same camera"),
                              ([*both, "--feature", "Gain"], "Name=value"),
                              ([*both, "--sync", "magic"], "auto"),
                              ([*both, "--set", "camera.aravis.buffers=2"], "4 to 64"),
                              ([*both, "--set", "camera.aravis.packet_size=9"], "576 to 65535")):
            result = self.expect(sovo("camera", "aravis", *options), USAGE)
            self.assertIn(part, result.stderr, options)
        result = self.expect(sovo("camera", "aravis", *both), BAD_INPUT)
        self.assertIn("--calib FILE", result.stderr)

    def test_without_a_calibration_it_says_where_one_is(self):
        result = self.expect(sovo("camera", "v4l2", "--device", "not-there"), BAD_INPUT)
        self.assertIn("--calib FILE", result.stderr)

    def test_a_camera_that_is_not_there_is_waited_for(self):
        calibration = self.folder / "rig.yaml"
        calibration.write_text(CALIBRATION)
        camera = start("camera", "v4l2", "--device", "not-there", "--control", "gain=1",
                       "--control", "exposure=2", "--calib", calibration,
                       "--domain", own_domain())
        self.addCleanup(camera.kill)
        self.wait_for_line(camera.stderr, "waiting for it")
        self.wait_for_line(camera.stderr, "camera: opening: no camera is 'not-there'")
        camera.send_signal(signal.SIGINT)
        _, log = camera.communicate(timeout=60)
        self.assertEqual(camera.returncode, FAILED, log)
        self.assertIn("no frame could be published", log)

    def test_list_and_doctor_answer(self):
        self.assertNotEqual(self.expect(sovo("camera", "list"), OK).stdout, "")
        doctor = sovo("doctor")
        self.assertIn(doctor.returncode, (OK, FAILED), doctor.stderr)
        self.assertEqual("MEND: " in doctor.stdout, doctor.returncode == FAILED, doctor.stdout)


if __name__ == "__main__":
    harness.main()
