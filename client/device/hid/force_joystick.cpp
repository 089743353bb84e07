#include "client/device/hid/force_joystick.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/base/error.hpp"

namespace palpate {

namespace {

constexpr const char* kWhat = "force-feedback joystick";
constexpr std::uint32_t kAxisX = hid_usage(0x01, 0x30), kAxisY = hid_usage(0x01, 0x31), kButtons = 0x09;
constexpr int kButtonsMost = 32;

constexpr std::uint32_t pid(std::uint32_t usage) { return hid_usage(0x0F, usage); }
constexpr std::uint32_t kSetEffect = pid(0x21), kBlockIndex = pid(0x22), kEffectType = pid(0x25), kConstantType = pid(0x26),
                        kDuration = pid(0x50), kGain = pid(0x52), kTrigger = pid(0x53), kDirectionEnable = pid(0x56),
                        kDirection = pid(0x57), kMagnitude = pid(0x70), kSetConstant = pid(0x73), kOperation = pid(0x77),
                        kOperationStart = pid(0x79), kLoopCount = pid(0x7C), kDeviceGain = pid(0x7D),
                        kDeviceGainValue = pid(0x7E), kBlockLoad = pid(0x89), kLoadStatus = pid(0x8B), kLoadSuccess = pid(0x8C),
                        kLoadFull = pid(0x8D), kEnableActuators = pid(0x97), kReset = pid(0x9A), kCreate = pid(0xAB);
constexpr std::uint32_t kSecondUnit = 0x1001;
constexpr std::int64_t kNoTrigger = 255;

using Report = std::vector<std::byte>;

const HidField& need(const ReportDescriptor& descriptor, HidReportKind kind, std::uint32_t usage, std::uint32_t within,
                     const char* name) {
  const HidField* field = descriptor.find(kind, usage, within);
  if (!field)
    throw InputError(kWhat, std::string("its report descriptor has no ") + name, "what constant forces of the PID class need");
  return *field;
}

Report report_of(const ReportDescriptor& descriptor, const HidField& field) {
  Report report(descriptor.report_bytes(field.kind, field.report_id));
  report[0] = std::byte{field.report_id};
  return report;
}

/// Returns a field that must be in this very report; a descriptor may spread related fields over several reports.
const HidField& need_in(const Report& report, const ReportDescriptor& descriptor, HidReportKind kind, std::uint32_t usage,
                        std::uint32_t within, const char* name) {
  const HidField& field = need(descriptor, kind, usage, within, name);
  if (!holds(field, report))
    throw InputError(kWhat, std::string("its ") + name + " is in a report of its own", "one report with its index");
  return field;
}

/// Writes a value if the descriptor has a field for it in this very report.
void set_if(const ReportDescriptor& descriptor, Report& report, HidReportKind kind, std::uint32_t usage, std::uint32_t within,
            std::int64_t value) {
  const HidField* field = descriptor.find(kind, usage, within);
  if (field && !field->array && holds(*field, report)) set_value(*field, report, value);
}

void must_write(HidTransport& transport, const Report& report, const char* what) {
  if (!transport.write(report)) throw InputError(kWhat, std::string("it did not take ") + what, "a device that stays plugged in");
}

void control(HidTransport& transport, const ReportDescriptor& descriptor, std::uint32_t usage, const char* what) {
  const HidField& field = need(descriptor, HidReportKind::output, usage, 0, what);
  Report report = report_of(descriptor, field);
  choose(field, report, usage);
  must_write(transport, report, what);
}

void full_gain(HidTransport& transport, const ReportDescriptor& descriptor) {
  const HidField* gain = descriptor.find(HidReportKind::output, kDeviceGainValue, 0);
  if (!gain) gain = descriptor.find(HidReportKind::output, kDeviceGain, 0);
  if (!gain) return;
  Report report = report_of(descriptor, *gain);
  set_value(*gain, report, gain->logical_max);
  must_write(transport, report, "its gain");
}

/// Returns the index of a new constant effect.
std::int64_t create_effect(HidTransport& transport, const ReportDescriptor& descriptor) {
  const HidField& type =
      need(descriptor, HidReportKind::feature, kConstantType, kCreate, "Create New Effect with a constant force");
  Report create = report_of(descriptor, type);
  choose(type, create, kConstantType);
  if (!transport.set_feature(create)) throw InputError(kWhat, "it refused a new effect", "room for two effects");
  const HidField& index = need(descriptor, HidReportKind::feature, kBlockIndex, kBlockLoad, "Block Load");
  const HidField& success =
      need_in(report_of(descriptor, index), descriptor, HidReportKind::feature, kLoadSuccess, kBlockLoad, "Block Load status");
  for (int attempt = 0; attempt < ForceJoystick::kLoadTries; ++attempt) {
    Report load = report_of(descriptor, index);
    if (transport.get_feature(load) < static_cast<int>(load.size())) continue;
    Report wanted = load;
    choose(success, wanted, kLoadSuccess);
    if (wanted == load) return value_of(index, load);
    Report full = load;
    if (descriptor.find(HidReportKind::feature, kLoadFull, kBlockLoad)) choose(success, full, kLoadFull);
    if (full == load)
      throw InputError(kWhat, "it has no room for another effect",
                       "two effects that nobody else uses: end other programs that use it");
  }
  throw InputError(kWhat, "it did not load an effect in " + std::to_string(ForceJoystick::kLoadTries) + " tries",
                   "an index for it");
}

std::int64_t in_unit(const HidField& field, Micros time) {
  const int exponent = field.unit == kSecondUnit ? field.unit_exponent : -3;
  return std::llround(seconds(time) * std::pow(10.0, -exponent));
}

void set_direction(const ReportDescriptor& descriptor, Report& report, int quarters) {
  for (const HidField& field : descriptor.fields()) {
    if (field.kind != HidReportKind::output || field.array || field.bits > 32 || !holds(field, report)) continue;
    if (field.collection < 0 || descriptor.collections()[static_cast<std::size_t>(field.collection)].usage != kDirection)
      continue;
    // A whole turn is the range, which may exclude its last step (0 to 255) or include it (0 to 36000).
    set_value(field, report,
              field.logical_min + std::llround(static_cast<double>(field.logical_max - field.logical_min) * quarters / 4));
    return;
  }
}

Report effect_report(const ReportDescriptor& descriptor, std::int64_t index, int quarters) {
  const HidField& block = need(descriptor, HidReportKind::output, kBlockIndex, kSetEffect, "Set Effect");
  Report report = report_of(descriptor, block);
  set_value(block, report, index);
  choose(need_in(report, descriptor, HidReportKind::output, kConstantType, kSetEffect, "effect type"), report, kConstantType);
  const HidField& duration = need_in(report, descriptor, HidReportKind::output, kDuration, kSetEffect, "duration of effects");
  set_value(duration, report, in_unit(duration, ForceJoystick::kEffectTime));
  if (const HidField* gain = descriptor.find(HidReportKind::output, kGain, kSetEffect); gain && holds(*gain, report))
    set_value(*gain, report, gain->logical_max);
  set_if(descriptor, report, HidReportKind::output, kTrigger, kSetEffect, kNoTrigger);
  set_if(descriptor, report, HidReportKind::output, kDirectionEnable, kSetEffect, 1);
  set_direction(descriptor, report, quarters);
  return report;
}

}  // namespace

ForceJoystick::ForceJoystick(const ForceJoystickOptions& options) : options_(options) {
  if (!(options.force_max_n > 0))
    throw InputError(kWhat, "its force in newtons is not known",
                     "what it pushes with at full magnitude, measured with a spring scale");
  if (!(options.reach_m > 0 && options.stiffness_max_n_m > 0 && options.slew_max_n_s > 0))
    throw InputError(kWhat, "its reach, stiffness or slew is not positive", "numbers above 0");
}

bool ForceJoystick::is(const ReportDescriptor& descriptor) {
  return descriptor.find(HidReportKind::input, kAxisX) && descriptor.find(HidReportKind::input, kAxisY) &&
         descriptor.find(HidReportKind::output, kMagnitude, kSetConstant) &&
         descriptor.find(HidReportKind::feature, kConstantType, kCreate);
}

DeviceCaps ForceJoystick::begin(HidTransport& transport) {
  const ReportDescriptor descriptor(transport.descriptor());
  axes_ = {need(descriptor, HidReportKind::input, kAxisX, 0, "X axis"),
           need(descriptor, HidReportKind::input, kAxisY, 0, "Y axis")};
  for (const HidField& axis : axes_)
    if (axis.array || axis.logical_max <= axis.logical_min)
      throw InputError(kWhat, "an axis has no range", "a smallest and a largest value");
  buttons_.clear();
  for (const HidField& field : descriptor.fields())
    if (field.kind == HidReportKind::input && !field.array && field.bits == 1 && field.usage >> 16 == kButtons &&
        buttons_.size() < kButtonsMost)
      buttons_.push_back(field);
  magnitude_ = need(descriptor, HidReportKind::output, kMagnitude, kSetConstant, "Set Constant Force");
  control(transport, descriptor, kReset, "Device Control, reset");
  control(transport, descriptor, kEnableActuators, "Device Control, enable actuators");
  full_gain(transport, descriptor);
  for (int axis = 0; axis < 2; ++axis) {
    Effect& effect = effects_[static_cast<std::size_t>(axis)];
    effect.index = create_effect(transport, descriptor);
    must_write(transport, effect_report(descriptor, effect.index, 1 - axis), "an effect");
    const HidField& block =
        need(descriptor, HidReportKind::output, kBlockIndex, kSetConstant, "effect index in Set Constant Force");
    effect.constant = report_of(descriptor, block);
    set_value(block, effect.constant, effect.index);
    need_in(effect.constant, descriptor, HidReportKind::output, kMagnitude, kSetConstant, "magnitude");
    const HidField& operated = need(descriptor, HidReportKind::output, kBlockIndex, kOperation, "Effect Operation");
    effect.start = report_of(descriptor, operated);
    set_value(operated, effect.start, effect.index);
    choose(need_in(effect.start, descriptor, HidReportKind::output, kOperationStart, kOperation, "start of effects"),
           effect.start, kOperationStart);
    set_if(descriptor, effect.start, HidReportKind::output, kLoopCount, kOperation, 1);
    effect.sent = 0;
    set_value(magnitude_, effect.constant, 0);
    must_write(transport, effect.constant, "a force of zero");
  }
  running_ = false;
  DeviceCaps caps;
  caps.name = "hid";
  caps.force_max_n = options_.force_max_n;
  caps.force_continuous_n = options_.force_max_n;
  caps.stiffness_max_n_m = options_.stiffness_max_n_m;
  caps.slew_max_n_s = options_.slew_max_n_s;
  caps.workspace = {Vec3(-options_.reach_m, -options_.reach_m, 0), Vec3(options_.reach_m, options_.reach_m, 0)};
  caps.buttons = static_cast<int>(buttons_.size());
  caps.watchdog = kEffectTime;
  caps.model = "PID joystick, two axes; force as given";
  return caps;
}

bool ForceJoystick::take(std::span<const std::byte> report, HidInput& input) noexcept {
  if (!holds(axes_[0], report) || !holds(axes_[1], report)) return false;
  for (int i = 0; i < 2; ++i) {
    const HidField& axis = axes_[static_cast<std::size_t>(i)];
    const auto low = static_cast<double>(axis.logical_min), high = static_cast<double>(axis.logical_max);
    const double share = std::clamp((2 * static_cast<double>(value_of(axis, report)) - low - high) / (high - low), -1.0, 1.0);
    input.reading.position[i] = (i == 0 ? 1 : -1) * share * options_.reach_m;
  }
  for (std::size_t i = 0; i < buttons_.size(); ++i) {
    if (!holds(buttons_[i], report)) continue;
    const std::uint32_t bit = 1u << i;
    input.reading.buttons = value_of(buttons_[i], report) != 0 ? input.reading.buttons | bit : input.reading.buttons & ~bit;
  }
  input.reading.state = DeviceState::ok;
  return true;
}

bool ForceJoystick::send_magnitude(HidTransport& transport, Effect& effect, double share) noexcept {
  const std::int64_t magnitude = std::llround(std::clamp(share, -1.0, 1.0) * static_cast<double>(magnitude_.logical_max));
  if (magnitude == effect.sent) return true;
  set_value(magnitude_, effect.constant, magnitude);
  effect.sent = magnitude;
  return transport.write(effect.constant);
}

bool ForceJoystick::send(HidTransport& transport, const HidCommand& command, Micros now) noexcept {
  const Vec3 share = command.armed ? Vec3(command.wrench.force / options_.force_max_n) : Vec3(Vec3::Zero());
  // A force that comes from the right, or from away from the user, pushes to the left, or to the user: against x and y.
  const bool sent = send_magnitude(transport, effects_[0], (options_.flip_x ? 1 : -1) * share.x()) &&
                    send_magnitude(transport, effects_[1], (options_.flip_y ? 1 : -1) * share.y());
  if (!sent) return false;
  if (!command.armed || (running_ && now - started_ < kRestart)) return true;
  running_ = true;
  started_ = now;
  return transport.write(effects_[0].start) && transport.write(effects_[1].start);
}

}  // namespace palpate
