#include "client/io/end_signals.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <stdexcept>

namespace palpate {

namespace {

constexpr int kEnding[] = {SIGHUP,  SIGINT,    SIGQUIT, SIGTERM, SIGUSR1, SIGUSR2,
                           SIGALRM, SIGVTALRM, SIGPROF, SIGXCPU, SIGPWR,  SIGIO};
constexpr int kCrashing[] = {SIGABRT, SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGSYS, SIGTRAP};

std::atomic<std::atomic<bool>*> stop_flag{nullptr};
std::array<std::atomic<CrashStop*>, CrashStop::kMost> crash_stops{};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<CrashStop*>::is_always_lock_free, "used in signal handlers");

void set_stop_flag() noexcept {
  if (std::atomic<bool>* const stop = stop_flag.load()) stop->store(true);
}

void on_end(int) noexcept { set_stop_flag(); }

void on_crash(int signal, siginfo_t* about, void*) noexcept {
  // Sent by another process: no fault here, unlike a signal raised by the kernel or by this process itself.
  if (about->si_code <= 0 && about->si_pid != ::getpid()) return set_stop_flag();
  for (const auto& entry : crash_stops)
    if (CrashStop* const stop = entry.load()) stop->stop_in_crash();
  // The handler is the default again (SA_RESETHAND): a faulting instruction faults once more; a raised signal is raised again.
  if (about->si_code <= 0) ::raise(signal);
}

}  // namespace

void end_by_signals(std::atomic<bool>& stop) {
  stop_flag = &stop;
  struct sigaction action {};
  ::sigemptyset(&action.sa_mask);
  action.sa_handler = on_end;
  action.sa_flags = SA_RESTART;
  for (const int signal : kEnding) {
    struct sigaction before {};
    ::sigaction(signal, nullptr, &before);
    if (signal != SIGHUP || before.sa_handler != SIG_IGN) ::sigaction(signal, &action, nullptr);
  }
  for (const int signal : {SIGPIPE, SIGXFSZ}) ::signal(signal, SIG_IGN);
  struct sigaction crash {};
  ::sigemptyset(&crash.sa_mask);
  crash.sa_sigaction = on_crash;
  crash.sa_flags = SA_SIGINFO | SA_ONSTACK | SA_RESETHAND | SA_NODEFER;
  for (const int signal : kCrashing) ::sigaction(signal, &crash, nullptr);
}

void block_signals() noexcept {
  ::sigset_t blocked;
  ::sigfillset(&blocked);
  for (const int signal : kCrashing) ::sigdelset(&blocked, signal);
  ::pthread_sigmask(SIG_BLOCK, &blocked, nullptr);
}

CrashStop::~CrashStop() { forget_crashes(); }

void CrashStop::watch_crashes() {
  for (auto& entry : crash_stops) {
    CrashStop* none = nullptr;
    if (entry.compare_exchange_strong(none, this)) return;
  }
  throw std::runtime_error(fmt::format("more than {} loops with devices in one program", kMost));
}

void CrashStop::forget_crashes() noexcept {
  for (auto& entry : crash_stops) {
    CrashStop* self = this;
    entry.compare_exchange_strong(self, nullptr);
  }
}

CrashStack::CrashStack() noexcept {
  stack_t stack{};
  stack.ss_sp = bytes_.data();
  stack.ss_size = bytes_.size();
  ::sigaltstack(&stack, nullptr);
}

CrashStack::~CrashStack() {
  stack_t none{};
  none.ss_flags = SS_DISABLE;
  ::sigaltstack(&none, nullptr);
}

}  // namespace palpate
