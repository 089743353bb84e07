#include "client/view/app/touch.hpp"

#include <fmt/format.h>

#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

constexpr double kFeltN = 1e-3;  // limit below which the tool counts as free

ClientOptions options_of(const std::string& station, const std::string& room, const std::string& guides,
                         const std::string& tool) {
  ClientOptions options;
  options.hello.station = station;
  options.hello.alike = station == TouchStation::kName;
  options.hello.room = room;
  options.hello.guides = guides;
  options.hello.tool = tool;
  options.refuses_guidance = true;  // a mouse cannot be moved
  options.hello.scheme = std::nullopt;
  return options;
}

}  // namespace

TouchStation::TouchStation(const std::string& server, const std::string& station, const std::string& room,
                           const std::optional<ClientKeys>& keys, const std::string& guides, const std::string& tool)
    : core_(options_of(station, room, guides, tool), monotonic_now()),
      udp_(
          server, core_, {},
          [this](const ClientCore& core, auto, auto) {
            if (pairs_.take(core, followed_.back())) followed_.publish();
          },
          keys) {
  tool_.station = station;
  udp_.start();
}

TouchStation::~TouchStation() {
  if (loop_) loop_->stop();
  udp_.stop();
}

void TouchStation::poll() {
  const ClientStatus status = udp_.status();
  if (status.link == LinkState::joined) tool_.station = status.welcome.station;
  if (!loop_ && status.link == LinkState::joined && status.clock_locked) {
    mouse_ = std::make_unique<MouseDevice>(status.welcome.home);
    tool_.position = status.welcome.home;
    loop_ = std::make_unique<HapticLoop>(*mouse_, std::vector<HapticTick*>{&core_.haptic()},
                                         HapticLoopOptions{.passivity = PassivityMode::off});
    loop_->start();
  }
  if (!mouse_) return;
  if (const MouseFeel* feel = mouse_->feel()) {
    tool_.position = feel->position;
    tool_.force = feel->force;
    tool_.contact = feel->force.norm() > kFeltN;
  }
}

const Foresight* TouchStation::foresight(Micros moment) {
  if (const PatchPair* pair = followed_.take()) foresights_.add(foresee(*pair));
  return foresights_.at(moment);
}

void TouchStation::aim(const Vec3& target) {
  if (mouse_) mouse_->aim(target);
}

void TouchStation::click() {
  if (mouse_) mouse_->click();
}

std::string TouchStation::refusal() const {
  const ClientStatus status = udp_.status();
  return status.link == LinkState::refused ? status.refusal : std::string();
}

std::string TouchStation::summary() {
  if (!loop_) return "the mouse touched nothing";
  loop_->stop();
  const HapticLoopStats& stats = loop_->stats();
  return fmt::format("the mouse: {} ticks, {} late by more than 0.2 ms, {} skipped, at most {:.2f} N", stats.ticks, stats.late,
                     stats.skipped, stats.force_max_n);
}

}  // namespace palpate
