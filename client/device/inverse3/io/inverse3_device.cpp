#include "client/device/inverse3/io/inverse3_device.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <exception>

#include "client/device/inverse3/inverse3_session.hpp"
#include "client/device/inverse3/io/service_link.hpp"
#include "common/base/error.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {

namespace {

constexpr const char* kFlagInverse3 = "--device inverse3";
constexpr Micros kConnectEvery{1'000'000}, kNoteEvery{10'000};
constexpr auto kTurnTime = std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / Inverse3Session::kTurnHz));

// Neither the service nor its documentation states limits: these are cautious, and not measured.
constexpr double kPeakN = 5, kContinuousN = 2, kStiffnessNM = 500;
constexpr double kPeakInS = 0.004;  // a step to the peak force in four ticks feels like a knock, not a blow
// Box around the middle of the workspace, well beyond the sphere of 0.1 m in which the maker's examples stay.
constexpr double kReachM = 0.25;

DeviceCaps caps_of(const Inverse3Inventory::Listed& device, Inverse3Format format) {
  // Before version 3.5 the origin is at the base, to which the arm comes back like this.
  const Vec3 middle = format == Inverse3Format::v3_5 ? Vec3(Vec3::Zero()) : Vec3(0, -0.12, 0.15);
  DeviceCaps caps;
  caps.name = "inverse3";
  caps.force_max_n = kPeakN;
  caps.slew_max_n_s = kPeakN / kPeakInS;
  caps.stiffness_max_n_m = kStiffnessNM;
  caps.force_continuous_n = kContinuousN;
  caps.velocity_max_m_s = Inverse3Session::kVelocityMaxMS;
  caps.workspace = {middle - Vec3::Constant(kReachM), middle + Vec3::Constant(kReachM)};
  caps.model = "Haply " + (device.type.empty() ? "inverse3" : device.type) + ", device " + device.id + ", Inverse Service " +
               (format == Inverse3Format::v3_5 ? "3.5 or later" : "3.1 to 3.4");
  return caps;
}

std::string listed(const Inverse3Inventory& inventory) {
  std::string text;
  for (const auto& device : inventory.devices) text += (text.empty() ? "" : ", ") + device.id;
  return text;
}

const Inverse3Inventory::Listed& choose(const Inverse3Inventory& inventory, const std::string& id) {
  const auto& all = inventory.devices;
  if (all.empty())
    throw InputError(kFlagInverse3, "its service lists no device", "an Inverse3 that is plugged in and switched on");
  if (id.empty() && all.size() > 1)
    throw InputError(kFlagInverse3, "several fit", "inverse3:ID with one of " + listed(inventory));
  const auto found =
      id.empty() ? all.begin() : std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.id == id; });
  if (found == all.end())
    throw InputError(kFlagInverse3, "its service lists no device \"" + id + "\"", "one of " + listed(inventory));
  if (!found->type.empty() && found->type != "inverse3" && found->type != "inverse3x")
    throw InputError(kFlagInverse3, "device " + found->id + " is of type " + found->type,
                     "an inverse3 or inverse3x, whose limits are known");
  return *found;
}

}  // namespace

Inverse3Options read_inverse3_options(std::string_view text) {
  Inverse3Options options;
  const std::size_t comma = text.find(',');
  options.id = text.substr(0, comma);
  if (comma == std::string_view::npos) return options;
  const std::string_view setting = text.substr(comma + 1),
                         number = setting.substr(std::min(setting.size(), setting.find('=') + 1));
  const auto [end, fault] = std::from_chars(number.data(), number.data() + number.size(), options.port);
  if (!setting.starts_with("port=") || fault != std::errc{} || end != number.data() + number.size() || options.port == 0)
    throw InputError(kFlagInverse3, "\"" + std::string(setting) + "\"", "port=NUMBER, 1 to 65535");
  return options;
}

std::vector<Inverse3Inventory::Listed> find_inverse3(std::uint16_t port) {
  const std::atomic<bool> never{false};
  return read_inverse3_inventory(ServiceLink(port, never).first_message()).devices;
}

struct Inverse3Device::Connection {
  Connection(std::uint16_t port, const std::atomic<bool>& give_up)
      : link(port, give_up), inventory(read_inverse3_inventory(link.first_message())) {}
  ServiceLink link;
  Inverse3Inventory inventory;
};

Inverse3Device::Inverse3Device(const Inverse3Options& options) : options_(options), exchange_(Inverse3Session::kTurnHz) {
  auto connection = std::make_unique<Connection>(options_.port, ends_);
  const Inverse3Inventory::Listed& device = choose(connection->inventory, options_.id);
  options_.id = device.id;
  type_ = device.type;
  caps_ = caps_of(device, connection->inventory.format);
  thread_ = std::thread([this, first = std::move(connection)]() mutable { run(std::move(first)); });
}

Inverse3Device::~Inverse3Device() {
  ends_ = true;
  thread_.join();
}

/// Connects anew after a pause. Returns null while the same device is not listed.
std::unique_ptr<Inverse3Device::Connection> Inverse3Device::connect_again() noexcept {
  for (Micros waited{}; waited < kConnectEvery && !ends_; waited += kNoteEvery) std::this_thread::sleep_for(kNoteEvery);
  if (ends_) return nullptr;
  try {
    auto connection = std::make_unique<Connection>(options_.port, ends_);
    const Inverse3Inventory::Listed& device = choose(connection->inventory, options_.id);
    // Another type or version has other limits than those known to the guard.
    if (device.type == type_ && caps_of(device, connection->inventory.format).model == caps_.model) return connection;
  } catch (const std::exception&) {
  }
  return nullptr;
}

void Inverse3Device::run(std::unique_ptr<Connection> connection) noexcept {
  if (options_.on_thread) options_.on_thread();
  while (!ends_) {
    if (!connection) connection = connect_again();
    if (!connection) continue;
    ServiceLink& link = connection->link;
    Inverse3Session session(options_.id, connection->inventory.format, exchange_, counter_, monotonic_now());
    link.run(
        kTurnTime, [&](std::string_view message) { session.receive(message, monotonic_now()); },
        [&] {
          const Micros now = monotonic_now();
          session.turn(now);
          if (ends_ || session.lost(now)) return false;
          if (!link.writing())
            if (auto command = session.command(now)) link.send(std::move(*command));
          return true;
        });
    if (!link.fault().empty()) exchange_.turn(not_ok(DeviceState::gone, std::string_view(link.fault())));
    link.end(session.last_command());
    connection.reset();
  }
}

}  // namespace palpate
