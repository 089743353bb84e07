#include "server/metrics/io/metrics_server.hpp"

#include <CivetServer.h>
#include <civetweb.h>
#include <prometheus/text_serializer.h>

#include <chrono>
#include <functional>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "common/base/error.hpp"
#include "common/base/latest_slot.hpp"
#include "common/io/endpoint.hpp"
#include "common/io/monotonic.hpp"
#include "server/metrics/io/process_metrics.hpp"
#include "server/metrics/metrics.hpp"

namespace palpate {
namespace {

struct Answer {
  int status = 200;
  std::string type, text;
};

/// Answers GET at one path, but at none below it, with the result of `make`, and HEAD with its headers.
class Page : public CivetHandler {
 public:
  Page(std::string path, std::function<Answer()> make) : path_(std::move(path)), make_(std::move(make)) {}
  const std::string& path() const { return path_; }
  bool handleGet(CivetServer*, mg_connection* connection) override { return say(connection, true); }
  bool handleHead(CivetServer*, mg_connection* connection) override { return say(connection, false); }

 private:
  bool say(mg_connection* connection, bool with_text) {
    const mg_request_info& asked = *mg_get_request_info(connection);
    if (path_ != asked.local_uri) return false;
    if (asked.content_length > 0 || mg_get_header(connection, "Transfer-Encoding")) return refuse(connection);
    const Answer answer = make_();
    const char* const reason = answer.status == 200 ? "OK" : "Service Unavailable";
    mg_printf(connection, "HTTP/1.1 %d %s\r\nContent-Type: %s\r\nContent-Length: %zu\r\nCache-Control: no-store\r\n\r\n",
              answer.status, reason, answer.type.c_str(), answer.text.size());
    if (with_text) mg_write(connection, answer.text.data(), answer.text.size());
    return true;
  }

  /// Refuses a request with a body: civetweb would read it after the answer for as long as it comes, in a thread each.
  static bool refuse(mg_connection* connection) {
    mg_printf(connection, "HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
    mg_close_connection(connection);
    return true;
  }

  std::string path_;
  std::function<Answer()> make_;
};

Answer as_answer(const std::optional<std::string>& trouble) {
  return {trouble ? 503 : 200, "text/plain; charset=utf-8", trouble.value_or("ok") + "\n"};
}

/// Listens at an address as resolve_udp() understands it; TCP and UDP have the same addresses.
std::unique_ptr<CivetServer> serve_at(const std::string& flag, const std::string& address) {
  const std::string where = flag + " " + address, there = to_string(resolve_udp(flag, address));
  if (!there.empty() && there.front() == '[' && !mg_check_feature(MG_FEATURES_IPV6))
    throw InputError(where, "is an IPv6 address, which this HTTP server has not learnt", "an IPv4 address");
  // Most threads sleep: slow or silent readers that block some of them do not delay health checks. Connections end after an
  // answer or 1 s.
  const std::vector<std::string> options{"listening_ports",    there,  "num_threads",       "64",
                                         "request_timeout_ms", "1000", "enable_keep_alive", "no"};
  try {
    return std::make_unique<CivetServer>(options);
  } catch (const CivetException&) {
    throw AddressNotReady(where, "cannot be listened at", "a free port of this machine");
  }
}

}  // namespace

struct MetricsServer::Served {
  explicit Served(std::string v) : version(std::move(v)) {}

  std::optional<ServerState> newest() {
    const std::lock_guard lock(reading);
    if (ServerState* const fresh = slot.take()) state = std::move(*fresh);
    return state;
  }
  Answer metrics() {
    std::vector<prometheus::MetricFamily> families;
    if (const auto now = newest()) families = metrics_of(*now, version);
    for (prometheus::MetricFamily& family : process_metrics()) families.push_back(std::move(family));
    return {200, "text/plain; version=0.0.4; charset=utf-8", prometheus::TextSerializer().Serialize(families)};
  }

  std::string version;
  LatestSlot<ServerState> slot;
  std::mutex reading;  ///< protects slot.take() and state
  std::optional<ServerState> state;
  Page metrics_page{"/metrics", [this] { return metrics(); }};
  Page health_page{"/healthz", [this] { return as_answer(not_well(newest(), monotonic_now())); }};
  Page ready_page{"/readyz", [this] { return as_answer(not_ready(newest(), monotonic_now())); }};
  std::unique_ptr<CivetServer> http;
};

MetricsServer::MetricsServer(const std::string& flag, const std::string& address, std::string version)
    : served_(std::make_unique<Served>(std::move(version))) {
  served_->http = serve_at(flag, address);
  for (Page* page : {&served_->metrics_page, &served_->health_page, &served_->ready_page})
    served_->http->addHandler(page->path(), *page);
  there_ = {resolve_udp(flag, address).address(), static_cast<std::uint16_t>(served_->http->getListeningPorts().front())};
  address_ = to_string(UdpEndpoint(there_.address(), there_.port()));
}

/// civetweb notices a stop up to two seconds late, or at the next connection; so the destructor connects.
MetricsServer::~MetricsServer() {
  const auto knock = [this](const std::stop_token& stopped) {
    asio::io_context io;
    while (!stopped.stop_requested()) {
      asio::error_code ignored;
      asio::ip::tcp::socket(io).connect(there_, ignored);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  };
  std::jthread waker;
  try {
    waker = std::jthread(knock);
  } catch (const std::system_error&) {
  }  // no thread available: the end takes up to two seconds
  served_->http.reset();
}

void MetricsServer::publish(ServerState state) {
  served_->slot.back() = std::move(state);
  served_->slot.publish();
}

}  // namespace palpate
