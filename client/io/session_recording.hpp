// The recording of a station in real time: fed by the network thread (datagrams) and the main thread (ticks from the recorder's
// ring, state of the session), written by a thread of its own. The haptic thread is not involved.
#pragma once

#include <mutex>

#include "client/io/recorder.hpp"
#include "client/io/udp_client.hpp"
#include "client/record/station_recorder.hpp"
#include "common/io/record_file.hpp"

namespace palpate {

class SessionRecording {
 public:
  /// `tool`: name of the scene's tool that the station holds; empty: the first. Throws InputError when `file` cannot be created.
  SessionRecording(const std::filesystem::path& file, const std::string& program, const std::string& station,
                   const std::string& tool);

  /// any thread but the haptic one
  void datagram(const ClientCore& core, std::span<const std::byte> bytes, Micros now);
  void tick(const TickRecord& tick, const DisplayRecord& felt);
  void event(Micros t, RecordedEventKind kind, const std::string& text = {});
  /// Call several times a second. Returns the reason when the recording has failed, once.
  std::optional<std::string> look(const ClientStatus& status, Micros now);
  /// Completes and closes the file. Nothing is added afterwards.
  void finish();

 private:
  std::mutex mutex_;
  StationRecorder recorder_;
  RecordFile file_;
};

}  // namespace palpate
