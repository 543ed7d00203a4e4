"""What the tests inside a virtual machine share: the machine, its boot, and how its tests end."""
import pathlib
import subprocess
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
TOP = HERE.parents[2]
MACHINES = TOP / "build/virtual_machine"
SKIPPED = 77

# No answers without one.
CALIBRATION = """format: 1
image: {width: %d, height: %d}
focal_length: {value: 1000}
radial_distortion: {value: 0}
line_delay: {value: 0}
clock_offset: {value: 0}
pan_axis: {value: [0, 0, 1]}
tilt_axis: {value: [0, 1, 0]}
pan_scale: {value: 1}
tilt_scale: {value: 1}
"""


def run(*command):
    """Runs it; a skip of its own is one of this test."""
    done = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode == SKIPPED:
        print(done.stdout)
        sys.exit(SKIPPED)
    return done


def make(architecture):
    """The machine's folder."""
    machine = MACHINES / architecture
    made = run(HERE / "make-machine", architecture, machine)
    if made.returncode != 0:
        sys.exit(f"make-machine failed:\n{made.stdout}")
    return machine


def judge(test_case, console):
    """Runs the tests and ends the program; the whole console is shown when one fails."""
    suite = unittest.defaultTestLoader.loadTestsFromTestCase(test_case)
    result = unittest.TextTestRunner(stream=sys.stdout, verbosity=2).run(suite)
    if not result.wasSuccessful():
        print(f"--- console of the machine\n{console}")
    else:
        print("\n".join(line for line in console.splitlines() if line.startswith("machine:")))
    sys.exit(0 if result.wasSuccessful() else 1)
