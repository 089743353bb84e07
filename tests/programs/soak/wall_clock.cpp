// A wall clock that can be set under a running program: preloaded, it adds the seconds (int64) in the mapped file
// PALPATE_WALL_CLOCK to CLOCK_REALTIME, gettimeofday() and time(). Nothing else changes: sleeps and waits use the kernel's
// clocks. (libfaketime 0.9.10 also shifts absolute sleeps on CLOCK_MONOTONIC, even when configured to leave that clock alone, so
// a program that sleeps until its next tick would sleep for a day.)
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>

namespace {

using ClockGettime = int (*)(clockid_t, timespec*);

const volatile std::int64_t* map_seconds() {
  const char* path = std::getenv("PALPATE_WALL_CLOCK");
  const int file = path != nullptr ? ::open(path, O_RDONLY) : -1;
  if (file < 0) return nullptr;
  void* const mapped = ::mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, file, 0);
  ::close(file);
  return mapped != MAP_FAILED ? static_cast<const volatile std::int64_t*>(mapped) : nullptr;
}

}  // namespace

extern "C" int clock_gettime(clockid_t id, timespec* t) noexcept {
  static const auto system = reinterpret_cast<ClockGettime>(::dlsym(RTLD_NEXT, "clock_gettime"));
  static const volatile std::int64_t* const ahead_s = map_seconds();
  const int failed = system(id, t);
  if (failed == 0 && ahead_s != nullptr && (id == CLOCK_REALTIME || id == CLOCK_REALTIME_COARSE)) t->tv_sec += *ahead_s;
  return failed;
}

extern "C" int gettimeofday(timeval* __restrict t, void* __restrict) noexcept {
  timespec now{};
  const int failed = clock_gettime(CLOCK_REALTIME, &now);
  *t = {now.tv_sec, now.tv_nsec / 1000};
  return failed;
}

extern "C" time_t time(time_t* out) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (out != nullptr) *out = now.tv_sec;
  return now.tv_sec;
}
