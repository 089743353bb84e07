#include "client/device/inverse3/inverse3_session.hpp"

#include <utility>

namespace palpate {

namespace {

constexpr const char* kNoAnswer = "its service has not answered for 20 ms";
constexpr const char* kSlowAnswer = "its service takes more than 20 ms to answer";
constexpr const char* kNoState = "its service sends what is no state of devices";
constexpr const char* kUnlisted = "its service does not list it: is it plugged in and switched on?";

}  // namespace

Inverse3Session::Inverse3Session(std::string id, Inverse3Format format, DriverExchange& exchange, ExchangeCounter& counter,
                                 Micros now)
    : id_(std::move(id)),
      format_(format),
      exchange_(exchange),
      counter_(counter),
      gate_(kTurnHz, kVelocityMaxMS),
      fresh_at_(now),
      fault_(kNoAnswer) {}

void Inverse3Session::receive(std::string_view message, Micros now) {
  const bool asked = unanswered_ > 0;
  const Micros trip = asked ? now - sent_[0] : Micros{};
  if (asked) {
    sent_[0] = sent_[1];
    --unanswered_;
  }
  const Inverse3State state = read_inverse3_state(message, id_);
  if (state.kind == Inverse3State::Kind::malformed)
    fault_ = kNoState;
  else if (state.kind == Inverse3State::Kind::unlisted)
    fault_ = kUnlisted;
  else if (trip > kAnswerMost)
    fault_ = kSlowAnswer;
  else
    fault_ = nullptr;
  if (fault_) return;
  newest_ = state;
  fresh_at_ = now;
  fault_ = kNoAnswer;
  if (asked) counter_.add(trip);
}

DeviceReading Inverse3Session::measure(Micros now) noexcept {
  if (silent(now)) {
    gate_.refuse(fault_);
    return not_ok(DeviceState::gone, fault_);
  }
  if (newest_.kind != Inverse3State::Kind::listed || now < settled_at_) return not_ok(DeviceState::not_ready, "it starts");
  if (!newest_.calibrated)
    return not_ok(DeviceState::not_ready, "it is not calibrated: leave its handle in the inkwell until its light is steady");
  DeviceReading reading;
  reading.state = DeviceState::ok;
  reading.position = newest_.position;
  if (reading.position.allFinite() && reading.position.cwiseAbs().maxCoeff() > kFarthestM)
    gate_.refuse("its service reports a position out of its reach");
  return reading;
}

void Inverse3Session::turn(Micros now) { force_ = exchange_.turn(gate_.pass(measure(now))).force; }

std::optional<std::string> Inverse3Session::command(Micros now) {
  const bool unasked = silent(now) && unanswered_ == 1;
  if (unanswered_ > 0 && !unasked) return std::nullopt;
  if (first_) settled_at_ = now + kSettle;
  sent_[unanswered_++] = now;
  return inverse3_command(format_, id_, force_, std::exchange(first_, false));
}

std::string Inverse3Session::last_command() const { return inverse3_command(format_, id_, Vec3::Zero(), false); }

}  // namespace palpate
