// Common part of both stand-ins: a simulated Phantom driven by a thread that counts milliseconds, with faults, a log and a list
// of breaches.
#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

#include "tests/client/device/standin/standin.hpp"

namespace palpate {

class StandinArm : public Standin {
 public:
  void begin(const Motion& intention, const SimPhantomOptions& hand) override;
  void wait_for_start() override;
  void start(Micros ago) override;
  void by_hand(bool yes) override;
  void tick() override;
  void misbehave(StandinFault fault) override;
  void press(unsigned int buttons) override { buttons_ = buttons; }
  void calibrate() override;
  std::vector<StandinTick> log() const override;
  std::vector<std::string> breaches() const override;

 protected:
  StandinArm();
  /// Calls the vendor's callbacks of a millisecond. Called without the lock.
  virtual void turn() {}

  void start_time();
  void stop_time();
  bool in_time_thread() const { return std::this_thread::get_id() == turn_thread_.load(); }

  StandinFault fault() const { return fault_; }
  unsigned int buttons() const { return buttons_; }
  bool calibrated() const { return calibrated_ && fault_ != StandinFault::not_calibrated; }
  void wait_while_blocked();
  /// Reading of the tool in frame W, with the effect of faults [m].
  Vec3 position() const;
  bool turns() const;  ///< true: it has motors for rotation
  Rotation turn_of_tool() const;
  /// Opening of its gripper, which it has if its hand's motion has openings.
  double opening() const;
  bool has_gripper() const;
  /// Sets the rendered wrench, unless a fault suppresses it [W].
  void command(const Wrench& wrench);
  void breach(const std::string& what);

 private:
  void run();
  void millisecond();
  bool renders() const;
  void write_log(const StandinTick& tick) const;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<SimPhantom> phantom_;
  Vec3 reading_ = Vec3::Zero();
  double opening_ = 0;
  Wrench command_;
  std::vector<StandinTick> log_;
  std::vector<std::string> breaches_;
  std::atomic<StandinFault> fault_{StandinFault::none};
  std::atomic<unsigned int> buttons_{0};
  std::atomic<bool> calibrated_{true};
  std::atomic<std::thread::id> turn_thread_{};
  std::atomic<bool> by_hand_{false};
  bool runs_ = false;
  int asked_ = 0, done_ = 0;
  std::int64_t ticks_ = 0;
  StandinFault fault_to_come_ = StandinFault::none;
  std::int64_t fault_tick_ = -1;
  int log_file_ = -1;
  std::thread time_;
};

}  // namespace palpate
