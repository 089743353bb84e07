// A crashing program: the last commands to its device, observed from outside.
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <thread>
#include <utility>

#include "client/io/end_signals.hpp"
#include "client/io/haptic_loop.hpp"
#include "common/io/monotonic.hpp"
#include "tests/support/felt_device.hpp"

using namespace palpate;

namespace {

/// Log in memory shared by two processes.
struct Log {
  static constexpr std::size_t kMost = 20'000;
  std::atomic<std::size_t> writes{0};
  std::atomic<int> stops{0}, halts{0};
  std::atomic<bool> falls{false}, ended{false};  ///< `falls`: the loop's own thread must crash
  std::array<std::atomic<double>, kMost> force{};
};

class Logged final : public Device {
 public:
  explicit Logged(Log& log) : log_(log) {}
  const DeviceCaps& caps() const override { return caps_; }
  DeviceReading read(Micros) noexcept override {
    if (log_.falls) *static_cast<volatile int*>(nullptr) = 1;
    return {Vec3(3e-5 * static_cast<double>(++readings_ % 2), 0, 0), DeviceState::ok};
  }
  void write(const Wrench& wrench) noexcept override { put(wrench.force.norm()); }
  void stop() noexcept override { put(0), ++log_.stops; }
  void halt() noexcept override { put(0), ++log_.halts; }

 private:
  void put(double force_n) noexcept {
    const std::size_t at = log_.writes.load();
    if (at < Log::kMost) log_.force[at] = force_n;
    log_.writes = at + 1;
  }
  Log& log_;
  int readings_ = 0;
  DeviceCaps caps_ = test::felt_caps();
};

using SharedLog = std::unique_ptr<Log, void (*)(Log*)>;

SharedLog shared_log() {
  void* const memory = ::mmap(nullptr, sizeof(Log), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  REQUIRE(memory != MAP_FAILED);
  return {new (memory) Log, [](Log* log) { ::munmap(log, sizeof(Log)); }};
}

/// A program with a hand that is pushed with 2 N; then calls `fall`. It ends by itself on request.
[[noreturn]] void program(Log& log, void (*fall)(Log&)) {
  static std::atomic<bool> stop{false};
  end_by_signals(stop);
  const auto slot = std::make_unique<LatestSlot<PatchPlayer>>();
  const auto samples = std::make_unique<SampleRing>();
  HapticTick haptic(*slot, *samples, {});
  Patch patch;
  patch.constant = true;
  patch.stamp = monotonic_now();
  patch.force = Vec3(0, 0, 2);
  patch.valid_for = Micros{60'000'000};
  patch.trust_radius_m = 1;
  slot->back() = PatchPlayer(patch);
  slot->publish();
  Logged device(log);
  HapticLoop loop(device, {&haptic}, {false, 0});
  loop.start();
  while (log.writes < 100) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  fall(log);
  while (!stop) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  loop.stop();
  log.ended = true;
  std::_Exit(0);
}

/// Exit status of the program, from waitpid.
int outcome(Log& log, void (*fall)(Log&), int signal_from_outside = 0) {
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    ::signal(SIGALRM, SIG_DFL);
    program(log, fall);
  }
  if (signal_from_outside != 0) {
    while (log.writes < 150) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ::kill(child, signal_from_outside);
  }
  int status = 0;
  REQUIRE(::waitpid(child, &status, 0) == child);
  return status;
}

/// The same with its own log, repeated if the machine stalled so long that the watchdog acted before the crash.
std::pair<int, SharedLog> calm_outcome(void (*fall)(Log&), int signal_from_outside, int halts) {
  constexpr int kTries = 10;
  for (int left = kTries;; --left) {
    SharedLog log = shared_log();
    const int status = outcome(*log, fall, signal_from_outside);
    if (log->halts <= halts || left == 0) return {status, std::move(log)};
  }
}

double last_force(const Log& log) {
  const std::size_t writes = log.writes;
  REQUIRE(writes > 100);
  REQUIRE(writes < Log::kMost);
  return log.force[writes - 1];
}

/// Returns true if the force falls from 2 N to zero by at most `most_n` at a time.
bool ramps(const Log& log, double most_n) {
  for (std::size_t i = 101; i < log.writes; ++i)
    if (log.force[i - 1] - log.force[i] > most_n + 1e-9) return false;
  return true;
}

void stay(Log&) {}

}  // namespace

TEST_CASE("A program that falls ramps the force to zero before it dies", "[realtime]") {
  void (*const falls[])(Log&) = {
      [](Log&) { std::abort(); },
      [](Log&) { *static_cast<volatile int*>(nullptr) = 1; },
      [](Log&) { std::thread([] { throw std::runtime_error("nobody catches this"); }).join(); },
      [](Log&) { ::raise(SIGFPE); },
  };
  const int signals[] = {SIGABRT, SIGSEGV, SIGABRT, SIGFPE};
  const auto which = GENERATE(0u, 1u, 2u, 3u);
  const auto [status, log] = calm_outcome(falls[which], 0, 1);
  CHECK(WIFSIGNALED(status));
  CHECK(WTERMSIG(status) == signals[which]);
  CHECK(last_force(*log) == 0);
  CHECK(log->stops == 1);
  CHECK(log->halts >= 1);
  CHECK(ramps(*log, 2.0 / HapticLoop::kRampTicks));
}

TEST_CASE("A device whose own code falls is halted by it", "[realtime]") {
  const auto log = shared_log();
  const int status = outcome(*log, [](Log& fallen) { fallen.falls = true; });
  CHECK(WIFSIGNALED(status));
  CHECK(WTERMSIG(status) == SIGSEGV);
  CHECK(log->halts >= 1);
  CHECK(last_force(*log) == 0);
}

TEST_CASE("A signal from outside ends the program in its own order, with a ramp, whichever it is", "[realtime]") {
  const int signal = GENERATE(SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1, SIGALRM, SIGABRT, SIGSEGV, SIGXCPU);
  const auto [status, log] = calm_outcome(stay, signal, 0);
  CAPTURE(signal);
  CHECK(WIFEXITED(status));
  CHECK(log->ended);
  CHECK(log->stops == 1);
  CHECK(last_force(*log) == 0);
  CHECK(ramps(*log, 2.0 / HapticLoop::kRampTicks));
}

TEST_CASE("A pipe that nobody reads ends nothing", "[realtime]") {
  const auto log = shared_log();
  const int status = outcome(*log, [](Log& told) {
    int ends[2];
    if (::pipe(ends) != 0) std::_Exit(3);
    ::close(ends[0]);
    const bool refused = ::write(ends[1], "x", 1) < 0 && errno == EPIPE;
    if (!refused) std::_Exit(4);
    const std::size_t before = told.writes;
    while (told.writes < before + 20) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ::kill(::getpid(), SIGTERM);
  });
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
  CHECK(log->ended);
}
