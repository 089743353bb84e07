#include "common/io/spinning_crew.hpp"

namespace palpate {
namespace {

constexpr int kLooks = 20'000;  // some 100 us: between the steps of a body less passes, between its frames more

constexpr unsigned kPieceBit = 32, kPartsBit = 16;
constexpr std::uint32_t kTaken = 0xFFFF;

std::uint32_t piece_of(std::uint64_t ticket) { return static_cast<std::uint32_t>(ticket >> kPieceBit); }

void pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#else
  std::this_thread::yield();
#endif
}

}  // namespace

SpinningCrew::SpinningCrew(std::size_t size) {
  for (std::size_t k = 1; k < size; ++k) helpers_.emplace_back([this] { help(); });
}

SpinningCrew::~SpinningCrew() {
  stop_.store(true);
  ticket_.store((std::uint64_t{piece_of(ticket_.load())} + 1) << kPieceBit);
  ticket_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
}

void SpinningCrew::run(std::size_t parts, const std::function<void(std::size_t)>& work) {
  if (helpers_.empty() || parts < 2) {
    for (std::size_t part = 0; part < parts; ++part) work(part);
    return;
  }
  work_.store(&work, std::memory_order_relaxed);
  done_.store(0, std::memory_order_relaxed);
  const std::uint64_t piece = piece_of(ticket_.load(std::memory_order_relaxed)) + 1;
  ticket_.store((piece << kPieceBit) | (std::uint64_t{parts} << kPartsBit), std::memory_order_release);
  ticket_.notify_all();
  take_parts();
  for (int k = 0; done_.load(std::memory_order_acquire) < parts; ++k) {
    if (k < kLooks)
      pause();
    else
      std::this_thread::yield();
  }
}

/// Until none is left. Returns the piece that they were of.
std::uint32_t SpinningCrew::take_parts() {
  for (;;) {
    const std::uint64_t ticket = ticket_.fetch_add(1, std::memory_order_acq_rel);
    const auto low = static_cast<std::uint32_t>(ticket), part = low & kTaken;
    if (part >= low >> kPartsBit) return piece_of(ticket);
    (*work_.load(std::memory_order_relaxed))(part);
    done_.fetch_add(1, std::memory_order_release);
  }
}

void SpinningCrew::help() {
  std::uint32_t known = 0;  // piece
  while (!stop_.load(std::memory_order_relaxed)) {
    std::uint64_t ticket = ticket_.load(std::memory_order_acquire);
    for (int k = 0; piece_of(ticket) == known && k < kLooks; ++k) {
      pause();
      ticket = ticket_.load(std::memory_order_acquire);
    }
    if (piece_of(ticket) == known)
      ticket_.wait(ticket, std::memory_order_acquire);
    else
      known = take_parts();
  }
}

}  // namespace palpate
