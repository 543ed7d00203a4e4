"""Times of the real-time stages on boards nobody has here, from counted instructions and memory traffic.

  least    max(instructions / (highest IPC x highest clock), bytes / highest bandwidth): computing and fetching overlap
  longest  instructions / (lowest IPC x lowest clock) + bytes / lowest bandwidth: nothing overlaps

IPC is instructions per clock where first-level misses hit the second level; what comes from memory, past the 512 KB
that was simulated, is in the bytes. A range holds for one thread on a core of its own, not throttled. The processors'
ranges are of two kinds and say which: stated by somebody, or judged here from how many instructions a core can take
up in a clock. docs/costs.md has the table, and what speaks for and against it.
"""
import dataclasses


@dataclasses.dataclass(frozen=True)
class Board:
    name: str
    clock_ghz: tuple
    ipc: tuple
    bandwidth_gb_s: tuple  # of one core
    source: str
    counts: str = "aarch64"


BOARDS = (
    Board("Cortex-A53", (1.2, 1.5), (0.5, 1.1), (1.5, 3),
          "clocks: Raspberry Pi 3, i.MX 8M Mini and the like; IPC: judged, two instructions a clock in order, one of them a load; "
          "bandwidth: judged, LPDDR2 to DDR4, one core"),
    Board("Cortex-A72", (1.5, 1.8), (0.9, 1.8), (3, 5.5),
          "clocks: Raspberry Pi 4; IPC: judged, three a clock out of order, 64-bit floating-point units twice; "
          "bandwidth: STREAM on a Raspberry Pi 4, 4.8 to 5.6 GB/s (sci-pi.org.uk/bench/stream.html)"),
    Board("Cortex-A76", (2.2, 2.4), (1.5, 3.0), (6, 12),
          "clocks: RK3588, Raspberry Pi 5; IPC: the A72's times 1.6 to 1.7, which Arm states for the same core as Neoverse N1 "
          "(integer; floating point 2.0 to 2.2; anandtech.com/show/13959); bandwidth: judged, LPDDR4X"),
    Board("Carmel (Xavier NX)", (1.2, 1.9), (1.1, 2.6), (8, 20),
          "clocks: NVIDIA's 10 W and 15 W modes of the Xavier modules; IPC: judged, between A72 and A76; "
          "bandwidth: judged, a third of the module's 51 GB/s"),
)
# Where it is measured, too: what the model is worth.
HOST = Board("Xeon, measured too", (2.6, 3.8), (1.5, 4.5), (6, 20),
             "a virtual machine of 2.6 GHz nominal clock, six instructions a clock; counted without AVX", "x86_64")

# What a frame is made of, thread by thread.
SUMS = {
    "PT record": ("clock", "telemetry", "telemetry", "pt"),
    "OE record, 720 lines": ("clock", "telemetry", "telemetry", "oe-720/process"),
    "OE record, 1080 lines": ("clock", "telemetry", "telemetry", "oe-1080/process"),
    "real-time thread a frame, 720 lines": ("clock", "telemetry", "telemetry", "oe-720/process", "oe-720/maintain"),
    "real-time thread a frame, 1080 lines": ("clock", "telemetry", "telemetry", "oe-1080/process", "oe-1080/maintain"),
}
# M. V. Larsen and K. Mathiassen: 1080p on a Jetson Xavier NX in its low-power mode; on a desktop.
PAPER = (("Carmel (Xavier NX)", "real-time thread a frame, 1080 lines", 10e-3, "over 100 frames a second"),
         ("Xeon, measured too", "OE record, 1080 lines", 1.7e-3, "1.7 ms on a desktop"))


def seconds(board, instructions, memory_bytes):
    """(least, longest)."""
    fastest = instructions / (board.ipc[1] * board.clock_ghz[1] * 1e9)
    slowest = instructions / (board.ipc[0] * board.clock_ghz[0] * 1e9)
    return (max(fastest, memory_bytes / (board.bandwidth_gb_s[1] * 1e9)), slowest + memory_bytes / (board.bandwidth_gb_s[0] * 1e9))


def of_sum(parts, value):
    return sum(value(part) for part in parts)


def predict(amd64, aarch64, times=None):
    """amd64, aarch64: {stage: cost}; times: {stage: s} measured on this machine. The report as plain values."""
    counts = {"x86_64": amd64, "aarch64": aarch64}
    # Memory traffic is the data's, whatever the processor: counted once.
    stages = [stage for stage in amd64 if stage in aarch64]
    rows = {stage: (stage,) for stage in stages}
    rows.update({name: parts for name, parts in SUMS.items() if all(part in stages for part in parts)})
    report = {"boards": [dataclasses.asdict(board) for board in (*BOARDS, HOST)], "rows": {}, "paper": []}
    for name, parts in rows.items():
        memory = of_sum(parts, lambda part: amd64[part]["memory_bytes"])
        row = {"memory_bytes": memory, "instructions": {}, "seconds": {}}
        for processor, costs in counts.items():
            row["instructions"][processor] = of_sum(parts, lambda part, costs=costs: costs[part]["instructions"])
        for board in (*BOARDS, HOST):
            row["seconds"][board.name] = seconds(board, row["instructions"][board.counts], memory)
        if times is not None:
            row["measured_s"] = of_sum(parts, lambda part: times[part])
        report["rows"][name] = row
    for board, row, stated_s, words in PAPER:
        if row in report["rows"]:
            least, longest = report["rows"][row]["seconds"][board]
            report["paper"].append({"board": board, "row": row, "stated_s": stated_s, "words": words, "least_s": least, "longest_s": longest})
    return report


def shown(value_s):
    """Three digits, in ms, or in us where that is shorter."""
    return f"{value_s * 1e6:.3g} us" if value_s < 1e-4 else f"{value_s * 1e3:.3g} ms"


def shown_range(least, longest):
    low, high = shown(least), shown(longest)
    return f"{low.split()[0]} - {high}" if low.split()[1] == high.split()[1] else f"{low} - {high}"


def markdown(report):
    names = [board["name"] for board in report["boards"]]
    measured = any("measured_s" in row for row in report["rows"].values())
    lines = ["| | instructions amd64 | arm64 | memory | " + " | ".join(names) + (" | measured | |" if measured else " |"),
             "|---" * (4 + len(names) + 2 * measured) + "|"]
    outside = 0
    for name, row in report["rows"].items():
        cells = [name, f"{row['instructions']['x86_64']:,.0f}", f"{row['instructions']['aarch64']:,.0f}",
                 f"{row['memory_bytes'] / 1e6:.2f} MB"]
        cells += [shown_range(*row["seconds"][board]) for board in names]
        if measured:
            least, longest = row["seconds"][HOST.name]
            inside = least <= row["measured_s"] <= longest
            outside += not inside
            cells += [shown(row["measured_s"]), "" if inside else "outside"]
        lines.append("| " + " | ".join(cells) + " |")
    if measured:
        lines.append(f"\n{len(report['rows']) - outside} of {len(report['rows'])} measured times lie in the range that is predicted for this machine.")
    for paper in report["paper"]:
        lines.append(f"\nThe paper, {paper['words']}: {paper['row']} is predicted to take "
                     f"{shown_range(paper['least_s'], paper['longest_s'])} on {paper['board']}; stated: {shown(paper['stated_s'])}.")
    lines.append("")
    lines += [f"- {board['name']}: {board['clock_ghz'][0]} to {board['clock_ghz'][1]} GHz, {board['ipc'][0]} to {board['ipc'][1]} "
              f"instructions a clock, {board['bandwidth_gb_s'][0]} to {board['bandwidth_gb_s'][1]} GB/s; {board['source']}"
              for board in report["boards"]]
    return "\n".join(lines)
