#include "common/link/link_model.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/base/error.hpp"

namespace palpate {
namespace {

constexpr Micros kMaxLatency{60'000'000};

void expect(bool good, std::string_view where, const char* what, double value, const char* expected) {
  if (!good) throw InputError(std::string(where), std::string(what) + " is " + std::to_string(value), expected);
}

void expect_share(double value, std::string_view where, const char* what) {
  expect(value >= 0 && value <= 1, where, what, value, "a share from 0 to 1");
}

}  // namespace

void validate(const LinkSpec& spec, std::string_view where) {
  const auto good_time = [](Micros t) { return t.count() >= 0 && t <= kMaxLatency; };
  expect(good_time(spec.latency), where, "latency [s]", seconds(spec.latency), "0 to 60 s");
  expect(good_time(spec.jitter), where, "jitter [s]", seconds(spec.jitter), "0 to 60 s");
  expect_share(spec.loss, where, "loss");
  expect_share(spec.duplicate, where, "duplicate");
  expect_share(spec.reorder, where, "reorder");
  expect(spec.burst_mean >= 0 && std::isfinite(spec.burst_mean), where, "mean burst", spec.burst_mean, "0 or more datagrams");
  expect(spec.kbit_s >= 0 && std::isfinite(spec.kbit_s), where, "bandwidth [kbit/s]", spec.kbit_s, "0 (unlimited) or more");
}

LinkModel::LinkModel(const LinkSpec& spec) : random_(spec.seed) {
  change(spec);
  bad_ = random_.chance(spec.loss);
}

void LinkModel::change(const LinkSpec& spec) {
  validate(spec, "link");
  spec_ = spec;
  if (spec.loss <= 0) bad_ = false;  // a repaired link does not complete its burst
  if (spec.loss >= 1) {
    into_bad_ = 1;
    out_of_bad_ = 0;
    return;
  }
  // The share of time in the bad state is into / (into + out), the mean duration of it 1 / out. As burst >= 1 / (1 - loss), into
  // <= 1.
  const double burst = std::max(spec.burst_mean, 1 / (1 - spec.loss));
  out_of_bad_ = 1 / burst;
  into_bad_ = spec.loss / (burst * (1 - spec.loss));
}

bool LinkModel::loses() {
  bad_ = bad_ ? !random_.chance(out_of_bad_) : random_.chance(into_bad_);
  return bad_;
}

/// Returns the moment at which the last bit has entered the wire, after everything sent before it.
Micros LinkModel::serialise(Micros now, std::size_t bytes) {
  if (spec_.kbit_s <= 0) return now;
  const double start_us = std::max(wire_free_us_, static_cast<double>(now.count()));
  wire_free_us_ = start_us + static_cast<double>(bytes + kHeaderBytes) * 8e3 / spec_.kbit_s;
  return Micros{static_cast<std::int64_t>(std::ceil(wire_free_us_))};
}

Deliveries LinkModel::schedule(Micros now, std::size_t bytes) {
  const bool lost = loses();
  const double spread = random_.uniform(-1, 1);
  const bool steps_out = random_.chance(spec_.reorder);
  const double hold = 1 - random_.uniform();
  const bool twice = random_.chance(spec_.duplicate);
  ++counts_.sent;
  counts_.bytes += bytes;
  if (spec_.kbit_s > 0 && wire_free_us_ - static_cast<double>(now.count()) > static_cast<double>(kMaxBacklog.count())) {
    ++counts_.queue_dropped;
    return {};
  }
  const Micros away = serialise(now, bytes);
  if (lost) {
    ++counts_.lost;
    return {};
  }
  const auto jitter = static_cast<std::int64_t>(std::round(spread * static_cast<double>(spec_.jitter.count())));
  Micros arrival = std::max(away, away + spec_.latency + Micros{jitter});
  arrival = std::max(arrival, last_arrival_);
  if (steps_out) {
    ++counts_.reordered;
    arrival += Micros{static_cast<std::int64_t>(std::ceil(hold * static_cast<double>(kReorderHold.count())))};
  } else {
    last_arrival_ = arrival;
  }
  counts_.duplicated += twice ? 1 : 0;
  return {{arrival, arrival}, twice ? 2 : 1};
}

}  // namespace palpate
