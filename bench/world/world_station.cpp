// Faults of one station of the simulated world.
#include "bench/world/world.hpp"

namespace palpate {
namespace {

/// The same link with another seed.
LinkSpec of_channel(LinkSpec spec) {
  spec.seed ^= 0x7472757374ull;
  return spec;
}

}  // namespace

WorldStation::WorldStation(const ClientOptions& options, std::unique_ptr<MotionDevice> device, const LinkSpec& up,
                           const LinkSpec& down, const WorldClock& clock, Micros now)
    : options_(options),
      device_(std::move(device)),
      clock_(clock),
      up_link_(up),
      down_link_(down),
      channel_up_(of_channel(up)),
      channel_down_(of_channel(down)) {
  new_core(now);
  next_tick_ = clock_.at(now);
}

void WorldStation::new_core(Micros now) {
  core_ = std::make_unique<ClientCore>(options_, clock_.at(now));
  ++lives_;
  peer_ = 0;
}

void WorldStation::change_link(const LinkSpec& up, const LinkSpec& down) {
  up_link_.change(up);
  down_link_.change(down);
  channel_up_.change(up);
  channel_down_.change(down);
}

void WorldStation::cut(bool up, bool down) {
  cut_up_ = up;
  cut_down_ = down;
}

void WorldStation::stall_net(bool stalled) { net_stalled_ = stalled; }
void WorldStation::stall_haptic(bool stalled) { haptic_stalled_ = stalled; }

void WorldStation::sleep(Micros now) {
  if (!asleep()) asleep_since_ = now;
}

void WorldStation::wake(Micros now) {
  if (asleep()) clock_.step(*asleep_since_ - now);
  asleep_since_.reset();
}

void WorldStation::leave() {
  if (!up() || asleep()) return;
  core_->leave();
  haptic_stalled_ = leaving_ = true;
  if (device_) device_->stop();
}

void WorldStation::crash() {
  if (asleep()) return;
  up_ = leaving_ = net_stalled_ = haptic_stalled_ = false;
  waiting_.clear();
  if (device_) device_->stop();
}

void WorldStation::join_again(Micros now) {
  if (up() || asleep()) return;
  crash();  // without a goodbye, as its machine was down
  new_core(now);
  up_ = true;
}

}  // namespace palpate
