#include "server/core/server_core.hpp"

#include <numeric>
#include <utility>

namespace palpate {

std::uint64_t ServerCounts::dropped_all() const { return std::accumulate(dropped.begin(), dropped.end(), std::uint64_t{0}); }

ServerCore::ServerCore(RoomFacts facts, const ServerOptions& options)
    : facts_(std::move(facts)), options_(options), shapes_(facts_, options.rate_hz) {
  pace_.rate_hz = options.rate_hz;
}

void ServerCore::tick(Micros now) {
  if (!started_) {
    started_ = true;
    first_tick_ = body_time_ = now;
  }
  drop_silent(now);
  if (is_idle()) return;
  const std::uint64_t before = next_frame_;
  for (; due(next_frame_) <= now; ++next_frame_) {
    const bool skipped = job_out_ && owed_;
    note_due(skipped);
    counts_.frames_busy += skipped;
    owed_ = true;
  }
  if (job_out_ && next_frame_ > before) return beat_all();
  if (job_out_ || !owed_) return;
  owed_ = false;
  const auto target = playout(now);
  if (target < body_time_ + kLeastFrame) {
    ++counts_.frames_waiting;
    job_.reset();
    return beat_all();
  }
  lag_ = now - target;
  choose_detail(now);
  job_ = make_job(target);
}

Micros ServerCore::deadline() const {
  if (!started_) return Micros{};
  if (is_idle()) return Micros::max();
  if (owed_ && !job_out_) return Micros{};
  auto earliest = due(next_frame_);
  for (const auto& [id, station] : stations_) earliest = std::min(earliest, station.heard + kGoneAfter);
  return earliest;
}

void ServerCore::shut_down() {
  for (const auto& [id, station] : stations_) {
    if (!station.proven) continue;
    Message question;
    question.station = id;
    refuse(question, station.peer, {RefuseReason::shutting_down, "the server is shutting down"}, kMaxDatagramBytes);
  }
  stations_.clear();
  job_.reset();
}

Orientation ServerCore::orientation(StationId id) const {
  const auto station = stations_.find(id);
  return station != stations_.end() ? station->second.orientation : Orientation();
}

std::vector<StationReport> ServerCore::stations() const {
  std::vector<StationReport> reports;
  for (const auto& [id, s] : stations_)
    reports.push_back({id, s.hello.station, s.hello.role, s.in_use.scheme, s.hello.shadow_of, s.clock.rtt(), s.clock.offset(),
                       s.clock.drift_ppm(), s.seq.counts(), horizon(s), s.patch_age, s.counts});
  return reports;
}

}  // namespace palpate
