#include "client/app/lines.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdint>

#include "client/io/device_check.hpp"
#include "common/base/counted.hpp"
#include "common/io/line_writer.hpp"

namespace palpate {
namespace {

thread_local std::string speaker;

void put(LineWriter& out, const std::string& lines) {
  std::string text = speaker;
  for (const char c : lines) {
    text += c;
    if (c == '\n') text += speaker;
  }
  text += '\n';
  out.write(text);
}

std::string lines_left_out(std::uint64_t lines) {
  return fmt::format("palpate-client: dropped {} here, because nobody read\n", counted(lines, "line"));
}

}  // namespace

void speak_as(const std::string& hand) { speaker = hand + ": "; }

void say(const std::string& lines) {
  static LineWriter out(STDOUT_FILENO, lines_left_out);
  put(out, lines);
}

void complain(const std::string& lines) {
  static LineWriter out(STDERR_FILENO, lines_left_out);
  put(out, "palpate-client: " + lines);
}

std::string not_ready(const Device& device, const DeviceReading& reading, Micros waited) {
  const std::string& model = device.caps().model;
  return fmt::format("the device{} is not ready{}: {}", model.empty() ? "" : " (" + model + ")",
                     waited < kRemindEvery ? "" : fmt::format(" after {:.0f} s", seconds(waited)), reading.reason.text());
}

std::string guidance_text(const GuidanceStatus& guidance, bool held) {
  const std::string& name = guidance.partner;
  if (guidance.own == GuidanceHand::released)
    return fmt::format("this hand broke away from {}; 1 s within 10 mm of its tool joins the two again", name);
  switch (guidance.other) {
    case GuidanceHand::ready:
    case GuidanceHand::holds:
      if (!guidance.held())
        return held ? fmt::format("guidance with {} pauses", name)
                    : fmt::format("guidance with {} begins when both links are measured", name);
      return guidance.guides ? "this hand guides " + name
                             : name + " guides this hand; pulling away for 1 s with more than 3 N ends it";
    case GuidanceHand::released:
      return name + " broke away";
    case GuidanceHand::refuses:
      return name + " refuses guidance";
    case GuidanceHand::busy:
      return name + " is guided by another station, or guides one itself";
    case GuidanceHand::absent:
      return name + " is not in the room; guidance begins when it is";
  }
  return "";
}

std::string release_text(bool released, ContactKind contact) {
  const bool touches = contact == ContactKind::touch;
  if (!released) return touches ? "the tool may touch again" : "the tool may grasp again";
  return std::string("the server released the tool, because it cost the body more than a hand does: the force fades to zero; ") +
         (touches ? "after 1 s the tool may touch again, from outside" : "after 1 s the tool may grasp again");
}

std::string describe(const DeviceNote& note) {
  const std::string reason(note.reason.text());
  switch (note.state) {
    case DeviceState::ok:
      return "the device is ok: the force returns";
    case DeviceState::not_ready:
      return "the device is not ready: " + reason;
    case DeviceState::fault:
      return "no force from the device: " + reason;
    case DeviceState::gone:
      return "no force, waiting for the device: " + reason;
    case DeviceState::ended:
      break;
  }
  return "the motion has ended";
}

}  // namespace palpate
