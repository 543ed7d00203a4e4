#!/usr/bin/env python3
"""Runs a GoogleTest program as several processes beside each other, each with its share of the cases: for rooms whose tests
mostly wait for sockets, lines and deadlines.

    run_shards.py SHARDS PROGRAM [ARGUMENT...]

What a share prints comes whole, one share after another. Exit status: 0 if every share passed, else 1.
"""
import os
import subprocess
import sys
import tempfile


def main():
    shards, command = int(sys.argv[1]), sys.argv[2:]
    shares = []
    for index in range(shards):
        output = tempfile.TemporaryFile()
        environment = {**os.environ, "GTEST_TOTAL_SHARDS": str(shards), "GTEST_SHARD_INDEX": str(index)}
        shares.append((subprocess.Popen(command, env=environment, stdout=output, stderr=subprocess.STDOUT), output))
    worst = 0
    for index, (process, output) in enumerate(shares):
        code = process.wait()
        output.seek(0)
        sys.stdout.buffer.write(output.read())
        if code != 0:
            print(f"share {index} of {shards}: {'signal' if code < 0 else 'exit status'} {abs(code)}")
            worst = 1
        sys.stdout.flush()
    return worst


if __name__ == "__main__":
    sys.exit(main())
