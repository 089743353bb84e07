#include "bench/lab/skip_idle.hpp"

#include <sys/resource.h>

#include "server/body/unload.hpp"
#include "server/io/udp_server.hpp"

namespace palpate {
namespace {

struct Used {
  double seconds = 0, wake_ups = 0;
};

Used used() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  const auto s = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return {s(u.ru_utime) + s(u.ru_stime), static_cast<double>(u.ru_nvcsw)};
}

}  // namespace

IdleCost idle_server(std::span<const std::filesystem::path> scenes, double wait_s) {
  std::vector<NamedScene> rooms;
  for (const auto& file : scenes) rooms.push_back({"room " + std::to_string(rooms.size() + 1), open_scene(file)});
  UdpServer shell(rooms, {.listen = "127.0.0.1:0", .threads = rooms.size()}, {});
  constexpr std::chrono::milliseconds kBegun{500};  // the first frames are over
  Used before, after;
  asio::steady_timer begin(shell.context(), kBegun);
  asio::steady_timer end(shell.context(),
                         kBegun + std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::duration<double>(wait_s)));
  begin.async_wait([&](const asio::error_code&) { before = used(); });
  end.async_wait([&](const asio::error_code&) {
    after = used();
    shell.stop();
  });
  shell.run();
  return {(after.seconds - before.seconds) / wait_s, (after.wake_ups - before.wake_ups) / wait_s};
}

}  // namespace palpate
