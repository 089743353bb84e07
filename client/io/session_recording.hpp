// The recording of a station in real time: fed by the network thread (datagrams) and the main thread (ticks out of the recorder's
// ring, the state of the session), written by a thread of its own. The haptic thread knows nothing of it.
#pragma once

#include <mutex>

#include "client/io/recorder.hpp"
#include "client/io/udp_client.hpp"
#include "client/record/station_recorder.hpp"
#include "common/io/record_file.hpp"

namespace palpate {

class SessionRecording {
 public:
  /// InputError when `file` cannot be made.
  SessionRecording(const std::filesystem::path& file, const std::string& program, const std::string& station);

  /// Any thread but the haptic one.
  void datagram(const ClientCore& core, std::span<const std::byte> bytes, Micros now);
  void tick(const TickRecord& tick, const DisplayRecord& felt);
  void event(Micros t, RecordedEventKind kind, const std::string& text = {});
  /// Several times a second. Why nothing is recorded any more, once.
  std::optional<std::string> look(const ClientStatus& status, Micros now);
  /// Whole and closed. Nothing is added afterwards.
  void finish();

 private:
  std::mutex mutex_;
  StationRecorder recorder_;
  RecordFile file_;
};

}  // namespace palpate
