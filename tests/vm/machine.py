"""The virtual machine that the tests of camera drivers boot, and what its scripts print.

Needs qemu-system-x86, busybox-static, cpio, kmod, v4l-utils and linux-headers-amd64; the kernel
and the sources of v4l2loopback are fetched with apt once, into the work directory.
SOVO_TEST_LONG=1 runs the long forms.
"""

import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
MODULES = ["virtio_pci", "9p", "9pnet_virtio", "overlay", "vhci_hcd", "uvcvideo", "vivid",
           "videodev", "virtio_net"]
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

    def boot(self, script, timeout, devices=(), words=(), files=()):
        """Runs a script in the machine; what the console showed. `devices`: more of qemu's options,
        which may name the open `files` by number; `words`: KEY=VALUE for the script."""
        repeats, seconds = (10, 60) if LONG else (2, 5)
        kernel = next((self.kernel / "boot").glob("vmlinuz-*"))
        words = [f"guest={HERE / script}", f"bin={self.bin}", f"repeats={repeats}",
                 f"seconds={seconds}", *words]
        command = ["qemu-system-x86_64", "-M", "q35", "-accel", "tcg", "-smp", "1", "-m", "1024",
                   "-nodefaults", "-no-user-config", "-nographic", "-serial", "stdio", "-no-reboot",
                   "-kernel", kernel, "-initrd", self.kernel / "initrd.gz", "-append",
                   "console=ttyS0 quiet no_timer_check panic=-1 " + " ".join(words),
                   "-fsdev", "local,id=h,path=/,security_model=none,readonly=on,multidevs=remap",
                   "-device", "virtio-9p-pci,fsdev=h,mount_tag=host",
                   *(devices or ["-net", "none"])]
        console = self.work / "console.log"
        with open(console, "wb") as out:
            process = subprocess.Popen(list(map(str, command)), stdin=subprocess.DEVNULL,
                                       stdout=out, stderr=subprocess.STDOUT, pass_fds=files)
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


def main(case, enter=lambda: None):
    """Runs a test case class with a machine in its `machine`; returns an exit code. `enter` is
    called first. Where something is missing it says so and returns 77; --prepare does no more than
    fetch what there is to fetch."""
    parser = argparse.ArgumentParser(description=sys.modules["__main__"].__doc__.splitlines()[0])
    parser.add_argument("--bin", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--prepare", action="store_true")
    options = parser.parse_args()
    try:
        enter()
        case.machine = Machine(options.bin, options.work)
    except Missing as missing:
        print(f"Skipped\n{missing}")
        return SKIPPED
    if options.prepare:
        return 0
    suite = unittest.defaultTestLoader.loadTestsFromTestCase(case)
    done = unittest.TextTestRunner(verbosity=2, stream=sys.stdout).run(suite)
    return 0 if done.wasSuccessful() else 1
