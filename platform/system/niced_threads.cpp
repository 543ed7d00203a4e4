#include "platform/system/niced_threads.h"

#include <sched.h>
#include <sys/resource.h>

#include <memory>
#include <utility>

namespace alidade {
namespace {

constexpr int kNiceness = 10;
// A handler's frames are small; with locked memory every byte of every thread's stack is resident.
constexpr std::size_t kStackBytes = std::size_t{512} << 10;

void* run_niced(void* argument) {
  const std::unique_ptr<std::function<void()>> run(static_cast<std::function<void()>*>(argument));
  // Affects this thread only, on Linux.
  static_cast<void>(::setpriority(PRIO_PROCESS, 0, kNiceness));
  (*run)();
  return nullptr;
}

bool start_niced(std::function<void()> run, int detached, pthread_t* thread) {
  auto argument = std::make_unique<std::function<void()>>(std::move(run));
  pthread_attr_t attributes;
  ::pthread_attr_init(&attributes);
  ::pthread_attr_setstacksize(&attributes, kStackBytes);
  const sched_param none{};
  ::pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
  ::pthread_attr_setschedpolicy(&attributes, SCHED_OTHER);
  ::pthread_attr_setschedparam(&attributes, &none);
  ::pthread_attr_setdetachstate(&attributes, detached);
  const bool started = ::pthread_create(thread, &attributes, run_niced, argument.get()) == 0;
  ::pthread_attr_destroy(&attributes);
  if (!started) return false;
  static_cast<void>(argument.release());  // the thread owns it now
  return true;
}

}  // namespace

bool start_detached_niced(std::function<void()> run) {
  pthread_t thread{};
  return start_niced(std::move(run), PTHREAD_CREATE_DETACHED, &thread);
}

bool NicedThreads::start(std::function<void()> run) {
  threads_.reserve(threads_.size() + 1);
  pthread_t thread{};
  if (!start_niced(std::move(run), PTHREAD_CREATE_JOINABLE, &thread)) return false;
  threads_.push_back(thread);
  return true;
}

void NicedThreads::join() {
  for (const pthread_t thread : threads_) ::pthread_join(thread, nullptr);
  threads_.clear();
}

}  // namespace alidade
