// A plugin of qemu's user emulation that counts the guest's instructions and memory accesses between the marks of
// stage_cost (stage_mark.h), and writes a line with both numbers to stderr for each piece of work. An instruction that
// loads or stores a pair makes two accesses.
//   qemu-aarch64 -plugin libstage_count_plugin.so stage_cost mark FOLDER
// Exact for one guest thread. Instructions are counted by translated block, as a mark ends its block.
//
// Debian packages no header of qemu's plugin interface; what is used of version 1 (qemu 4.2 to 8.2) is declared here.

#include <cstddef>
#include <cstdint>
#include <cstdio>

#include "test/benchmark/stage_mark.h"

extern "C" {

struct qemu_plugin_tb;
struct qemu_plugin_insn;
struct qemu_info_t;

enum qemu_plugin_op { kAdd = 0 };
// 7.2 confuses loads and stores where only one of them is asked for.
enum qemu_plugin_mem_rw { kReadOrWrite = 3 };

void qemu_plugin_register_vcpu_tb_trans_cb(std::uint64_t id,
                                           void (*translated)(std::uint64_t, qemu_plugin_tb*));
void qemu_plugin_register_vcpu_syscall_cb(
    std::uint64_t id, void (*called)(std::uint64_t, unsigned, std::int64_t, std::uint64_t,
                                     std::uint64_t, std::uint64_t, std::uint64_t, std::uint64_t,
                                     std::uint64_t, std::uint64_t, std::uint64_t));
void qemu_plugin_register_vcpu_tb_exec_inline(qemu_plugin_tb* block, qemu_plugin_op operation,
                                              void* counter, std::uint64_t added);
void qemu_plugin_register_vcpu_mem_inline(qemu_plugin_insn* instruction, qemu_plugin_mem_rw which,
                                          qemu_plugin_op operation, void* counter,
                                          std::uint64_t added);
std::size_t qemu_plugin_tb_n_insns(const qemu_plugin_tb* block);
qemu_plugin_insn* qemu_plugin_tb_get_insn(const qemu_plugin_tb* block, std::size_t index);

}  // extern "C"

namespace {

struct Counts {
  std::uint64_t instructions = 0;
  std::uint64_t accesses = 0;
};

Counts counts;
Counts at_mark;

void on_block(std::uint64_t, qemu_plugin_tb* block) {
  const std::size_t size = qemu_plugin_tb_n_insns(block);
  qemu_plugin_register_vcpu_tb_exec_inline(block, kAdd, &counts.instructions, size);
  for (std::size_t i = 0; i < size; ++i) {
    qemu_plugin_register_vcpu_mem_inline(qemu_plugin_tb_get_insn(block, i), kReadOrWrite, kAdd,
                                         &counts.accesses, 1);
  }
}

void on_system_call(std::uint64_t, unsigned, std::int64_t number, std::uint64_t begins,
                    std::uint64_t, std::uint64_t, std::uint64_t, std::uint64_t, std::uint64_t,
                    std::uint64_t, std::uint64_t) {
  if (number != alidade::benchmarks::kStageMark) return;
  if (begins != 0) {
    at_mark = counts;
    return;
  }
  std::fprintf(stderr, "counted %llu %llu\n",
               static_cast<unsigned long long>(counts.instructions - at_mark.instructions),
               static_cast<unsigned long long>(counts.accesses - at_mark.accesses));
}

}  // namespace

extern "C" {

__attribute__((visibility("default"))) int qemu_plugin_version = 1;

__attribute__((visibility("default"))) int qemu_plugin_install(std::uint64_t id, const qemu_info_t*,
                                                               int, char**) {
  qemu_plugin_register_vcpu_tb_trans_cb(id, on_block);
  qemu_plugin_register_vcpu_syscall_cb(id, on_system_call);
  return 0;
}

}  // extern "C"
