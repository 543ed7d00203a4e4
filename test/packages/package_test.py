#!/usr/bin/env python3
"""The Debian packages: what is in them, and what happens when they are installed into a bare Debian 12.

    package_test.py Contents ARCHITECTURE DIR                 their files, fields, lintian
    package_test.py Installed ARCHITECTURE DIR SIMULATE       a root of that architecture: install, run, remove, purge

ARCHITECTURE is Debian's name (amd64, arm64, armhf), DIR holds the packages, SIMULATE is this machine's
alidade-simulate, which makes the recording. Another architecture than this machine's runs under qemu-user, which is
registered in a user namespace of its own: the machine's settings stay as they are. That takes root and Linux 6.7.
"""
import hashlib
import json
import os
import pathlib
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import unittest

ARCHITECTURE, PACKAGES, SIMULATE = "", pathlib.Path(), ""
PROJECT = pathlib.Path(__file__).resolve().parents[2]
NATIVE = subprocess.run(["dpkg", "--print-architecture"], check=True, capture_output=True, text=True).stdout.strip()
TRIPLETS = {"amd64": "x86_64-linux-gnu", "arm64": "aarch64-linux-gnu", "armhf": "arm-linux-gnueabihf"}
EMULATORS = {"amd64": "x86_64", "arm64": "aarch64", "armhf": "arm"}
FRAMES = 50
NEWER = "99.0"
WANTED = "/etc/systemd/system/multi-user.target.wants/alidade.service"


def output_of(*command, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        raise AssertionError(f"{command}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def package(name):
    found = sorted(PACKAGES.glob(f"{name}_*_{ARCHITECTURE}.deb"))
    assert len(found) == 1, f"{PACKAGES} has {len(found)} packages {name} for {ARCHITECTURE}; one is to be there"
    return found[0]


def field(name, which):
    return output_of("dpkg-deb", "--field", package(name), which).strip()


def unpack_and_change(deb, folder, version):
    """The same package with another version, made into the folder."""
    with tempfile.TemporaryDirectory() as work:
        output_of("dpkg-deb", "--raw-extract", deb, f"{work}/root")
        control = pathlib.Path(work, "root/DEBIAN/control")
        control.write_text(re.sub(r"^Version: .*$", f"Version: {version}", control.read_text(encoding="utf-8"), flags=re.M), encoding="utf-8")
        output_of("dpkg-deb", "--root-owner-group", "-Zgzip", "--build", f"{work}/root", folder)


def make_repository(folder):
    """This package and a newer one, in a repository signed by a key of its own; and another key, which signed nothing."""
    home = folder / "gnupg"
    home.mkdir(mode=0o700)
    environment = {**os.environ, "GNUPGHOME": str(home)}
    packages = folder / "packages"
    packages.mkdir()
    shutil.copy(package("alidade"), packages)
    unpack_and_change(package("alidade"), packages, NEWER)
    try:
        for name in ("signer", "stranger"):
            output_of("gpg", "--batch", "--quiet", "--passphrase", "", "--quick-generate-key", name, "ed25519", "sign", "never", env=environment)
        output_of(PROJECT / "scripts/sign-packages", "signer", packages, env=environment)
        (packages / "apt/stranger.gpg").write_bytes(
            subprocess.run(["gpg", "--batch", "--export", "stranger"], check=True, capture_output=True, env=environment).stdout)
        for deb in packages.glob("*.deb"):
            output_of("gpg", "--batch", "--quiet", "--verify", f"{deb}.asc", deb, env=environment)
    finally:
        subprocess.run(["gpgconf", "--kill", "gpg-agent"], check=False, env=environment)
    return packages / "apt"


def dependencies():
    """Names alone: mmdebstrap gets them from the archive, and dpkg looks at the versions."""
    return [one.split()[0] for one in field("alidade", "Depends").split(", ")]


class Contents(unittest.TestCase):
    def unpacked(self, name):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        output_of("dpkg-deb", "--extract", package(name), folder.name)
        return pathlib.Path(folder.name)

    def test_the_program_comes_with_all_that_belongs_to_it(self):
        root = self.unpacked("alidade")
        files = {str(f.relative_to(root)) for f in root.rglob("*") if f.is_file()}
        examples = {f"usr/share/doc/alidade/examples/{f.name}" for kind in ("yaml", "conf")
                    for f in (PROJECT / "edge_app/examples").glob(f"*.{kind}")}
        self.assertGreaterEqual(len(examples), 4)
        manual = {f for f in files if f.startswith("usr/share/doc/alidade/manual/")}
        self.assertGreater(len(manual), 40)
        self.assertFalse({f for f in manual if "jquery" in f or "/." in f})
        self.assertEqual(files - manual, examples | {
            "etc/alidade/alidade.yaml", "lib/systemd/system/alidade.service", "lib/systemd/system/alidade@.service", "lib/udev/rules.d/60-alidade.rules",
            "usr/bin/alidade", "usr/share/bash-completion/completions/alidade", "usr/share/doc/alidade/changelog.gz", "usr/share/doc/alidade/copyright",
            "usr/share/lintian/overrides/alidade",
            "usr/share/man/man1/alidade.1.gz"})

    def test_the_libraries_come_with_every_header_and_the_cmake_package(self):
        root = self.unpacked("alidade-dev")
        files = {str(f.relative_to(root)) for f in root.rglob("*") if f.is_file()}
        folder = f"usr/lib/{TRIPLETS[ARCHITECTURE]}"
        libraries = {f for f in files if f.endswith(".a")}
        self.assertEqual(libraries, {f"{folder}/libalidade_{name}.a"
                                     for name in ("calibration", "pipeline", "platform", "realtime")})
        self.assertLessEqual({f"{folder}/cmake/alidade/alidade{name}.cmake"
                              for name in ("Config", "ConfigVersion", "Targets", "Targets-release")}, files)
        for header in ("core/model/lens/camera.h", "core/realtime/oe_mode/oe_mode.h", "platform/system/clock.h"):
            self.assertIn(f"usr/include/alidade/{header}", files)
        known = ("usr/include/alidade/", f"{folder}/", "usr/share/doc/alidade-dev/")
        self.assertEqual([f for f in files if not f.startswith(known)], [])

    def test_no_file_names_the_folder_it_was_built_in(self):
        for name in ("alidade", "alidade-dev"):
            for file in self.unpacked(name).rglob("*"):
                if file.is_file() and file.suffix != ".a":
                    self.assertNotIn(os.fsencode(PROJECT) + b"/", file.read_bytes(), file)

    def test_fields_say_what_it_is(self):
        for name in ("alidade", "alidade-dev"):
            self.assertEqual(field(name, "Architecture"), ARCHITECTURE)
            lines = field(name, "Description").splitlines()
            self.assertLess(len(lines[0]), 80)
            self.assertGreater(len(lines), 2)
        depends = field("alidade", "Depends")
        for needed in ("adduser", "libc6 (>=", "libavformat59 (>=", "libcurl4 (>=", "libsystemd0"):
            self.assertIn(needed, depends)
        self.assertEqual(field("alidade", "Version"), field("alidade-dev", "Version"))

    def test_libraries_depend_on_the_packages_of_all_they_link(self):
        root = self.unpacked("alidade-dev")
        targets = next(root.rglob("alidadeTargets.cmake")).read_text(encoding="utf-8")
        linked = set(re.findall(r"LINK_ONLY:([a-z][\w.-]*)>", targets))
        self.assertIn("avformat", linked)
        if ARCHITECTURE != NATIVE:
            self.skipTest("this machine's packages have the files of its own architecture")
        waiting = re.findall(r"[a-z][a-z0-9.+-]+", re.sub(r"\(.*?\)", "", field("alidade-dev", "Depends")))
        known = set()
        while waiting:
            known.add(name := waiting.pop())
            depends = subprocess.run(["dpkg-query", "-W", "-f", "${Depends}", name], capture_output=True, text=True,
                                     check=False).stdout
            waiting += set(re.findall(r"[a-z][a-z0-9.+-]+", re.sub(r"\(.*?\)|:any", "", depends))) - known
        for library in linked:
            owner = output_of("dpkg", "-S", f"/usr/lib/{TRIPLETS[NATIVE]}/lib{library}.so").split(":")[0]
            self.assertIn(owner, known, f"-l{library}")

    def test_systemd_understands_the_units_and_little_is_left_open(self):
        root = self.unpacked("alidade")
        units = root / "lib/systemd/system"
        addresses = (root / "usr/share/doc/alidade/examples/addresses.conf").read_text(encoding="utf-8")
        for name, file in (("alidade.service", "alidade.service"), ("alidade@gate.service", "alidade@.service")):
            with self.subTest(unit=name):
                text = (units / file).read_text(encoding="utf-8")
                self.assertIn("=/usr/bin/alidade run ", text)
                self.assertNotIn("@NAME@", text)
                unit = root / name
                # As it comes, and with the drop-in that is an example.
                for more in ("", addresses):
                    unit.write_text(text.replace("=/usr/bin/", f"={root}/usr/bin/") + more, encoding="utf-8")
                    done = subprocess.run(["systemd-analyze", "verify", "--man=no", "--recursive-errors=no", unit],
                                          capture_output=True, text=True, check=False)
                    self.assertEqual((done.returncode, done.stdout + done.stderr), (0, ""))
                    # Out of 100; what is left is the network, devices and real-time priority.
                    output_of("systemd-analyze", "security", "--offline=true", "--threshold=14", unit)
                for kept in ("MemoryMax=", "LimitCORE=0", "LimitRTPRIO=95", "DeviceAllow=char-video4linux rw"):
                    self.assertIn(f"\n{kept}", text)

    def test_lintian_finds_no_error(self):
        done = subprocess.run(["lintian", "--fail-on", "error,warning", "--allow-root", package("alidade"), package("alidade-dev")],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


class Installed(unittest.TestCase):
    """Makes the root, and does the rest (`inside`) in it while mmdebstrap's apt can be used for it."""

    def test_is_installed_runs_and_goes_without_a_trace(self):
        with tempfile.TemporaryDirectory() as folder:
            recording = pathlib.Path(folder, "recording")
            camera = pathlib.Path(folder, "camera.yaml")
            camera.write_text(json.dumps({
                "seed": 1, "duration_s": FRAMES / 25, "image": {"width": 160, "height": 96, "rate_hz": 25},
                "camera": {"focal_length_px": 2667.5, "line_delay_us": -60.0},
                "path": {"type": "triple_cosine", "period_s": 10},
                "scene": {"procedural": [{"azimuth_deg": 0, "elevation_deg": 0, "width_deg": 16, "height_deg": 8}]},
                "telemetry": {"sigma_rad": 5e-5}}), encoding="utf-8")
            output_of(SIMULATE, "-c", camera, "-o", recording)
            sources = [file for folder in ("/etc/apt", "/etc/apt/sources.list.d")
                       for file in sorted(pathlib.Path(folder).glob("*.*"))
                       if file.suffix in (".list", ".sources") and "debian" in file.read_text(encoding="utf-8").lower()]
            self.assertTrue(sources, "no Debian package source in /etc/apt")
            # Natively, udev too, which reads the rules; elsewhere nothing that alidade does not need.
            include = dependencies() + (["udev"] if ARCHITECTURE == NATIVE else [])
            # The root's path is the hook's last argument.
            hook = [sys.executable, "-B", __file__, "inside", ARCHITECTURE, PACKAGES, recording,
                    make_repository(pathlib.Path(folder))]
            mode = "root" if os.geteuid() == 0 else "unshare"
            command = ["mmdebstrap", f"--mode={mode}", "--variant=apt", f"--architectures={ARCHITECTURE}",
                       "--components=main", "--format=null", f"--include={','.join(include)}", '--aptopt=APT::Install-Recommends "false"',
                       '--aptopt=Acquire::Retries "3"',
                       "--customize-hook=" + " ".join(str(word) for word in hook) + ' "$1"', "bookworm", "/dev/null"]
            make = run_here if ARCHITECTURE == NATIVE else run_emulated
            code, text = make([*command, *sources])
            if code != 0 and "# dpkg" not in text:
                # A mirror that is being renewed refuses an index or two, mostly of the security updates.
                print(text, "once more, without the security updates", sep="\n", flush=True)
                code, text = make([*command, *without_security(sources, pathlib.Path(folder))])
        print(text)
        self.assertEqual(code, 0)
        self.assertIn("\nall done inside\n", text)


def without_security(sources, folder):
    """Copies of the files, without what names the security updates: paragraphs of .sources, lines of .list."""
    copies = []
    for file in sources:
        between = "\n\n" if file.suffix == ".sources" else "\n"
        kept = [part for part in file.read_text(encoding="utf-8").split(between) if "-security" not in part]
        if any(part.strip() for part in kept):
            copies.append(folder / file.name)
            copies[-1].write_text(between.join(kept) + "\n", encoding="utf-8")
    return copies


def run_here(command):
    done = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    return done.returncode, done.stdout


def run_emulated(command):
    """In namespaces of its own, where qemu-user is what runs the architecture's programs."""
    registration = f"/usr/lib/binfmt.d/qemu-{EMULATORS[ARCHITECTURE]}.conf"
    # The inner shell is root there; the outer one began before there was a root.
    inner = ["unshare", "--user", "--mount", "--pid", "--fork", "--kill-child",
             "sh", "-c", 'echo ready && read -r _ && exec "$@"', "sh",
             "sh", "-c", f"mount -t proc proc /proc && mount -t binfmt_misc binfmt_misc /proc/sys/fs/binfmt_misc && "
             f'cat {registration} > /proc/sys/fs/binfmt_misc/register && exec "$@"', "sh"]
    with subprocess.Popen([*inner, *(str(c) for c in command)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True) as child:
        if child.stdout.readline() != "ready\n":
            raise AssertionError("no user namespace here: run this test as root on a kernel that has them")
        for kind in ("uid", "gid"):
            pathlib.Path(f"/proc/{child.pid}/{kind}_map").write_text("0 0 65536", encoding="ascii")
        text, _ = child.communicate("go\n")
    return child.returncode, text


# What an installation of any package changes.
BOOKKEEPING = ("/var/lib/dpkg/", "/var/log/", "/var/cache/", "/var/lib/apt/", "/tmp/", "/proc/", "/sys/", "/dev/", "/run/")


def snapshot(root):
    """Path -> kind, mode, owner and content of all in the root."""
    found = {}
    for folder, folders, files in os.walk(root):
        folders[:] = [f for f in folders
                      if not f"{folder}/{f}/"[len(root):].startswith(BOOKKEEPING) and not os.path.ismount(f"{folder}/{f}")]
        for name in folders + files:
            path = f"{folder}/{name}"
            shown = path[len(root):]
            # adduser keeps the last version of passwd, group and shadow as passwd-, ...
            if shown.startswith(BOOKKEEPING) or re.fullmatch(r"/etc/(passwd|group|g?shadow|sub[ug]id)-", shown):
                continue
            status = os.lstat(path)
            content = ""
            if stat.S_ISREG(status.st_mode):
                content = hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()
            elif stat.S_ISLNK(status.st_mode):
                content = os.readlink(path)
            found[shown] = (oct(status.st_mode), status.st_uid, status.st_gid, content)
    return found


def kept_by_upgrade_and_downgrade(root, chroot, repository):
    """apt takes the package from the signed repository, a newer one, and the older again: what the program has stored stays."""
    shutil.copytree(repository, f"{root}/tmp/repository")
    os.makedirs(f"{root}/tmp/lists/partial")
    version = field("alidade", "Version")

    def apt(*words, key="alidade", code=0):
        pathlib.Path(root, "tmp/alidade.list").write_text(f"deb [signed-by=/tmp/repository/{key}.gpg] file:/tmp/repository bookworm main\n", encoding="ascii")
        return chroot("apt-get", "-o", "Dir::Etc::SourceList=/tmp/alidade.list", "-o", "Dir::Etc::SourceParts=-",
                      "-o", "Dir::State::Lists=/tmp/lists", "-o", "APT::Sandbox::User=root", "-y", *words, code=code)

    def installed():
        return chroot("dpkg-query", "-W", "-f", "${Version}", "alidade")

    # Nothing that another has signed, or that was changed since.
    assert "is not signed" in apt("update", key="stranger", code=100)
    lists = pathlib.Path(root, f"tmp/repository/dists/bookworm/main/binary-{ARCHITECTURE}")
    kept = {file: file.read_bytes() for file in lists.iterdir()}
    for file in kept:
        file.unlink()
    (lists / "Packages").write_bytes(kept[lists / "Packages"].replace(b"SHA256: ", b"SHA256: 0"))
    apt("update", "-o", "Acquire::AllowInsecureRepositories=false", code=100)
    for file, content in kept.items():
        file.write_bytes(content)
    apt("update")

    apt("install", "--no-install-recommends", f"alidade={version}")
    assert installed() == version
    stored = {"var/lib/alidade/calibration.yaml": "a calibration\n", "var/lib/alidade/calibration.map": "a map\n",
              "var/lib/alidade/gate/calibration.yaml": "of an instance\n", "etc/alidade/gate.yaml": "its configuration\n",
              "etc/alidade/environment": "CAMERA_PASSWORD=secret\n"}
    for path, text in stored.items():
        pathlib.Path(root, path).parent.mkdir(exist_ok=True)
        pathlib.Path(root, path).write_text(text, encoding="utf-8")
        chroot("chown", "alidade:alidade", f"/{path}")
    before = {path: os.lstat(f"{root}/{path}") for path in stored}
    # The newest that is there, and back.
    for wanted, words in ((NEWER, ("upgrade",)), (version, ("install", "--allow-downgrades", f"alidade={version}"))):
        apt(*words)
        assert installed() == wanted, installed()
        for path, text in stored.items():
            now = os.lstat(f"{root}/{path}")
            assert pathlib.Path(root, path).read_text(encoding="utf-8") == text, path
            assert (now.st_uid, now.st_gid, now.st_mode) == tuple(getattr(before[path], f"st_{which}") for which in ("uid", "gid", "mode")), path
    chroot("dpkg", "--purge", "alidade")
    assert not os.path.lexists(f"{root}/var/lib/alidade") and not os.path.lexists(f"{root}/etc/alidade/environment")
    # What an administrator wrote stays his.
    assert os.listdir(f"{root}/etc/alidade") == ["gate.yaml"]
    shutil.rmtree(f"{root}/etc/alidade")


def inside(root, recording, repository):
    """The hook: everything that is done to the root."""
    def chroot(*command, code=0):
        done = subprocess.run(["chroot", root, *command], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
                              env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "DEBIAN_FRONTEND": "noninteractive"})
        print("#", *command, f"-> {done.returncode}\n{done.stdout}{done.stderr}", flush=True)
        assert done.returncode == code, f"{command}: exit code {done.returncode}, {code} was expected"
        return done.stdout + done.stderr

    def there(path):
        return os.path.lexists(root + path)

    shutil.copy(package("alidade"), f"{root}/tmp/alidade.deb")
    shutil.copytree(recording, f"{root}/tmp/recording")
    before = snapshot(root)

    kept_by_upgrade_and_downgrade(root, chroot, repository)
    chroot("dpkg", "--install", "/tmp/alidade.deb")
    assert chroot("alidade", "--version") == f"alidade {field('alidade', 'Version')}\n"
    assert chroot("dpkg", "--verify", "alidade") == ""
    assert set(chroot("id", "-nG", "alidade").split()) == {"alidade", "video", "dialout"}
    assert chroot("stat", "-c", "%U:%G %a", "/var/lib/alidade") == "alidade:alidade 750\n"

    if ARCHITECTURE == NATIVE:
        rules = [line for line in chroot("udevadm", "test", "/sys/class/net/lo").splitlines() if "60-alidade.rules" in line]
        assert len(rules) == 1 and rules[0].startswith("Reading rules file: "), rules

    report = chroot("alidade", "check", "-c", "/etc/alidade/alidade.yaml", "--duration", "1", code=1)
    assert "/etc/alidade/alidade.yaml: ok" in report
    assert re.search(r"^video .*: failed$", report, re.M) and re.search(r"^pan/tilt .*: failed$", report, re.M)
    for url in ("rtsp://camera/axis-media/media.amp", "http://camera/"):
        assert f"alidade: {url}: " in report

    chroot("alidade", "replay", "/tmp/recording", "--calibration", "/tmp/recording/truth.yaml", "--mode", "OE")
    rows = pathlib.Path(root, "tmp/recording/alidade/orientation.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 1 + FRAMES, len(rows)
    oe = sum(",OE," in row for row in rows)
    assert oe > FRAMES / 2, f"{oe} records of OE mode"

    # Again, over a configuration that somebody has changed: it stays.
    configuration = pathlib.Path(root, "etc/alidade/alidade.yaml")
    changed = configuration.read_text(encoding="utf-8") + "# ours\n"
    configuration.write_text(changed, encoding="utf-8")
    pathlib.Path(root, "var/lib/alidade/calibration.yaml").write_text("a calibration\n", encoding="utf-8")
    chroot("dpkg", "--install", "/tmp/alidade.deb")
    assert configuration.read_text(encoding="utf-8") == changed

    # Enabled by systemd's own tool, which needs no systemd in there.
    assert not there(WANTED)
    output_of("systemctl", f"--root={root}", "enable", "alidade.service")
    assert there(WANTED)

    # Removed: what somebody has written stays, and its owner.
    chroot("dpkg", "--remove", "alidade")
    left = {path for path in snapshot(root).keys() - before.keys()}
    assert left == {"/etc/alidade", "/etc/alidade/alidade.yaml", "/var/lib/alidade", "/var/lib/alidade/calibration.yaml",
                    "/var/lib/systemd/deb-systemd-helper-enabled/alidade.service.dsh-also",
                    WANTED, os.path.dirname(WANTED)}, left
    chroot("id", "alidade")

    chroot("dpkg", "--purge", "alidade")
    after = snapshot(root)
    # systemctl made its folder, not the package.
    after.pop(os.path.dirname(WANTED), None)
    differing = {path for path in before.keys() | after.keys() if before.get(path) != after.get(path)}
    assert not differing, differing

    print("\nall done inside\n", flush=True)


if __name__ == "__main__":
    what, ARCHITECTURE, folder, *more = sys.argv[1:]
    PACKAGES = pathlib.Path(folder).resolve()
    if what == "inside":
        inside(more[2], more[0], more[1])
    else:
        SIMULATE = more[0] if more else ""
        unittest.main(argv=[sys.argv[0], "-v", what])
