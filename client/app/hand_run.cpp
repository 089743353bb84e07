#include "client/app/hand_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "client/app/lines.hpp"
#include "client/app/pausing.hpp"
#include "client/app/report.hpp"
#include "client/app/station.hpp"
#include "client/device/hardware/open_device.hpp"
#include "client/io/device_check.hpp"
#include "client/io/device_limits.hpp"
#include "client/io/haptic_loop.hpp"
#include "client/io/session_recording.hpp"
#include "client/mapping/mapped_device.hpp"
#include "common/base/error.hpp"
#include "common/base/grasp_reach.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

constexpr Micros kVersionMost{3'000'000};     ///< time for which a server may seem to speak another version
constexpr Micros kSettle{300'000};            ///< after joining, time for the clocks to lock before the hand moves
constexpr Micros kComparisonWait{5'000'000};  ///< for the first patch of a comparison
constexpr Micros kUntilStart{60'000};         ///< from the decision to start the motion until it starts: three polls
constexpr double kReportedMaxS = 600;         ///< for a run without an end, or a hand that holds still after its motion
constexpr std::size_t kRingTicks = 4096;      ///< ticks that may wait between two polls
constexpr double kStartMaxM = 5e-4;           ///< attach: the motion should start where the node rests

class Run {
 public:
  Run(const AppOptions& options, CommonStart& start, const std::atomic<bool>& stop)
      : options_(options), start_(start), stop_(stop), began_(monotonic_now()) {
    UdpClient::Watch watch;
    if (!options.record.empty()) {
      recording_ =
          std::make_unique<SessionRecording>(options.record, "palpate-client " PALPATE_VERSION, options.station, options.tool);
      watch = [this](const ClientCore& core, auto bytes, Micros now) { recording_->datagram(core, bytes, now); };
    }
    if (options.held) {
      hardware_ = open_hardware(options.device_name, realtime_setup(options.realtime));
      limits_of(hardware_->caps(), options.passivity);  // refused before joining
    }
    stations_.push_back(std::make_unique<ClientStation>(options, options.scheme, "", std::move(watch)));
  }

  /// Runs the hand and returns the program's exit code.
  int go() {
    say(fmt::format("joining {} as {} ({})", options_.server, options_.station, name_of(options_.scheme)));
    const bool joined = join();
    if (joined) feel();
    arrive();
    for (auto& station : stations_) station->stop();
    end_recording();
    if (refused_for_good_ && !loop_) return 1;
    try {
      report();
    } catch (const InputError& fault) {
      if (!stuck()) throw;
      complain(fault.what());
    }
    const bool never_there = !joined && !stop_ && !refused_for_good_;
    const bool refused = felt().status().link == LinkState::refused;
    if (never_there) complain(refused ? options_.server + ": the server refused every attempt to join" : no_answer());
    return never_there || refused_for_good_ || failed_ ? 1 : 0;
  }
  /// After go(): true when the device hangs in a call, in which case destroying this object would wait for it.
  bool stuck() const { return loop_ && loop_->stuck(); }

 private:
  ClientStation& felt() { return *stations_.front(); }
  bool over() const { return stop_ || (options_.duration_s && monotonic_now() - began_ >= from_seconds(*options_.duration_s)); }

  /// Polls until `done` returns true; false when the run is over first.
  bool wait(const std::function<bool()>& done) {
    while (!done()) {
      if (over() || refused_for_good_ || failed_) return false;
      look_around();
      std::this_thread::sleep_for(kPoll);
    }
    return true;
  }

  /// Stores the ticks and continues the recording.
  void look_around() {
    look_at_device();
    if (const std::string fault = felt().status().fault; !fault.empty() && !std::exchange(failed_, true))
      complain("the session with the server ended by an error: " + fault);
    if (pause_asked()) pause(loop_.get());
    TickRecord tick;
    while (loop_ && loop_->recorder().take(tick, row_)) {
      if (recording_) recording_->tick(tick, row_.front());
      if (!log_ || tick.t < motion_start_) continue;
      tick.t -= motion_start_;
      log_->add(tick, row_);
    }
    if (!recording_) return;
    if (const auto fault = recording_->look(felt().status(), monotonic_now())) say("warning: " + *fault);
  }

  void look_at_device() {
    if (!loop_) return;
    if (const DeviceNote* const note = loop_->changed()) say(describe(*note));
    if (const auto halts = loop_->halts(); halts != std::exchange(halts_said_, halts))
      say(fmt::format("no force: the loop stood still for more than {} ms", Watchdog::kMost.count() / 1000));
  }

  void end_recording() {
    look_around();
    if (!recording_) return;
    if (loop_ && loop_->recorder().missed() > 0)
      recording_->event(monotonic_now(), RecordedEventKind::left_out, fmt::format("{} ticks", loop_->recorder().missed()));
    recording_->finish();
  }

  std::string no_answer() { return no_answer_text(options_.server, felt().status().nobody_listens, options_.keys.has_value()); }

  bool join() {
    felt().start();
    bool said = false;
    const bool joined = wait([&] {
      const LinkState link = felt().status().link;
      if (link == LinkState::joined) return true;
      say_refusals();
      if (!said && link == LinkState::joining && monotonic_now() - began_ > kNoAnswerAfter) {
        say(no_answer() + "; the force is zero, and the client keeps trying");
        said = true;
      }
      return false;
    });
    if (!joined) return false;
    const Welcome welcome = felt().status().welcome;
    name_ = welcome.station;
    say(fmt::format("joined scene {}{}: {}, {:g} frames a second", welcome.scene, name_ != options_.station ? " as " + name_ : "",
                    welcome.contact == ContactKind::attach ? "attach" : "touch", welcome.rate_hz));
    for (const Scheme scheme : options_.compare) {
      stations_.push_back(std::make_unique<ClientStation>(options_, scheme, name_));
      stations_.back()->start();
    }
    return true;
  }

  void feel() {
    const Welcome welcome = felt().status().welcome;
    if (hardware_ ? !take_up(welcome) : (prepare_device(welcome), false)) return;
    std::vector<HapticTick*> displays;
    for (auto& station : stations_) displays.push_back(&station->core().haptic());
    row_.resize(displays.size());
    if (!options_.report.empty()) log_ = std::make_unique<TickLog>(reported_ticks(), displays.size());
    loop_ = std::make_unique<HapticLoop>(felt_device(), displays,
                                         HapticLoopOptions{options_.realtime, ring_ticks(), options_.passivity});
    realtime_ = loop_->start();
    if (realtime_.asked) say(describe(realtime_));
    if (wait_until_felt(welcome) && wait_for_others()) move();
    loop_->stop();
  }

  /// Returns the device as seen from the scene.
  Device& felt_device() { return mapped_ ? static_cast<Device&>(*mapped_) : *device_; }

  void map(Device& device, const Welcome& welcome) {
    const SceneSpot spot{welcome.home, welcome.contact == ContactKind::attach};
    mapped_ = std::make_unique<MappedDevice>(device, *options_.workspace, spot, options_.workspace_place);
  }

  /// Opens the device that a hand holds and waits until it is ready. Returns false when the run is over first.
  bool take_up(const Welcome& welcome) {
    constexpr Micros kEver = Micros::max();
    say(fmt::format("device {}: {}", options_.device_name, hardware_->caps().model));
    const auto says = [this](const DeviceReading& reading, Micros waited) { say(not_ready(*hardware_, reading, waited)); };
    if (!wait_until_ready(*hardware_, kEver, stop_, says)) return false;
    map(*hardware_, welcome);
    mapped_->wait_for_start();
    return true;
  }

  /// Returns the intended motion. Without one the hand holds still at the scene's home.
  Motion intention(const Welcome& welcome) const {
    if (options_.motion) return *options_.motion;
    const bool mapped = options_.workspace.has_value();
    return Motion::rest(mapped ? options_.workspace->centre_m.value_or(Vec3::Zero()) : welcome.home, 1.0);
  }

  void prepare_device(const Welcome& welcome) {
    const Motion motion = intention(welcome);
    DeviceOptions device{options_.device, options_.hand, options_.seed};
    if (options_.release_s) device.release_s = *options_.release_s;
    device.stays_at_end = options_.duration_s.has_value();
    device_ = make_device(motion, device);
    if (options_.workspace) map(*device_, welcome);
    check_start(welcome, mapped_ ? mapped_->place(motion.position(0.0)) : motion.position(0.0));
  }

  void check_start(const Welcome& welcome, const Vec3& start) const {
    const double off_m = (start - welcome.home).norm();
    const auto in_mm = [](const Vec3& at) {
      return fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", 1e3 * at.x(), 1e3 * at.y(), 1e3 * at.z());
    };
    if (welcome.contact == ContactKind::attach && off_m > kGraspReachM)
      throw InputError("--motion " + options_.motion_file.string(),
                       fmt::format("starts at {}, {:.0f} mm from the node that it should grasp", in_mm(start), 1e3 * off_m),
                       fmt::format("a start within {:.0f} mm of {}", 1e3 * kGraspReachM, in_mm(welcome.home)));
    if (welcome.contact == ContactKind::attach && off_m > kStartMaxM)
      say(fmt::format("warning: the motion starts {:.1f} mm from where the attached node rests; the node will be pulled there",
                      off_m * 1e3));
  }

  std::size_t ring_ticks() const { return options_.report.empty() && !recording_ ? 0 : kRingTicks; }

  std::size_t reported_ticks() const {
    double length_s = kReportedMaxS;
    if (options_.motion) length_s = options_.motion->duration_s() + 1;
    if (options_.duration_s) length_s = std::min(*options_.duration_s + 1, std::max(length_s, kReportedMaxS));
    return static_cast<std::size_t>(length_s * kHapticRateHz);
  }

  /// Holds the device at the start of its motion until the clocks are locked and, for attach, the displays have a patch.
  bool wait_until_felt(const Welcome& welcome) {
    const Micros joined = monotonic_now();
    const auto displays = static_cast<int>(stations_.size());
    return wait([&] {
      say_refusals();
      const Micros waited = monotonic_now() - joined;
      if (waited < kSettle || !felt().status().clock_locked || !loop_->running()) return !loop_->running();
      if (welcome.contact == ContactKind::touch) return true;
      const int ready = loop_->displays_with_patch();
      return ready == displays || (ready > 0 && waited > kComparisonWait);
    });
  }

  void arrive() {
    if (!std::exchange(arrived_, true)) start_.arrive();
  }

  bool wait_for_others() {
    arrive();
    const Micros since = monotonic_now();
    bool said = false;
    return wait([&] {
      const bool here = start_.all_are_here();
      if (!here && monotonic_now() - since > kNoAnswerAfter && !std::exchange(said, true))
        say("waits for the other hands of this program");
      return here;
    });
  }

  void move() {
    const Micros start = start_.agree(loop_->due_after(kUntilStart));
    motion_start_ = start;
    if (recording_) recording_->event(start, RecordedEventKind::motion);
    hardware_ ? mapped_->start(start) : device_->start(start);
    say(options_.motion ? fmt::format("motion of {:g} s starts", options_.motion->duration_s())
        : options_.held ? "the device renders the force of the body from now on"
                        : "the hand holds still");
    bool linked = true, slow = false, refuses = false, moving = options_.motion.has_value();
    wait([&] {
      say_refusals();
      const bool now_linked = felt().status().link == LinkState::joined;
      if (now_linked != linked) say(now_linked ? "joined again" : lost(felt().status().refusal));
      linked = now_linked;
      if (now_linked) keep_comparing();
      const ClientStatus status = felt().status();
      const bool now_slow = status.pace.slow(status.welcome.rate_hz);
      if (now_slow != slow)
        say(now_slow ? fmt::format("the server overruns: {:.1f} of {:g} frames per second, {:.0f} ms behind", status.pace.rate_hz,
                                   status.welcome.rate_hz, seconds(status.pace.behind) * 1e3)
                     : "the server keeps up again");
      slow = now_slow;
      if (status.patches_refused > 0 && !std::exchange(refuses, true))
        say("warning: patches of the server have numbers out of their ranges: they are refused, and the force is that of earlier "
            "ones");
      if (status.tool_released != released_said_) say(release_text(status.tool_released, status.welcome.contact));
      released_said_ = status.tool_released;
      say_scheme(status.in_use);
      say_guidance(status.guidance);
      if (moving && monotonic_now() > start + options_.motion->duration()) {
        moving = false;
        if (!options_.duration_s) return true;
        say(fmt::format("the motion has ended: the hand holds still until {:g} s are over", *options_.duration_s));
      }
      return !loop_->running();
    });
  }

  /// Ends comparisons that lost their tool: a hand that got another name from a restarted server no longer owns it.
  void keep_comparing() {
    const std::string name = felt().status().welcome.station;
    if (name == name_) return;
    name_ = name;
    say(fmt::format("this station is now named {}{}", name, stations_.size() > 1 ? "; the comparisons end" : ""));
    for (std::size_t i = 1; i < stations_.size(); ++i) stations_[i]->stop();
  }

  /// Reports each reason once per station.
  void say_refusals() {
    refusal_said_.resize(stations_.size());
    for (std::size_t i = 0; i < stations_.size(); ++i) {
      const ClientStatus status = stations_[i]->status();
      if (status.link != LinkState::refused || status.refusal == refusal_said_[i]) continue;
      refusal_said_[i] = status.refusal;
      const bool final = i == 0 && status.refuse_reason == RefuseReason::bad_request;
      complain(fmt::format("{} refused {}: {}{}", options_.server, stations_[i]->name(), status.refusal,
                           final ? "" : "; the client keeps trying"));
      refused_for_good_ = refused_for_good_ || final;
    }
    say_other_version();
  }

  /// Reports a server of another version. Such a message is not authenticated, so it counts only when no other arrives for
  /// kVersionMost.
  void say_other_version() {
    const ClientStatus status = felt().status();
    const Micros now = monotonic_now();
    if (status.link != LinkState::refused || status.refuse_reason != RefuseReason::version) other_version_since_ = now;
    if (now - other_version_since_ > kVersionMost) refused_for_good_ = true;
  }

  static std::string lost(const std::string& why) {
    return "server lost: the force fades to zero, and the client keeps trying" + (why.empty() ? "" : " (reason: " + why + ")");
  }

  static std::string felt_name(ClientStation& station) {
    const SchemeAsked asked = station.scheme();
    return std::string(name_of(asked ? asked : station.core().schemes_felt().mostly()));
  }

  /// Reports the scheme at first and at each change.
  void say_scheme(const SchemeInUse& now) {
    if (options_.scheme || now.reason <= SchemeReason::not_known_yet) return;
    const bool known = scheme_said_.reason > SchemeReason::not_known_yet;
    if (known && now.scheme == scheme_said_.scheme) return;
    scheme_said_ = now;
    say("scheme " + describe(now));
  }

  /// Reports each change of guidance.
  void say_guidance(const GuidanceStatus& now) {
    if (now == guidance_said_) return;
    if (now.partner != guidance_said_.partner) guidance_held_ = false;
    guidance_held_ |= now.held();
    const std::string text = now.partner.empty() ? fmt::format("guidance with {} has ended", guidance_said_.partner)
                                                 : guidance_text(now, guidance_held_);
    if (!now.partner.empty()) guidance_partner_ = now.partner;
    guidance_said_ = now;
    if (text != std::exchange(guidance_text_, text)) say(text);
  }

  void report() {
    RunReport run{options_, {}, nullptr, nullptr, {}, {}};
    for (auto& station : stations_) {
      ClientCore& core = station->core();
      run.displays.push_back(
          {station->scheme(), felt_name(*station), &core, core.haptic().counts(), core.haptic().guard_counts()});
    }
    run.guidance_partner = guidance_partner_;
    run.loop = loop_.get();
    run.ticks = log_.get();
    run.realtime = realtime_;
    if (loop_) say(describe(run));
    if (recording_) say(fmt::format("recording {}", options_.record.string()));
    if (options_.report.empty()) return;
    write_forces(options_.report / "forces.csv", run);
    write_summary(options_.report / "summary.json", run);
    say(fmt::format("report    {}", (options_.report / "summary.json").string()));
  }

  const AppOptions& options_;
  CommonStart& start_;
  const std::atomic<bool>& stop_;
  bool arrived_ = false;  ///< at the common start
  std::string name_;      ///< name of the felt station at the server
  Micros began_, motion_start_ = Micros::max();
  std::unique_ptr<SessionRecording> recording_;
  std::unique_ptr<TickLog> log_;
  std::vector<DisplayRecord> row_;
  std::vector<std::unique_ptr<ClientStation>> stations_;
  std::unique_ptr<Device> hardware_;      ///< a device that a hand holds, or
  std::unique_ptr<MotionDevice> device_;  ///< a simulated one
  std::unique_ptr<MappedDevice> mapped_;
  std::unique_ptr<HapticLoop> loop_;
  RealtimeStatus realtime_;
  SchemeInUse scheme_said_;
  GuidanceStatus guidance_said_;
  std::string guidance_text_;
  bool guidance_held_ = false;    ///< true: this hand and its partner held each other
  std::string guidance_partner_;  ///< the last partner
  std::vector<std::string> refusal_said_;
  bool released_said_ = false;
  std::uint32_t halts_said_ = 0;
  Micros other_version_since_ = monotonic_now();
  bool refused_for_good_ = false, failed_ = false;
};

}  // namespace

HandEnd run_hand(const AppOptions& options, CommonStart& start, const std::atomic<bool>& stop) {
  auto run = std::make_unique<Run>(options, start, stop);
  const HandEnd end{run->go(), run->stuck()};
  if (end.device_stuck) run.release();
  return end;
}

}  // namespace palpate
