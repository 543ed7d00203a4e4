// Runs fuzz targets without libFuzzer, the same way each time:
//   fuzz_regressions TARGET [--mutations=N] FOLDER...
// each file of the folders as it is (README.md aside), then N inputs (the target's own number) made of them: bytes changed,
// taken out, put in, doubled, taken over from another file. The target runs in a child process, one input
// after another; where the child dies or stands still, this one says at which input, keeps the input as
// crash-TARGET in the working directory, and ends with 1. No file at all is an error, too (2).
//   fuzz_regressions --all DIR
// every target with DIR/corpus/TARGET and, where it is there, DIR/regressions/TARGET; ends with the worst of their codes.

#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <new>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "test/fuzz/fuzz_target.h"
#include "test/fuzz/regression_targets.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongest = 64U << 10U;  // bytes that mutation lets an input grow to
constexpr unsigned kPatience_s = 60;          // for one input

struct Seed {
  std::string name;
  std::string bytes;
};

std::vector<Seed> read_seeds(const std::vector<std::string>& folders) {
  std::vector<fs::path> paths;
  for (const std::string& folder : folders) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      if (entry.path().filename() != "README.md") paths.push_back(entry.path());
    }
  }
  std::sort(paths.begin(), paths.end());
  std::vector<Seed> seeds;
  for (const fs::path& path : paths) {
    std::ostringstream bytes;
    std::ifstream file(path, std::ios::binary);
    if (file.peek() != std::ifstream::traits_type::eof()) bytes << file.rdbuf();
    seeds.push_back({path.string(), bytes.str()});
  }
  return seeds;
}

class Mutator {
 public:
  explicit Mutator(const std::vector<Seed>& seeds) : seeds_(seeds) {}

  Seed next() {
    const Seed& parent = seeds_[below(seeds_.size())];
    Seed child{"mutation " + std::to_string(++count_) + " of " + parent.name, parent.bytes};
    const std::size_t changes = 1 + below(4);
    for (std::size_t i = 0; i < changes; ++i) change(&child.bytes);
    child.bytes.resize(std::min(child.bytes.size(), kLongest));
    return child;
  }

 private:
  // Not by a std distribution: those differ between libraries.
  std::size_t below(std::size_t end) { return static_cast<std::size_t>(random_() % end); }
  char any_byte() {
    constexpr std::string_view kTelling("\x00\xFF\x7F\x80\n\r .,:-{}[]<>=\"'09e", 23);
    return below(2) == 0 ? kTelling[below(kTelling.size())] : static_cast<char>(below(256));
  }

  void change(std::string* bytes) {
    const std::size_t at = below(bytes->size() + 1);
    const std::size_t count = std::min<std::size_t>(1 + below(16), bytes->size() - at);
    switch (below(6)) {
      case 0:
        if (at < bytes->size()) (*bytes)[at] = any_byte();
        break;
      case 1:
        if (at < bytes->size()) (*bytes)[at] = static_cast<char>((*bytes)[at] ^ (1 << below(8)));
        break;
      case 2:
        bytes->insert(at, 1, any_byte());
        break;
      case 3:
        bytes->erase(at, count);
        break;
      case 4:
        bytes->insert(at, bytes->substr(below(bytes->size() + 1), count));
        break;
      default: {
        const std::string& other = seeds_[below(seeds_.size())].bytes;
        bytes->replace(at, std::string::npos, other, below(other.size() + 1), std::string::npos);
      }
    }
  }

  const std::vector<Seed>& seeds_;
  std::mt19937_64 random_{20261121};
  std::size_t count_ = 0;
};

// Where the child is, for the parent to see. `done` runs from 0 to the number of inputs.
struct Progress {
  std::atomic<std::size_t> done{0};
};
static_assert(std::atomic<std::size_t>::is_always_lock_free, "two processes share it");

void run(const FuzzTarget& target, const std::vector<Seed>& inputs, Progress* progress) {
  for (const Seed& input : inputs) {
    ::alarm(kPatience_s);
    // A copy of its own size, so that reading beyond the end is seen.
    const std::vector<std::uint8_t> bytes(input.bytes.begin(), input.bytes.end());
    static_cast<void>(target.one_input(bytes.data(), bytes.size()));
    ++progress->done;
  }
}

int report(const FuzzTarget& target, const Seed& input, int status) {
  const std::string kept = std::string("crash-") + target.name;
  std::ofstream(kept, std::ios::binary) << input.bytes;
  std::cerr << target.name << ": "
            << (WIFSIGNALED(status) ? "signal " + std::to_string(WTERMSIG(status))
                                    : "exit " + std::to_string(WEXITSTATUS(status)))
            << " at " << input.name << ", kept as " << kept << '\n';
  return 1;
}

int run_in_child(const FuzzTarget& target, std::size_t mutations,
                 const std::vector<std::string>& folders) {
  std::vector<Seed> inputs = read_seeds(folders);
  const std::size_t files = inputs.size();
  if (files == 0) {
    std::cerr << target.name << ": no input; give folders with files\n";
    return 2;
  }
  const std::vector<Seed> seeds = inputs;
  Mutator mutator(seeds);
  for (std::size_t i = 0; i < mutations; ++i) inputs.push_back(mutator.next());

  void* shared =
      ::mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) {
    std::perror("mmap");
    return 2;
  }
  auto* progress = new (shared) Progress;
  const pid_t child = ::fork();
  if (child < 0) {
    std::perror("fork");
    return 2;
  }
  if (child == 0) {
    run(target, inputs, progress);
    std::exit(0);  // not _exit: the leak sanitizer looks at the end
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  const std::size_t done = progress->done.load();
  ::munmap(shared, sizeof(Progress));
  if (status != 0) return report(target, inputs[std::min(done, inputs.size() - 1)], status);
  std::cout << target.name << ": " << files << " files and " << mutations << " mutations of them"
            << std::endl;
  return 0;
}

int run_all(const fs::path& directory) {
  int worst = 0;
  for (const FuzzTarget& target : kRegressionTargets) {
    std::vector<std::string> folders{directory / "corpus" / target.name};
    if (fs::is_directory(directory / "regressions" / target.name)) {
      folders.push_back(directory / "regressions" / target.name);
    }
    worst = std::max(worst, run_in_child(target, target.mutations, folders));
  }
  return worst;
}

int main_of(const std::vector<std::string>& arguments) {
  if (arguments.size() == 3 && arguments[1] == "--all") return run_all(arguments[2]);
  const std::string name = arguments.size() < 2 ? "" : arguments[1];
  const FuzzTarget* target = name == kPlantedDefect.name ? &kPlantedDefect : nullptr;
  for (const FuzzTarget& known : kRegressionTargets) {
    if (name == known.name) target = &known;
  }
  if (target == nullptr) {
    std::cerr << "fuzz_regressions: '" << name
              << "' is no target; use: fuzz_regressions --all DIR | TARGET FOLDER...\n";
    return 2;
  }
  std::size_t mutations = target->mutations;
  std::vector<std::string> folders;
  for (std::size_t i = 2; i < arguments.size(); ++i) {
    constexpr std::string_view kOption = "--mutations=";
    if (arguments[i].rfind(kOption, 0) == 0) {
      mutations = std::stoul(arguments[i].substr(kOption.size()));
    } else {
      folders.push_back(arguments[i]);
    }
  }
  return run_in_child(*target, mutations, folders);
}

}  // namespace
}  // namespace alidade

int main(int argc, char** argv) {
  return alidade::main_of(std::vector<std::string>(argv, argv + argc));
}
