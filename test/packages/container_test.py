#!/usr/bin/env python3
"""The container image: made of the package, and what it runs when nobody says otherwise, with a configuration and a folder of ours.

    container_test.py ARCHITECTURE PACKAGES      ALIDADE_SIMULATE in the environment; as root: other roots need user namespaces
"""
import json
import os
import pathlib
import subprocess
import sys
import unittest
import urllib.request

PROJECT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(PROJECT / "test/system"))
from harness import IMAGE, Process, SystemTest, free_port, wait_until  # noqa: E402  pylint: disable=wrong-import-position

ARCHITECTURE = ""
PACKAGES = pathlib.Path()
WORDS = ["/usr/bin/alidade", "run", "-c", "/etc/alidade/alidade.yaml"]


def run(*command, code=0):
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    assert done.returncode == code, done.stdout
    return done.stdout.strip()


class Container(SystemTest):
    def buildah(self, *words):
        return ["buildah", "--storage-driver", "vfs", "--root", str(self.folder / "store"), "--runroot", str(self.folder / "run"), *words]

    def test_what_is_no_package_is_refused(self):
        self.assertIn("'nothing.deb' is no package", run(PROJECT / "scripts/container", "nothing.deb", code=2))

    def test_the_image_runs_a_camera_and_keeps_what_it_stores(self):
        version = next(PACKAGES.glob(f"alidade_*_{ARCHITECTURE}.deb"))
        archive = self.folder / "image.tar"
        self.assertEqual(run(PROJECT / "scripts/container", version, archive).splitlines()[-1], str(archive))
        container = run(*self.buildah("from", f"oci-archive:{archive}")).splitlines()[-1]
        self.addCleanup(run, *self.buildah("rm", "--all"))
        config = json.loads(run(*self.buildah("inspect", container)))["OCIv1"]["config"]
        self.assertEqual(config["Entrypoint"] + config["Cmd"], WORDS)
        self.assertEqual(config["User"], "alidade")

        camera, port = self.camera(), free_port()
        etc, kept = self.folder / "etc", self.folder / "lib"
        etc.mkdir()
        kept.mkdir(mode=0o777)
        os.chmod(kept, 0o777)
        (etc / "alidade.yaml").write_text(json.dumps({
            "video": {"type": "rtsp", "url": camera.video_url, **{side: IMAGE[side] for side in ("width", "height")}},
            "pan_tilt": {"type": "vapix", "url": camera.pan_tilt_url, "rate_hz": 50}, "camera": {"focal_length_px": 2667},
            "calibration": {"file": "/var/lib/alidade/calibration.yaml", "auto": True}, "realtime": {"mode": "OE"},
            "output": {"http": f"127.0.0.1:{port}"}}), encoding="utf-8")
        process = Process(*self.buildah("run", "--isolation", "chroot", "--volume", f"{etc}:/etc/alidade:ro",
                                        "--volume", f"{kept}:/var/lib/alidade", container, "--", *WORDS))
        self.processes.append(process)

        def received():
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/v1/status", timeout=30) as answer:
                return json.load(answer)["frames"]["received"]

        wait_until(lambda: any("HTTP: listening" in line for line in process.errors), "it listens")
        wait_until(lambda: received() > 10, "it has frames")
        # The program is the container's first process; whoever runs it ends it so.
        run("pkill", "-TERM", "-f", " ".join(["^" + WORDS[0], *WORDS[1:]]) + "$")
        code, _ = process.end()
        self.assertEqual(code, 0, process.error_text())
        self.assertEqual([file.name for file in kept.glob("*.lock")], ["calibration.yaml.lock"])


if __name__ == "__main__":
    ARCHITECTURE, PACKAGES = sys.argv.pop(1), pathlib.Path(sys.argv.pop(1))
    unittest.main()
