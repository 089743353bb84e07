// Scenarios drawn from a seed: a body, a server, stations with their hands, devices, links and clocks, and a schedule of faults.
//
// Every part has its own generator, seeded by (seed, part, index): leaving one part out changes none of the others, so a failing
// seed can be reduced by leaving out irrelevant parts. bench/simulated-worlds.md has the table of all ranges.
//
// Times: faults lie in [kFirstFaultAt, healed]; at `healed` all faults end (links keep their latency and jitter and lose nothing
// more); hands rest from `rest` on, touching the body; the world ends at `end`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/core/client_core.hpp"
#include "client/device/sim_phantom.hpp"
#include "common/link/link_model.hpp"
#include "common/motion/motion.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct DrawOptions {
  std::uint64_t seed = 1;
  double duration_s = 3;  ///< time until everything is healed
  bool faults = true, drift = true, losses = true;
  int stations_max = 4;
  bool small = false;   ///< cheaper bodies of 3 x 3 x 3 or 3 x 3 nodes
  double deadband = 0;  ///< see ServerOptions; not drawn
  bool keys = false;    ///< affects promises: a restarted process regains its name as its own successor, after a handshake
};

inline constexpr Micros kFirstFaultAt{700'000};
inline constexpr Micros kComesToRest{400'000};  ///< time for a hand, and the body under it

struct StationPlan {
  ClientOptions client;   ///< name, role, scheme, order, shadow_of, limits of the guard
  int owner = -1;         ///< for a shadow: index of the station whose tool it shares
  bool simulated = true;  ///< a Phantom in a hand; false: the tool follows the motion regardless of forces
  std::string hand;
  SimPhantomOptions phantom;
  std::vector<MotionPoint> path;  ///< from the start of the world on
  LinkSpec up, down;
  double drift_ppm = 0;

  bool pushes() const { return owner < 0 && client.hello.role == Role::haptic; }
};

enum class FaultKind : std::uint8_t {
  cut_up,
  cut_down,
  cut,
  storm,        ///< amount: share lost, in bursts, with duplicates and reordering
  path_change,  ///< amount: new latency each way [s]; permanent
  net_stall,
  haptic_stall,
  crash,
  leave,
  clock_step,  ///< amount [s], ahead
  sleep,       ///< its machine is suspended
  server_stall,
  server_restart,  ///< amount: 1 keeps the body
  server_clock_step
};
inline constexpr std::size_t kFaultKinds = static_cast<std::size_t>(FaultKind::server_clock_step) + 1;
const char* describe(FaultKind kind);
bool is_of_server(FaultKind kind);

struct Fault {
  FaultKind kind = FaultKind::cut;
  int station = -1;  ///< -1: the server
  Micros begin{}, end{};
  double amount = 0;
};

struct Scenario {
  DrawOptions drawn_with;
  std::string scene_json;
  Scene scene;
  double rate_hz = 20, server_drift_ppm = 0;
  Micros compute{}, healed{}, rest{}, end{};
  std::vector<StationPlan> stations;
  std::vector<Fault> faults;  ///< ordered by their beginning
};

Scenario draw_scenario(const DrawOptions& options);

/// Describes a scenario on a page for a person, with every drawn number.
std::string describe(const Scenario& scenario);

// Promises of a scenario, by which its run is judged.

/// Largest delay of a datagram over this link, unless it is lost.
Micros slowest(const LinkSpec& link);
/// Links of a station after all faults.
struct Links {
  LinkSpec up, down;
};
Links healed_links(const Scenario& scenario, std::size_t station);
/// Largest delay of a datagram over this link under any fault of this scenario.
Micros slowest_ever(const Scenario& scenario, std::size_t station, bool up);
/// Longest time for which the server may misjudge a clock after a step. A step shorter than a round trip looks like one direction
/// that became faster and another that became slower; no exchange of datagrams can distinguish the two, so the error persists
/// until the earlier exchanges are forgotten.
Micros misjudged_for(const Scenario& scenario, const Fault& fault);
/// Longest time from the end of a fault until a fresh patch is in use; bench/simulated-worlds.md derives it.
Micros recovery_time(const Scenario& scenario, std::size_t station);
/// Time by which a station must feel the body again, with everything healed and every clock known.
Micros recovered_by(const Scenario& scenario, std::size_t station);

}  // namespace palpate
