#include "common/io/spinning_thread_pool.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <system_error>

namespace palpate {
namespace {

constexpr int kLooks = 20'000;  // some 100 us: longer than between the steps of a body, shorter than between its frames

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

SpinningThreadPool::SpinningThreadPool(std::size_t size) : tickets_(std::max<std::size_t>(size, 1)) {
  try {
    for (std::size_t k = 1; k < size; ++k) helpers_.emplace_back([this, k] { help(k); });
  } catch (const std::system_error& fault) {
    end();
    throw std::runtime_error(std::to_string(size - 1) + " threads cannot be started: " + fault.what());
  }
}

SpinningThreadPool::~SpinningThreadPool() { end(); }

void SpinningThreadPool::end() {
  stop_.store(true);
  for (Ticket& ticket : tickets_) {
    ticket.value.store((std::uint64_t{piece_of(ticket.value.load())} + 1) << kPieceBit);
    ticket.value.notify_all();
  }
  for (std::thread& helper : helpers_) helper.join();
}

void SpinningThreadPool::run(std::size_t parts, const std::function<void(std::size_t)>& work) {
  if (helpers_.empty() || parts < 2) {
    for (std::size_t part = 0; part < parts; ++part) work(part);
    return;
  }
  work_.store(&work, std::memory_order_relaxed);
  done_.store(0, std::memory_order_relaxed);
  const std::uint64_t piece = piece_of(tickets_[0].value.load(std::memory_order_relaxed)) + 1;
  const std::uint64_t begin = (piece << kPieceBit) | (std::uint64_t{parts} << kPartsBit);
  for (Ticket& ticket : tickets_) ticket.value.store(begin, std::memory_order_release);
  for (std::size_t k = 1; k < tickets_.size(); ++k) tickets_[k].value.notify_all();
  take_parts(0);
  for (int k = 0; done_.load(std::memory_order_acquire) < parts; ++k) {
    if (k < kLooks)
      pause();
    else
      std::this_thread::yield();
  }
}

/// Runs its own parts, then those left over by others.
void SpinningThreadPool::take_parts(std::size_t self) {
  for (std::size_t k = 0; k < tickets_.size(); ++k) take_parts_of((self + k) % tickets_.size());
}

void SpinningThreadPool::take_parts_of(std::size_t thread) {
  const std::size_t threads = tickets_.size();
  for (;;) {
    const auto low = static_cast<std::uint32_t>(tickets_[thread].value.fetch_add(1, std::memory_order_acq_rel));
    const std::size_t parts = low >> kPartsBit, part = thread * parts / threads + (low & kTaken);
    if (part >= (thread + 1) * parts / threads) return;
    (*work_.load(std::memory_order_relaxed))(part);
    done_.fetch_add(1, std::memory_order_release);
  }
}

void SpinningThreadPool::help(std::size_t self) {
  const std::atomic<std::uint64_t>& mine = tickets_[self].value;
  std::uint32_t known = 0;  // number of the last piece of work
  while (!stop_.load(std::memory_order_relaxed)) {
    std::uint64_t ticket = mine.load(std::memory_order_acquire);
    for (int k = 0; piece_of(ticket) == known && k < kLooks; ++k) {
      pause();
      ticket = mine.load(std::memory_order_acquire);
    }
    if (piece_of(ticket) == known) {
      mine.wait(ticket, std::memory_order_acquire);
    } else {
      known = piece_of(ticket);
      take_parts(self);
    }
  }
}

}  // namespace palpate
