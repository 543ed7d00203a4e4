#include "test/accuracy/scaling.h"

#include <cmath>

#include "test/accuracy/backend.h"

namespace alidade::test {

void run_scaling(int runs, std::uint64_t first_seed, Report* report) {
  Table table;
  table.title = "scaling, " + std::to_string(runs) + " runs a row from seed " +
                std::to_string(first_seed) + ": CPU time of one calibration";
  table.header = {"duration, s", "frames",     "observations",    "segments",
                  "median, s",   "largest, s", "over one before", "exponent"};
  double before = 0;
  for (const int times : {1, 2, 4, 8, 16, 32}) {
    std::vector<double> frames;
    std::vector<double> observations;
    std::vector<double> segments;
    std::vector<double> seconds;
    std::vector<Run> done;
    for (int i = 0; i < runs; ++i) {
      Simulation s = draw_backend(Scales::kBase, first_seed + static_cast<std::uint64_t>(i));
      s.duration_s *= times;
      const SimulatedRecording recording = simulate_with_truth(s);
      done.push_back(run_recording(s, recording, backend_options(Scales::kBase),
                                   backend_spread(Scales::kBase)));
      frames.push_back(static_cast<double>(recording.input.frames.size()));
      observations.push_back(static_cast<double>(recording.input.observations.size()));
      segments.push_back(done.back().segments);
      seconds.push_back(done.back().cpu_s);
    }
    const double typical = median(seconds);
    table.rows.push_back({std::to_string(10 * times), number(median(frames)),
                          number(median(observations)), number(median(segments)), number(typical),
                          number(largest(seconds)), before > 0 ? number(typical / before) : "-",
                          before > 0 ? number(std::log2(typical / before)) : "-"});
    before = typical;
    const std::string name = std::to_string(10 * times) + " s";
    report->list_failures(name, done);
    report->add_runs(name, done);
  }
  table.notes = {
      "Columns but the last two are medians over the runs; exponent: of the number of frames."};
  report->add(table);
}

}  // namespace alidade::test
