#include "tests/client/device/standin/inverse3_service.hpp"

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cmath>
#include <deque>
#include <nlohmann/json.hpp>

#include "tests/client/device/standin/arm.hpp"

namespace palpate::test {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using nlohmann::json;

constexpr auto kAMoment = std::chrono::milliseconds(1);
constexpr auto kSlow = std::chrono::milliseconds(40);
constexpr std::size_t kHugeBytes = 1'000'000;
const Vec3 kMiddle(0, -0.12, 0.15);  // of the workspace, from the base

json vector_json(const Vec3& v) {
  const auto number = [](double x) { return std::isfinite(x) ? json(x) : json(nullptr); };
  return {{"x", number(v.x())}, {"y", number(v.y())}, {"z", number(v.z())}};
}

}  // namespace

class Inverse3Service::ServiceArm final : public StandinArm {
 public:
  explicit ServiceArm(std::string name) : id(std::move(name)) { start_time(); }
  ~ServiceArm() override { stop_time(); }
  bool in_use() const override { return used; }
  bool listed() const { return fault() != StandinFault::lost && fault() != StandinFault::no_device; }
  bool silent() const { return fault() == StandinFault::silent; }
  bool is_calibrated() const { return calibrated(); }
  Vec3 reading() const { return position(); }
  void obey(const Vec3& newest) {
    command(newest);
    force = newest;
  }

  const std::string id;
  std::atomic<bool> used{false};
  Vec3 force = Vec3::Zero();  ///< guarded by the service's mutex
};

struct Inverse3Service::Inside {
  asio::io_context io;
  tcp::acceptor acceptor{io};
  std::deque<tcp::socket> sockets;  ///< of all connections, each used by its thread, closed by the last one
  std::deque<std::thread> threads;
  std::thread accepts;
};

Inverse3Service::Inverse3Service(std::vector<std::string> ids, Inverse3Format format, std::uint16_t port)
    : format_(format), inside_(std::make_unique<Inside>()) {
  for (std::string& id : ids) arms_.push_back(std::make_unique<ServiceArm>(std::move(id)));
  auto& acceptor = inside_->acceptor;
  acceptor.open(tcp::v4());
  acceptor.set_option(tcp::acceptor::reuse_address(true));
  acceptor.bind({asio::ip::address_v4::loopback(), port});
  acceptor.listen();
  port_ = acceptor.local_endpoint().port();
  inside_->accepts = std::thread([this] { accept(); });
}

Inverse3Service::~Inverse3Service() {
  ends_ = true;
  ::shutdown(inside_->acceptor.native_handle(), SHUT_RDWR);  // accept() returns
  inside_->accepts.join();
  for (tcp::socket& socket : inside_->sockets) ::shutdown(socket.native_handle(), SHUT_RDWR);
  for (std::thread& thread : inside_->threads) thread.join();
}

void Inverse3Service::accept() {
  while (!ends_) {
    beast::error_code error;
    tcp::socket socket = inside_->acceptor.accept(error);
    if (error) continue;
    socket.set_option(tcp::no_delay(true));
    inside_->sockets.push_back(std::move(socket));
    const std::size_t connection = inside_->sockets.size() - 1;
    inside_->threads.emplace_back([this, connection] { serve(connection); });
  }
}

void Inverse3Service::serve(std::size_t connection) {
  tcp::socket& socket = inside_->sockets[connection];
  beast::error_code error;
  while (fault_ == ServiceFault::deaf && !ends_) std::this_thread::sleep_for(kAMoment);
  if (fault_ == ServiceFault::refuses) {
    http::response<http::string_body> refusal(http::status::forbidden, 11);
    refusal.prepare_payload();
    http::write(socket, refusal, error);
    ::shutdown(socket.native_handle(), SHUT_RDWR);
    return;
  }
  websocket::stream<tcp::socket&> stream(socket);
  stream.accept(error);
  const auto send = [&](const std::string& text) { return !error && (stream.write(asio::buffer(text), error), !error); };
  while (fault_ == ServiceFault::mute && !ends_) std::this_thread::sleep_for(kAMoment);
  std::size_t answered = 0;
  for (bool open = send(state(true, false)); open && !ends_; ++answered) {
    beast::flat_buffer in;
    if (stream.read(in, error); error) break;
    obey({static_cast<const char*>(in.data().data()), in.size()}, answered == 0);
    if (fault_ == ServiceFault::slow) std::this_thread::sleep_for(kSlow);
    const auto stalls = [&] { return std::any_of(arms_.begin(), arms_.end(), [](const auto& arm) { return arm->silent(); }); };
    while (stalls() && !ends_) std::this_thread::sleep_for(kAMoment);
    if (fault_ == ServiceFault::closes) break;
    open = send(state(false, answered > 0));
  }
  ::shutdown(socket.native_handle(), SHUT_RDWR);
  const std::lock_guard lock(mutex_);
  for (const auto& arm : arms_) arm->obey(Vec3::Zero());
}

void Inverse3Service::set_type(std::string type) {
  const std::lock_guard lock(mutex_);
  type_ = std::move(type);
}

Standin& Inverse3Service::arm(std::size_t k) { return *arms_.at(k); }

Vec3 Inverse3Service::force(std::size_t k) const {
  const std::lock_guard lock(mutex_);
  return arms_.at(k)->force;
}

std::vector<std::string> Inverse3Service::breaches() const {
  const std::lock_guard lock(mutex_);
  return breaches_;
}

void Inverse3Service::breach(const std::string& what) {
  if (breaches_.size() < 100) breaches_.push_back(what);
}

std::string Inverse3Service::state(bool with_config, bool centred) const {
  const ServiceFault fault = fault_;
  if (fault == ServiceFault::not_json) return R"({"inverse3":[{"device_id":")";
  if (fault == ServiceFault::no_list) return R"({"wireless_verse_grip":[]})";
  if (fault == ServiceFault::huge) return std::string(kHugeBytes, ' ');
  json devices = json::array();
  const std::lock_guard lock(mutex_);
  for (const auto& arm : arms_) {
    if (!arm->listed()) continue;
    const bool from_base = format_ == Inverse3Format::v3_5 && !centred;
    json position = vector_json(from_base ? Vec3(arm->reading() + kMiddle) : arm->reading());
    if (fault == ServiceFault::text) position["y"] = "0.1";
    if (fault == ServiceFault::far_away) position["y"] = 1e300;
    json device{{"device_id", fault == ServiceFault::other ? "FFFF" : arm->id},
                {"state",
                 {{"cursor_position", position},
                  {"cursor_velocity", vector_json(Vec3::Zero())},
                  {"current_cursor_force", vector_json(arm->force)},
                  {"control_domain", "cartesian"},
                  {"control_mode", "force"}}},
                {"status", {{"calibrated", arm->is_calibrated()}, {"in_use", true}}}};
    if (with_config)
      device["config"] = {{"type", type_}, {"handedness", "right"}, {"preset", "defaults"}, {"basis", {{"permutation", "XYZ"}}}};
    devices.push_back(std::move(device));
  }
  json all{{"inverse3", std::move(devices)}, {"verse_grip", json::array()}};
  if (with_config && format_ == Inverse3Format::v3_5) all["session_id"] = 7;
  std::string text = all.dump();
  if (fault == ServiceFault::too_large)
    if (const std::size_t at = text.find("\"x\":"); at != std::string::npos)
      text.replace(at, text.find(',', at) - at, "\"x\":1e999");
  return text;
}

void Inverse3Service::obey(std::string_view command, bool first) {
  ++commands_;
  const std::lock_guard lock(mutex_);
  const json said = json::parse(command, nullptr, false);
  if (!said.is_object() || !said.contains("inverse3")) return breach("a command that is no object with inverse3");
  const bool new_format = format_ == Inverse3Format::v3_5;
  if (first && new_format && said["inverse3"][0].value("/configure/preset"_json_pointer, "") != "arm_front_centered")
    breach("no preset in the first command of version 3.5");
  if (said.contains("session") != (first && new_format))
    breach("session.configure belongs into the first command of version 3.5");
  for (const json& device : said["inverse3"]) {
    const auto found =
        std::find_if(arms_.begin(), arms_.end(), [&](const auto& arm) { return arm->id == device.value("device_id", ""); });
    const json force = device.value("/commands/set_cursor_force"_json_pointer, json());
    if (found == arms_.end()) return breach("no such device");
    if (force.size() != 1 || !force.contains(new_format ? "vector" : "values")) return breach("a force of another version");
    const json& vector = force.front();
    if (!vector["x"].is_number() || !vector["y"].is_number() || !vector["z"].is_number())
      return breach("a force without numbers");
    (*found)->used = true;
    (*found)->obey({vector["x"].get<double>(), vector["y"].get<double>(), vector["z"].get<double>()});
  }
}

}  // namespace palpate::test
