#include "client/io/body_reset.hpp"

#include <thread>

#include "client/core/client_core.hpp"
#include "client/io/udp_client.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {

std::string reset_body(const std::string& server, const std::string& station, const std::string& room, Micros longest,
                       const std::atomic<bool>& stop, const std::optional<ClientKeys>& keys) {
  constexpr Micros kPoll{10'000};
  ClientOptions options;
  options.hello.station = station;
  options.hello.alike = true;
  options.hello.room = room;
  options.hello.role = Role::viewer;
  ClientCore core(options, monotonic_now());
  core.ask_reset();
  std::atomic<bool> done{false};
  UdpClient client(
      server, core, {}, [&done](const ClientCore& c, auto, auto) { done = !c.reset_pending(); }, keys);
  client.start();
  const Micros begin = monotonic_now();
  const auto refused = [&client] {
    const ClientStatus status = client.status();
    return status.link == LinkState::joined && !status.refusal.empty();
  };
  while (!stop && !done && !refused() && monotonic_now() - begin < longest) std::this_thread::sleep_for(kPoll);
  const ClientStatus status = client.status();
  client.stop();
  if (done) return {};
  if (!status.refusal.empty()) return "refused: " + status.refusal;
  if (status.link == LinkState::joined) return "the server, which answers, resets a body a few times a minute at most";
  return no_answer_text(server, status.nobody_listens, keys.has_value());
}

}  // namespace palpate
