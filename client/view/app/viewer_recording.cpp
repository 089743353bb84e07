#include "client/view/app/viewer_recording.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <ctime>

namespace palpate {
namespace {

Micros unix_now() { return std::chrono::duration_cast<Micros>(std::chrono::system_clock::now().time_since_epoch()); }

}  // namespace

ViewerRecording::ViewerRecording(const ViewCore& core, const std::string& file)
    : name_(file), recorder_(core, "palpate-view " PALPATE_VERSION, unix_now()), file_("--record", file, recorder_.bytes()) {}

ViewerRecording::~ViewerRecording() {
  recorder_.finish();
  file_.write(recorder_.bytes());
}

std::optional<std::string> ViewerRecording::pump(const ViewCore& core, Micros now) {
  if (recorder_.outlived(core)) return "the recording ended: the body is another one now";
  recorder_.take(core, now);
  if (now < next_write_) return std::nullopt;
  next_write_ = now + kWriteEvery;
  file_.write(recorder_.bytes());
  return file_.fault();
}

std::string file_for_now(const std::string& room) {
  return fmt::format("{}-{:%Y%m%d-%H%M%S}.rec", plain_name(room), fmt::localtime(std::time(nullptr)));
}

}  // namespace palpate
