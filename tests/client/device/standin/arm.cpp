#include "tests/client/device/standin/arm.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "common/motion/motion.hpp"

namespace palpate {

namespace {

constexpr double kJumpM = 0.03, kUncalibratedM = 0.1;

const char* from_environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

StandinFault fault_named(std::string_view name) {
  for (std::size_t i = 0; i < std::size(kStandinFaults); ++i)
    if (kStandinFaults[i] == name) return static_cast<StandinFault>(i);
  std::fprintf(stderr, "stand-in: no fault %.*s\n", static_cast<int>(name.size()), name.data());
  std::abort();
}

}  // namespace

StandinArm::StandinArm() {
  SimPhantomOptions hand;
  if (const auto named = hand_from_name(from_environment("STANDIN_HAND"))) hand.hand = *named;
  const std::string file = from_environment("STANDIN_MOTION");
  begin(file.empty() ? Motion::rest(Vec3::Zero(), 1.0) : read_motion(file), hand);
  if (const std::string log = from_environment("STANDIN_LOG"); !log.empty())
    log_file_ = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (const std::string fault = from_environment("STANDIN_FAULT"); !fault.empty()) {
    const std::size_t at = fault.find('@');
    fault_to_come_ = fault_named(std::string_view(fault).substr(0, at));
    fault_tick_ = at == std::string::npos ? 0 : static_cast<std::int64_t>(1e3 * std::atof(fault.c_str() + at + 1));
    if (fault_tick_ == 0) fault_ = fault_to_come_;
  }
}

void StandinArm::begin(const Motion& intention, const SimPhantomOptions& hand) {
  const std::lock_guard lock(mutex_);
  phantom_.emplace(intention, hand);
  reading_ = phantom_->position();
  opening_ = 0;
  command_ = {};
  log_.clear();
  breaches_.clear();
  fault_ = StandinFault::none;
  buttons_ = 0;
  calibrated_ = true;
  ticks_ = 0;
}

void StandinArm::wait_for_start() {
  const std::lock_guard lock(mutex_);
  phantom_->wait_for_start();
}

void StandinArm::start(Micros ago) {
  const std::lock_guard lock(mutex_);
  phantom_->start(Micros{1'000 * ticks_} - ago);
}

void StandinArm::by_hand(bool yes) {
  const std::lock_guard lock(mutex_);
  by_hand_ = yes;
  changed_.notify_all();
}

void StandinArm::tick() {
  std::unique_lock lock(mutex_);
  const int mine = ++asked_;
  changed_.notify_all();
  changed_.wait(lock, [&] { return done_ >= mine || !runs_; });
}

void StandinArm::misbehave(StandinFault fault) {
  const std::lock_guard lock(mutex_);
  if (fault == StandinFault::not_calibrated) calibrated_ = false;
  fault_ = fault;
  changed_.notify_all();
}

void StandinArm::calibrate() {
  calibrated_ = true;
  misbehave(StandinFault::none);
}

std::vector<StandinTick> StandinArm::log() const {
  const std::lock_guard lock(mutex_);
  return log_;
}

std::vector<std::string> StandinArm::breaches() const {
  const std::lock_guard lock(mutex_);
  return breaches_;
}

void StandinArm::start_time() {
  const std::lock_guard lock(mutex_);
  if (runs_) return;
  runs_ = true;
  asked_ = done_ = 0;
  time_ = std::thread([this] { run(); });
}

void StandinArm::stop_time() {
  {
    const std::lock_guard lock(mutex_);
    runs_ = false;
    changed_.notify_all();
  }
  if (time_.joinable()) time_.join();
}

void StandinArm::run() {
  auto due = std::chrono::steady_clock::now();
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      if (by_hand_) changed_.wait(lock, [&] { return !runs_ || !by_hand_ || asked_ > done_; });
      if (!runs_) return;
    }
    if (!by_hand_) std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
    millisecond();
    const std::lock_guard lock(mutex_);
    ++done_;
    changed_.notify_all();
  }
}

void StandinArm::millisecond() {
  {
    const std::lock_guard lock(mutex_);
    if (ticks_ == fault_tick_) fault_ = fault_to_come_;
    const DeviceReading reading = phantom_->read(Micros{1'000 * ticks_++});
    reading_ = reading.position;
    opening_ = reading.opening;
  }
  if (fault_ == StandinFault::other_thread) {
    std::thread([this] {
      turn_thread_ = std::this_thread::get_id();
      turn();
    }).join();
  } else if (fault_ != StandinFault::silent) {
    turn_thread_ = std::this_thread::get_id();
    turn();
  }
  const std::lock_guard lock(mutex_);
  phantom_->write(!renders() ? Wrench() : fault_ == StandinFault::mirrored ? -1 * command_ : command_);
  log_.push_back({phantom_->position(), phantom_->force(), phantom_->turn(), phantom_->torque()});
  write_log(log_.back());
}

bool StandinArm::renders() const {
  switch (fault_) {
    case StandinFault::hot:
    case StandinFault::force_limit:
    case StandinFault::velocity_limit:
    case StandinFault::lost:
    case StandinFault::button_off:
      return false;
    default:
      return true;
  }
}

void StandinArm::write_log(const StandinTick& tick) const {
  if (log_file_ < 0) return;
  std::array<char, 160> line;
  const auto& [x, f, turn, torque] = tick;
  const int size = std::snprintf(line.data(), line.size(), "%.3f %.6f %.6f %.6f %.4f %.4f %.4f\n",
                                 1e-3 * static_cast<double>(ticks_ - 1), x.x(), x.y(), x.z(), f.x(), f.y(), f.z());
  if (write(log_file_, line.data(), static_cast<std::size_t>(size)) != size) std::abort();
}

void StandinArm::wait_while_blocked() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return fault_ != StandinFault::blocks; });
}

Vec3 StandinArm::position() const {
  const std::lock_guard lock(mutex_);
  Vec3 position = reading_;
  if (fault_ == StandinFault::jump) position.x() += kJumpM;
  if (fault_ == StandinFault::nan) position.y() = std::numeric_limits<double>::quiet_NaN();
  if (!calibrated_) position.x() += kUncalibratedM;
  return position;
}

bool StandinArm::turns() const {
  const std::lock_guard lock(mutex_);
  return phantom_->caps().renders_torque;
}

Rotation StandinArm::turn_of_tool() const {
  const std::lock_guard lock(mutex_);
  return phantom_->turn();
}

double StandinArm::opening() const {
  const std::lock_guard lock(mutex_);
  return opening_;
}

bool StandinArm::has_gripper() const {
  const std::lock_guard lock(mutex_);
  return phantom_->caps().has_opening;
}

void StandinArm::command(const Wrench& wrench) {
  const std::lock_guard lock(mutex_);
  command_ = wrench;
}

void StandinArm::breach(const std::string& what) {
  const std::lock_guard lock(mutex_);
  if (breaches_.size() < 100) breaches_.push_back(what);
}

}  // namespace palpate
