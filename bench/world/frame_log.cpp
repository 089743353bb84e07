#include "bench/world/frame_log.hpp"

#include "bench/world/hash.hpp"

namespace palpate {
namespace {

void add(Hash& hash, Micros t) { hash.add(static_cast<std::uint64_t>(t.count())); }

void add(Hash& hash, const StationJob& job) {
  // Structured binding, so that a new member does not compile until it is added here.
  const auto& [id, scheme, order, shadow_of, horizon, samples, silence, deadband, playing, wants_patch, needle, presses, held] =
      job;
  hash.add(id);
  hash.add(static_cast<std::uint64_t>(scheme));
  hash.add(static_cast<std::uint64_t>(order));
  hash.add(shadow_of);
  add(hash, horizon);
  hash.add(samples.size());
  for (const ToolSample& sample : samples) {
    add(hash, sample.t);
    hash.add(sample.position);
  }
  add(hash, silence);
  hash.add(std::bit_cast<std::uint64_t>(deadband));
  hash.add(playing ? 1u : 0u);
  add(hash, playing.value_or(Micros{}));
  hash.add(wants_patch ? 1u : 0u);
  if (presses > 0) hash.add(presses);
  if (held > 0) hash.add(held);
  if (!needle) return;
  for (const Vec3& x : needle->rest) hash.add(x);
  hash.add(needle->edge);
  for (const double depth_m : {needle->tip.depth_m, needle->tip.front_m}) hash.add(std::bit_cast<std::uint64_t>(depth_m));
}

}  // namespace

std::uint64_t hash_of(const FrameJob& job) {
  const auto& [begin, target, frame, stations, reset, rollouts, may_sleep, shapes, fields, state] = job;
  Hash hash;
  for (const Micros t : {begin, target, frame}) add(hash, t);
  hash.add(stations.size());
  for (const StationJob& station : stations) add(hash, station);
  for (const bool flag : {reset, rollouts, may_sleep, shapes, state}) hash.add(flag ? 1u : 0u);
  hash.add(std::uint64_t{fields});
  return hash.value();
}

FrameRunner FrameLog::recorder() {
  return [this](Room& room, const FrameJob& job) {
    frames_.push_back({hash_of(job), job, room.run(job)});
    return frames_.back().result;
  };
}

FrameRunner FrameLog::player() {
  taken_ = 0;
  apart_ = false;
  return [this](Room& room, const FrameJob& job) {
    if (!apart_ && taken_ < frames_.size() && frames_[taken_].hash == hash_of(job)) return frames_[taken_++].result;
    for (std::size_t k = 0; !apart_ && k < taken_; ++k) room.run(frames_[k].job);
    apart_ = true;
    return room.run(job);
  };
}

}  // namespace palpate
