#!/usr/bin/env python3
"""Real camera drivers of the kernel in a virtual machine, and what camera_check sees of them.

Usage: vm_test.py --bin DIRECTORY --work DIRECTORY [--prepare]

Needs qemu-system-x86, busybox-static, cpio, kmod, v4l-utils and linux-headers-amd64; the kernel
and the sources of v4l2loopback are fetched with apt once, into the work directory; --prepare
does no more than that, where there is a network. Without any of these it says so and ends with 77.
SOVO_TEST_LONG=1 runs the long forms.
"""

import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
MODULES = ["virtio_pci", "9p", "9pnet_virtio", "overlay", "vhci_hcd", "uvcvideo", "vivid",
           "videodev"]
LONG = bool(os.environ.get("SOVO_TEST_LONG"))
SKIPPED = 77


class Missing(Exception):
    """Something that the test cannot do without, and how to get it."""


def run(*command, cwd=None):
    return subprocess.run(list(map(str, command)), cwd=cwd, capture_output=True, text=True,
                          check=False)


def checked(*command, cwd=None):
    done = run(*command, cwd=cwd)
    if done.returncode != 0:
        raise Missing(f"{' '.join(map(str, command))} failed: {done.stderr.strip()[-500:]}")
    return done.stdout


class Machine:
    """The virtual machine: kernel, initial files, and the host's files read-only."""

    def __init__(self, bin_directory, work):
        self.bin = pathlib.Path(bin_directory).resolve()
        self.work = pathlib.Path(work).resolve() / "machine"
        for program in ("qemu-system-x86_64", "busybox", "cpio", "depmod", "modprobe"):
            path = shutil.which(program, path=os.environ["PATH"] + ":/usr/sbin:/sbin")
            if not path:
                raise Missing(f"no {program}; scripts/install-deps --dev installs it")
        self.version = self.find_version()
        self.kernel = self.work / self.version
        self.fetch()
        self.build_loopback()
        self.make_initrd()

    @staticmethod
    def find_version():
        """The kernel that headers are installed of: modules are built against them."""
        headers = sorted(pathlib.Path("/usr/src").glob("linux-headers-*-amd64"),
                         key=lambda p: [int(n) if n.isdigit() else 0
                                        for n in p.name.replace("-", ".").split(".")])
        if not headers:
            raise Missing("no linux-headers-amd64; scripts/install-deps --dev installs it")
        return headers[-1].name.removeprefix("linux-headers-")

    def fetch(self):
        if (self.kernel / "fetched").exists():
            return
        shutil.rmtree(self.kernel, ignore_errors=True)
        self.kernel.mkdir(parents=True)
        checked("apt-get", "-o", "Acquire::Retries=3", "-o", "APT::Sandbox::User=root", "download",
                f"linux-image-{self.version}", "v4l2loopback-dkms", cwd=self.kernel)
        for package in self.kernel.glob("*.deb"):
            checked("dpkg-deb", "-x", package, self.kernel)
            package.unlink()
        (self.kernel / "fetched").touch()

    @property
    def modules(self):
        return self.kernel / "lib/modules" / self.version

    def build_loopback(self):
        module = self.modules / "extra/v4l2loopback.ko"
        if module.exists():
            return
        source = next((self.kernel / "usr/src").glob("v4l2loopback-*"))
        build = self.kernel / "loopback"
        shutil.rmtree(build, ignore_errors=True)
        shutil.copytree(source, build)
        checked("make", "-C", f"/usr/src/linux-headers-{self.version}", f"M={build}", "modules")
        module.parent.mkdir(exist_ok=True)
        shutil.copy(build / "v4l2loopback.ko", module)

    def make_initrd(self):
        """Busybox, the modules with those that they need, and init."""
        root = self.kernel / "initrd"
        shutil.rmtree(root, ignore_errors=True)
        for folder in ("bin", "proc", "sys", "dev", "tmp"):
            (root / folder).mkdir(parents=True)
        shutil.copy(shutil.which("busybox"), root / "bin/busybox")
        for tool in ("sh", "mount", "modprobe", "ls", "cp", "cat", "echo", "dmesg", "mkdir", "sed",
                     "ip", "chroot", "poweroff"):
            (root / "bin" / tool).symlink_to("busybox")
        checked("depmod", "-b", self.kernel, self.version)
        files = set()
        for module in [*MODULES, "v4l2loopback"]:
            shown = run("modprobe", "-d", self.kernel, "-S", self.version, "--show-depends", module)
            files |= {line.split()[1] for line in shown.stdout.splitlines()
                      if line.startswith("insmod")}
        for file in files:
            target = root / pathlib.Path(file).relative_to(self.kernel)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(file, target)
        for name in ("modules.order", "modules.builtin", "modules.builtin.modinfo"):
            shutil.copy(self.modules / name, root / "lib/modules" / self.version / name)
        checked("depmod", "-b", root, self.version)
        shutil.copy(HERE / "init", root / "init")
        (root / "init").chmod(0o755)
        with open(self.kernel / "initrd.gz", "wb") as out:
            subprocess.run("find . | cpio -o -H newc --quiet | gzip -1", shell=True, cwd=root,
                           stdout=out, check=True)

    def boot(self, script, timeout):
        """Runs a script in the machine; its lines, and whether it came to its end."""
        repeats, seconds = (10, 60) if LONG else (2, 5)
        kernel = next((self.kernel / "boot").glob("vmlinuz-*"))
        command = ["qemu-system-x86_64", "-M", "q35", "-accel", "tcg", "-smp", "1", "-m", "1024", "-nodefaults", "-no-user-config", "-nographic",
                   "-serial", "stdio", "-no-reboot", "-net", "none", "-kernel", kernel,
                   "-initrd", self.kernel / "initrd.gz", "-append",
                   f"console=ttyS0 quiet no_timer_check panic=-1 guest={HERE / script} bin={self.bin} "
                   f"repeats={repeats} seconds={seconds}",
                   "-fsdev", "local,id=h,path=/,security_model=none,readonly=on,multidevs=remap",
                   "-device", "virtio-9p-pci,fsdev=h,mount_tag=host"]
        console = self.work / "console.log"
        with open(console, "wb") as out:
            process = subprocess.Popen(list(map(str, command)), stdin=subprocess.DEVNULL, stdout=out,
                                       stderr=subprocess.STDOUT)
            try:
                process.wait(timeout)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        return console.read_text(errors="replace")


def cases_of(text):
    """What each case printed: name -> lines."""
    cases, current = {}, None
    plain = re.sub(r"\x1bc|\x1b\[[?0-9;]*[A-Za-z]", "", text)  # the firmware clears the screen
    for line in plain.splitlines():
        line = line.strip()
        if line.startswith("CASE "):
            current = line[5:]
            cases[current] = []
        elif current is not None:
            cases[current].append(line)
    return cases


class Cameras(unittest.TestCase):
    """One boot for all of them."""

    machine = None

    @classmethod
    def setUpClass(cls):
        for again in (True, False):
            cls.output = cls.machine.boot("guest_cameras.sh", 3000 if LONG else 800)
            cls.cases = cases_of(cls.output)
            # A kernel that panics once is no fault of the cameras' code.
            if "GUEST ENDED with 0" in cls.output or not again:
                break
            print("booting once more: the machine did not end as it should")

    def lines(self, case):
        self.assertIn(case, self.cases, self.output[-3000:])
        return self.cases[case]

    def result(self, case):
        for line in self.lines(case):
            if line.startswith("RESULT "):
                return json.loads(line[7:])
        return self.fail(f"{case} has no result:\n" + self.output[-3000:])

    def expect_whole(self, result):
        """Nothing torn or mixed, and every image that is missing is counted. That none is missing
        cannot be asked: an emulated machine on a busy host stands still for longer than a driver
        waits for its reader."""
        for fault in ("torn", "mixed", "not_rising"):
            self.assertEqual(result[fault], 0, result)
        dropped = result["skipped"] + result["damaged"] + result["short"] + result["no_room"]
        self.assertLessEqual(result["missing"], dropped + result["queue_dropped"], result)
        self.assertLess(result["missing"], result["frames"], result)

    def test_zed_lists_its_modes_and_controls(self):
        text = "\n".join(self.lines("zed_list"))
        for part in ("2b03:f582", "serial 0012345", "mode 4416x1242 YUYV at 15 Hz",
                     "mode 1344x376 YUYV at 100, 60, 30, 15 Hz", "control brightness=4 (0 to 8",
                     "control exposure_time_absolute="):
            self.assertIn(part, text)

    def test_zed_streams(self):
        result = self.result("zed_stream")
        self.expect_whole(result)
        self.assertEqual(result["uncounted"], 0, result)
        self.assertGreaterEqual(result["frames"], 100)
        self.assertAlmostEqual(result["exposure_ms"], 4.2, 4)  # as the control was set

    def test_the_command_publishes(self):
        text = "\n".join(self.lines("zed_published"))
        self.assertIn("published 30 frames", text)
        # A slow host may skip images, but must not damage any.
        counts = re.search(r"camera: (\d+) images, \d+ skipped, 0 damaged, 0 short", text)
        self.assertIsNotNone(counts, text)
        self.assertGreaterEqual(int(counts[1]), 30, text)

    def test_zed_controls_hold_and_bad_ones_are_refused(self):
        for line in ("gain: 33", "exposure_time_absolute: 42", "auto_exposure: 1 (Manual Mode)"):
            self.assertIn(line, self.lines("zed_stream"))
        text = "\n".join(self.lines("zed_controls"))
        self.assertIn("must be 0 to 100", text)
        self.assertIn("did you mean 'brightness'?", text)

    def test_zed_comes_back_after_every_unplugging(self):
        result = self.result("zed_unplug")
        self.expect_whole(result)
        self.assertEqual(result["uncounted"], 0, result)
        repeats = 10 if LONG else 2
        self.assertEqual(result["disconnects"], repeats, result)
        self.assertEqual(result["reconnects"], repeats, result)
        self.assertIn("gain: 44", self.lines("zed_unplug"))  # set again after the last return
        times = {word: [float(line.split()[2]) for line in self.lines("zed_unplug")
                        if line.startswith(word + " ")] for word in ("NODE", "BACK")}
        waits = [back - node for node, back in zip(times["NODE"], times["BACK"])]
        self.assertEqual(len(waits), repeats)
        print(f"seconds from the device's return to its first image: {waits}")
        if LONG:
            self.assertLess(max(waits), 2.0)

    def test_loopback_content(self):
        result = self.result("loopback")
        self.expect_whole(result)
        # VIDIOC_REQBUFS of v4l2loopback resets the number of the image that is already there, so
        # that the first step may have another length than the images'.
        self.assertLessEqual(result["uncounted"], 1, result)
        self.assertGreater(result["frames"], 20)

    def test_vivid_faults_are_survived_and_counted(self):
        result = self.result("vivid_errors")
        self.assertGreater(result["damaged"], 0, result)
        self.assertGreater(result["skipped"], 0, result)
        gone = self.result("vivid_disconnect")
        self.assertGreaterEqual(gone["disconnects"], 1, gone)
        self.assertGreaterEqual(gone["reconnects"], 1, gone)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--prepare", action="store_true")
    options = parser.parse_args()
    try:
        Cameras.machine = Machine(options.bin, options.work)
    except Missing as missing:
        print(f"Skipped\n{missing}")
        return SKIPPED
    if options.prepare:
        return 0
    suite = unittest.defaultTestLoader.loadTestsFromTestCase(Cameras)
    done = unittest.TextTestRunner(verbosity=2, stream=sys.stdout).run(suite)
    return 0 if done.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
