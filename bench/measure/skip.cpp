#include "bench/measure/skip.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "bench/measure/gestures.hpp"
#include "client/core/client_core.hpp"
#include "server/core/server_rooms.hpp"
#include "server/room/deadband.hpp"

namespace palpate {
namespace {

constexpr Micros kBegin{1'000'000};
constexpr double kSkipDeepM = 0.006, kRestS = 2, kWayS = 1;

/// A viewer that joins, regularly acknowledges everything, and ignores the content.
class Onlooker {
 public:
  explicit Onlooker(const std::string& room) {
    Hello hello;
    hello.station = "onlooker";
    hello.role = Role::viewer;
    hello.room = room;
    says_.body = hello;
  }
  bool due(Micros now) const { return now >= next_; }
  std::size_t emit(std::span<std::byte> out, Micros now) {
    next_ = now + Micros{50'000};
    says_.clock = {};
    const std::size_t size = encode(says_, out);
    ++says_.seq;
    return size;
  }
  void take(std::span<const std::byte> bytes) {
    Message message;
    if (decode(bytes, message) != WireFault::none) return;
    says_.instance = message.instance;
    says_.station = message.station;
    ViewState view;
    view.newest = message.seq;
    view.have = ~std::uint64_t{0};
    says_.body = view;
  }

 private:
  Message says_;
  Micros next_{};
};

class Server {
 public:
  Server(std::span<const SkipRoom> rooms, const Stopwatch& stopwatch, double deadband)
      : rooms_(rooms), stopwatch_(stopwatch), cores_(specs(rooms), repeatable(1), kSkipRateHz, deadband) {
    for (std::size_t k = 0; k < rooms.size(); ++k) {
      bodies_.emplace_back(*rooms[k].scene);
      bodies_.back().start(kBegin);
      hands_.emplace_back();
      onlookers_.emplace_back(cores_.name(k));
      if (!rooms[k].hand) continue;
      ClientOptions options;
      options.hello.station = "hand";
      options.hello.room = cores_.name(k);
      hands_.back() = std::make_unique<ClientCore>(options, kBegin);
      cost.felt.emplace_back();
    }
  }

  void tick(Micros now) {
    std::vector<std::pair<PeerId, std::vector<std::byte>>> up, down;
    std::array<std::byte, kMaxDatagramBytes> bytes;
    for (std::size_t k = 0, felt = 0; k < rooms_.size(); ++k) {
      if (rooms_[k].viewer && onlookers_[k].due(now))
        up.push_back({2 * k + 1, {bytes.begin(), bytes.begin() + onlookers_[k].emit(bytes, now)}});
      if (!hands_[k]) continue;
      cost.felt[felt++].push_back(hands_[k]->haptic().tick({now, rooms_[k].hand->position(now - kBegin)}).force);
      hands_[k]->tick(now);
      while (const auto size = hands_[k]->emit(bytes, now)) up.push_back({2 * k, {bytes.begin(), bytes.begin() + size}});
    }
    if (up.empty() && cores_.deadline() > now) return;
    ++wake_ups;
    const std::int64_t begin = stopwatch_();
    for (const auto& [from, datagram] : up) cores_.take(datagram, from, now);
    cores_.tick(now);
    for (std::size_t k = 0; k < rooms_.size(); ++k) frame(k, now);
    PeerId to = 0;
    while (const auto size = cores_.emit(bytes, to, now)) down.push_back({to, {bytes.begin(), bytes.begin() + size}});
    busy_ns += stopwatch_() - begin;
    for (const auto& [whom, datagram] : down) {
      sent_bytes += datagram.size();
      whom % 2 == 0 ? hands_[whom / 2]->take(datagram, now) : onlookers_[whom / 2].take(datagram);
    }
  }

  SkipCost cost;
  std::int64_t busy_ns = 0;
  std::uint64_t wake_ups = 0, frames = 0, stepped = 0, patches = 0, sent_bytes = 0;

 private:
  static std::vector<ServerRooms::RoomSpec> specs(std::span<const SkipRoom> rooms) {
    std::vector<ServerRooms::RoomSpec> specs;
    for (std::size_t k = 0; k < rooms.size(); ++k)
      specs.push_back({"room " + std::to_string(k + 1), facts_of(*rooms[k].scene, home_of(*rooms[k].scene))});
    return specs;
  }

  void frame(std::size_t k, Micros now) {
    auto job = cores_[k].next_job(now);
    if (!job) return;
    job->may_sleep = rooms_[k].may_sleep;
    FrameResult result = bodies_[k].run(*job);
    if (result.failed) throw std::runtime_error("skip: a frame did not converge");
    ++frames;
    stepped += result.steps > 0;
    for (const StationFrame& station : result.stations) patches += station.patch.has_value() && !station.renewed_from;
    cores_[k].finish(std::move(result), now);
  }

  std::span<const SkipRoom> rooms_;
  const Stopwatch& stopwatch_;
  ServerRooms cores_;
  std::vector<Room> bodies_;
  std::vector<std::unique_ptr<ClientCore>> hands_;
  std::vector<Onlooker> onlookers_;
};

Vec3 trembling(double t_s) {
  constexpr double kTrembleM = 2e-4, kTrembleHz = 8;
  return kTrembleM * std::sin(2 * std::numbers::pi * kTrembleHz * t_s) * Vec3::UnitX();
}

Vec3 resting_place(const Scene& scene) { return plan_gesture(scene, Gesture::tap, kSkipDeepM).intention.position(0.0); }

}  // namespace

SkipCost serve(std::span<const SkipRoom> rooms, double duration_s, const Stopwatch& stopwatch, double deadband) {
  Server server(rooms, stopwatch, deadband);
  for (Micros t = kBegin; t <= kBegin + from_seconds(duration_s); t += kTick) server.tick(t);
  SkipCost cost = std::move(server.cost);
  const auto a_second = [&](auto count) { return static_cast<double>(count) / duration_s; };
  cost.busy_ms_s = 1e-6 * a_second(server.busy_ns);
  cost.wake_ups_s = a_second(server.wake_ups);
  cost.frames_s = a_second(server.frames);
  cost.stepped_s = a_second(server.stepped);
  cost.patches_s = a_second(server.patches);
  cost.bytes_s = a_second(server.sent_bytes);
  return cost;
}

double felt_difference_n(const SkipCost& a, const SkipCost& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.felt.size(); ++k)
    for (std::size_t i = 0; i < a.felt[k].size(); ++i) most = std::max(most, (a.felt[k][i] - b.felt[k][i]).norm());
  return most;
}

double felt_difference_share(const SkipCost& a, const SkipCost& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.felt.size(); ++k)
    for (std::size_t i = 0; i < a.felt[k].size(); ++i)
      most = std::max(most, (a.felt[k][i] - b.felt[k][i]).norm() / std::max(b.felt[k][i].norm(), Deadband::kForceLeastN));
  return most;
}

Motion visit(const Scene& scene) {
  if (scene.tool.contact == ContactKind::attach) return plan_gesture(scene, Gesture::press, kSkipDeepM).intention;
  const Motion taps = plan_gesture(scene, Gesture::tap, kSkipDeepM).intention;
  const Vec3 up = -kAwayM * into_body(scene);
  const double from_s = kRestS + kWayS, to_s = from_s + taps.duration_s();
  std::vector<MotionPoint> points;
  for (int ms = 0; ms <= static_cast<int>(1e3 * kVisitS); ++ms) {
    const double t = 1e-3 * ms;
    const double away = t < from_s ? 1 - minimum_jerk(std::max(0.0, t - kRestS) / kWayS) : minimum_jerk((t - to_s) / kWayS);
    points.push_back({t, taps.position(t - from_s) + away * up});
  }
  return Motion(std::move(points), "visit");
}

Motion wait_above(const Scene& scene, double above_m) {
  return Motion::rest(resting_place(scene) - above_m * into_body(scene), kVisitS);
}

Motion hold_pressed(const Scene& scene) {
  const Vec3 into = into_body(scene), place = resting_place(scene);
  std::vector<MotionPoint> points;
  for (int ms = 0; ms <= static_cast<int>(1e3 * kVisitS); ++ms) {
    const double t = 1e-3 * ms;
    const double pressed = minimum_jerk(t / kWayS) - minimum_jerk((t - (kVisitS - kWayS)) / kWayS);
    points.push_back({t, place + kSkipDeepM * pressed * into + trembling(t)});
  }
  return Motion(std::move(points), "hold");
}

Motion linger(const Scene& scene) {
  constexpr double kAboveM = 0.002, kIntoM = 0.003, kEveryS = 3, kDipS = 0.6, kPi = std::numbers::pi;
  const Vec3 into = into_body(scene), place = resting_place(scene) - (kAboveM - kGapM) * into;
  std::vector<MotionPoint> points;
  for (int ms = 0; ms <= static_cast<int>(1e3 * kVisitS); ++ms) {
    const double t = 1e-3 * ms, since_s = std::fmod(t, kEveryS) - (kEveryS - kDipS);
    const double dip = since_s > 0 ? std::pow(std::sin(kPi * since_s / kDipS), 2) : 0;
    points.push_back({t, place + (kAboveM + kIntoM) * dip * into + trembling(t)});
  }
  return Motion(std::move(points), "linger");
}

}  // namespace palpate
