#include "client/device/hid/hid_settings.hpp"

#include <charconv>

#include "common/base/error.hpp"

namespace palpate {

namespace {

constexpr const char* kFlag = "--device hid";

/// Removes values by key; none may remain at its end().
class Taking {
 public:
  Taking(std::map<std::string, std::string> values, std::string kind, std::string keys)
      : values_(std::move(values)), kind_(std::move(kind)), keys_(std::move(keys)) {}

  /// Returns empty text for a missing key.
  std::string text(const std::string& key) {
    const auto found = values_.find(key);
    if (found == values_.end()) return {};
    std::string value = found->second;
    values_.erase(found);
    return value;
  }

  void number(const std::string& key, double low, double high, double& into) {
    const std::string given = text(key);
    if (given.empty()) return;
    double value = 0;
    const auto [end, fault] = std::from_chars(given.data(), given.data() + given.size(), value);
    if (fault != std::errc{} || end != given.data() + given.size() || !(value >= low && value <= high))
      throw InputError(kFlag, key + "=" + given, "a number from " + plain(low) + " to " + plain(high));
    into = value;
  }

  void end() const {
    if (!values_.empty()) throw InputError(kFlag, "a " + kind_ + " takes no " + values_.begin()->first, keys_);
  }

 private:
  static std::string plain(double value) {
    char text[32];
    const auto [end, fault] = std::to_chars(text, text + sizeof text, value);
    return fault == std::errc{} ? std::string(text, end) : "";
  }
  std::map<std::string, std::string> values_;
  std::string kind_, keys_;
};

constexpr double kLengthMinM = 1e-3, kLengthMaxM = 1.0, kSpeedMinMS = 1e-3, kSpeedMaxMS = 1.0, kForceMinN = 0.1,
                 kForceMaxN = 30.0;

}  // namespace

HidSettings::HidSettings(std::string_view text) {
  const auto next = [&text] {
    const std::string_view part = text.substr(0, text.find(','));
    text.remove_prefix(std::min(text.size(), part.size() + 1));
    return part;
  };
  which_ = next();
  while (!text.empty()) {
    const std::string_view part = next();
    const std::size_t equals = part.find('=');
    if (equals == std::string_view::npos || equals == 0 || equals + 1 == part.size())
      throw InputError(kFlag, "\"" + std::string(part) + "\"", "KEY=VALUE");
    if (!values_.emplace(part.substr(0, equals), part.substr(equals + 1)).second)
      throw InputError(kFlag, std::string(part.substr(0, equals)) + " is there twice", "each key once");
  }
}

SpaceMouseOptions HidSettings::space_mouse() const {
  Taking take(values_, "six-axis mouse", "control, axes, speed-m-s, reach-m");
  SpaceMouseOptions options;
  const std::string control = take.text("control"), axes = take.text("axes");
  if (!control.empty() && control != "rate" && control != "position")
    throw InputError(kFlag, "control=" + control, "rate or position");
  if (control == "position") options.control = SpaceMouseOptions::Control::position;
  if (!axes.empty()) options.axes = AxisMap::from_text(axes);
  take.number("speed-m-s", kSpeedMinMS, kSpeedMaxMS, options.speed_max_m_s);
  take.number("reach-m", kLengthMinM, options.workspace.max().x(), options.reach_m);
  take.end();
  return options;
}

ForceJoystickOptions HidSettings::force_joystick() const {
  Taking take(values_, "PID joystick", "force-n, reach-m, flip");
  ForceJoystickOptions options;
  take.number("force-n", kForceMinN, kForceMaxN, options.force_max_n);
  take.number("reach-m", kLengthMinM, kLengthMaxM, options.reach_m);
  const std::string flip = take.text("flip");
  if (flip.find_first_not_of("xy") != std::string::npos) throw InputError(kFlag, "flip=" + flip, "x, y or xy");
  options.flip_x = flip.find('x') != std::string::npos;
  options.flip_y = flip.find('y') != std::string::npos;
  take.end();
  if (options.force_max_n == 0)
    throw InputError(kFlag, "a PID joystick does not say its force in newtons",
                     "hid:,force-n=N with what it pushes with at full magnitude, measured with a spring scale");
  return options;
}

void HidSettings::force_profile() const { Taking(values_, "force device", "a serial number or a node alone").end(); }

}  // namespace palpate
