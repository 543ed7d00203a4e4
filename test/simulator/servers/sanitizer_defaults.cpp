// What GLib does under the sanitizers and is no defect; the sanitizers' run times call these
// functions, so that a program that serves video needs no environment variable.
//
// Leaks: GLib's constructor, run by the dynamic loader, makes a table of quarks that is abandoned,
// on purpose, when it grows. The loader's frame can be matched only in a full stack.
// Races: GLib is not instrumented and locks with futexes that the thread sanitizer cannot see, so
// what libraries access (memcpy and the like) is left out; every access compiled into our own code
// is checked.

// NOLINTBEGIN(bugprone-reserved-identifier): the names are the run times'.
extern "C" {

const char* __asan_default_options();
const char* __lsan_default_suppressions();
const char* __tsan_default_options();

const char* __asan_default_options() { return "fast_unwind_on_malloc=0:print_suppressions=0"; }

const char* __lsan_default_suppressions() { return "leak:_dl_init\n"; }

const char* __tsan_default_options() { return "ignore_noninstrumented_modules=1"; }

}  // extern "C"
// NOLINTEND(bugprone-reserved-identifier)
