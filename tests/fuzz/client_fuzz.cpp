// Arbitrary datagrams to a client in its server's name, at arbitrary times: it does not crash, its datagrams can be read, and the
// force stays finite and within the device's limit and slew limit.
//
// Each input is a run. A byte selects the next event: the hand moves on, the server lets the client in, sends a datagram of any
// kind, a timely patch, a damaged one, an earlier one again, or bytes of the script.
#include <array>
#include <cstdlib>

#include "client/core/client_core.hpp"
#include "tests/common/wire/seeds.hpp"
#include "tests/fuzz/script.hpp"

using namespace palpate;
using namespace std::chrono_literals;
using test::Script;

namespace {

constexpr double kForceMaxN = 8.5, kSlewMaxNS = 500, kRound = 1e-9;
constexpr std::size_t kKept = 64;

void require(bool condition) {
  if (!condition) std::abort();
}

ClientOptions options() {
  ClientOptions options;
  options.hello.station = "hand";
  options.guard = {.force_max_n = kForceMaxN, .slew_max_n_s = kSlewMaxNS, .passivity = PassivityMode::on};
  return options;
}

class Stage {
 public:
  /// Starts a client that has joined and felt a patch of this contact.
  void begin(ContactKind contact) {
    settle();
    say(Welcome{"cube", contact, 20, Vec3::Zero(), 0, 0, 0});
    for (int frame = 0; frame < 6 && force_.norm() == 0; ++frame) {
      say(Beat{.body_time = now_ - 50ms, .contact_in_reach = true});
      say(patch_of(contact == ContactKind::attach ? 0 : 1, ++seq_, 20ms));
      tick(Vec3(0, 0, -1e-5), 10);
    }
    require(core_.counts().patches_accepted > 0 && core_.haptic().counts().patches_used > 0 && force_.norm() > 0);
  }

  void act(Script& script) {
    const std::uint64_t what = script.number(1), how = what >> 4;
    switch (what & 15u) {
      case 0:
        return say(Welcome{"cube", how % 2 != 0 ? ContactKind::attach : ContactKind::touch, 20, Vec3::Zero(), 0, 0, 0});
      case 1:
        return say_kind(script);
      case 2:
      case 3:
        return say_patch(script, how);
      case 4:
        return say_terms(how);
      case 5:
        return deliver(damaged(written(kinds_[script.number(1) % kinds_.size()].body), script));
      case 6:
        return deliver(damaged(written(patch(script, how)), script));
      case 7:
        return replay(script);
      case 8:
        return raw(script);
      case 9:
        return say(Beat{.body_time = now_ - 50ms, .contact_in_reach = true, .renewed_from = seq_});
      case 10:
        return pass(Micros{static_cast<std::int64_t>(script.number(2)) * 50});
      default:
        return move(script, 1 + how);
    }
  }

 private:
  using Datagram = std::vector<std::byte>;

  Datagram written(const Payload& body) {
    Message message;
    message.instance = 0xfeedbeef;
    message.station = 7;
    message.seq = ++seq_out_;
    message.clock = {now_ + 1000s, heard_, Micros{500}};
    message.body = body;
    return seeds::bytes_of(message);
  }
  void say(const Payload& body) { deliver(written(body)); }
  void say_kind(Script& script) { say(kinds_[script.number(1) % kinds_.size()].body); }
  /// A timely patch of the client's kind of contact or the other.
  Payload patch(Script& script, std::uint64_t how) {
    return patch_of(script.number(1), how == 15 ? seq_ + 0x7fffffffu : ++seq_, Micros{10'000} * static_cast<int>(how));
  }
  Payload patch_of(std::size_t which, std::uint32_t seq, Micros age) {
    static const std::array<Patch, 4> patches{seeds::attach_patch(11), seeds::touch_patch(8, 12, 16), seeds::touch_patch(0, 7, 6),
                                              seeds::shared_patch(8, 7, 6, 3)};
    Patch patch = patches[which % patches.size()];
    patch.seq = seq;
    patch.stamp = now_ - age;
    patch.tool = at_ + Vec3(0, 0, 0.001);
    return PatchMessage{patch};
  }
  void say_patch(Script& script, std::uint64_t how) { say(patch(script, how)); }
  void say_terms(std::uint64_t how) {
    for (const PatchTerms& piece : to_pieces(how % 2 != 0 ? spring_terms_ : solid_terms_, seq_)) say(piece);
  }
  Datagram damaged(Datagram datagram, Script& script) {
    script.damage(std::span(datagram));
    return datagram;
  }
  void replay(Script& script) {
    if (!said_.empty()) deliver(said_[script.number(1) % said_.size()]);
  }
  void raw(Script& script) {
    const auto bytes = std::as_bytes(script.bytes(script.number(2) % 1400));
    deliver({bytes.begin(), bytes.end()});
  }
  void deliver(Datagram datagram) {
    core_.take(datagram, now_);
    if (said_.size() < kKept) said_.push_back(std::move(datagram));
    settle();
  }

  void pass(Micros time) {
    now_ += time;
    settle();
  }
  /// Moves for `ticks` ticks towards a nearby place.
  void move(Script& script, std::uint64_t ticks) {
    tick(1e-5 * Vec3(static_cast<double>(script.number(1)) - 128, 0, static_cast<double>(script.number(1)) - 128), ticks);
  }
  void tick(const Vec3& step, std::uint64_t ticks) {
    for (; ticks > 0; --ticks) {
      now_ += kTick;
      at_ += step;
      if (seconds(now_ - ticked_) > Guard::kGapMaxS) force_ = Vec3::Zero();  // the force restarts after such a gap
      ticked_ = now_;
      const TickOutput out = core_.haptic().tick({now_, at_});
      require(out.force.allFinite() && out.force.norm() <= kForceMaxN + kRound);
      require((out.force - force_).norm() <= kSlewMaxNS * 1e-3 + kRound);
      force_ = out.force;
    }
    settle();
  }
  void settle() {
    core_.tick(now_);
    std::array<std::byte, kMaxDatagramBytes> bytes;
    for (int n = 0; const std::size_t size = core_.emit(bytes, now_); ++n) {
      Message message;
      require(n < 1000 && decode(std::span(bytes).first(size), message) == WireFault::none);
      heard_ = message.clock.sent;
    }
  }

  static const std::vector<Message> kinds_;
  static const NonlinearTerms spring_terms_, solid_terms_;
  Micros now_{1'000'000'000}, heard_{}, ticked_ = now_;
  ClientCore core_{options(), now_};
  Vec3 at_ = Vec3(0.0512, -0.0312, 0.101), force_ = Vec3::Zero();
  std::uint32_t seq_ = 0, seq_out_ = 0;
  std::vector<Datagram> said_;
};

const std::vector<Message> Stage::kinds_ = seeds::every_kind();
const NonlinearTerms Stage::spring_terms_ = seeds::spring_terms(8, false, 60, 40),
                     Stage::solid_terms_ = seeds::solid_terms(11, true, 9, 8);

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Stage stage;
  Script script(data, size);
  if (const auto how = script.number(1); how % 4 != 0) stage.begin(how % 2 != 0 ? ContactKind::attach : ContactKind::touch);
  while (!script.ended()) stage.act(script);
  return 0;
}
