// What one seed draws: a body, a server, stations with their hands, devices, links and clocks, and what goes wrong when.
//
// Every part has a generator of its own, seeded by (seed, part, index): leaving one out changes none of the others, so a failing
// seed can be made smaller by leaving out what does not matter. bench/simulated-worlds.md says what is drawn
// from where to where.
//
// Times: faults lie in [kFirstFaultAt, healed]; at `healed` everything that is broken is mended (links keep their latency and
// jitter and lose nothing more); hands rest from `rest` on, touching the body; the world ends at `end`.
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
  double duration_s = 3;  ///< until everything is healed
  bool faults = true, drift = true, losses = true;
  int stations_max = 4;
  bool small = false;   ///< bodies of 3 x 3 x 3 nodes, or of 3 x 3, which cost less
  double deadband = 0;  ///< of ServerOptions; not drawn
  bool keys = false;    ///< of what is promised: a process that died has its name again as its own successor, after a handshake
};

inline constexpr Micros kFirstFaultAt{700'000};
inline constexpr Micros kComesToRest{400'000};  ///< for a hand, and the body under it

struct StationPlan {
  ClientOptions client;   ///< name, role, scheme, order, shadow_of, limits of the guard
  int owner = -1;         ///< a shadow: index of the station whose tool it shares
  bool simulated = true;  ///< a Phantom in a hand; otherwise the tool goes where the motion says, whatever it feels
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
  path_change,  ///< amount: new latency each way [s]; stays
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
  std::vector<Fault> faults;  ///< by their beginning
};

Scenario draw_scenario(const DrawOptions& options);

/// A page for a person, every drawn number on it.
std::string describe(const Scenario& scenario);

// What a scenario promises, by which its run is judged.

/// Longest way of a datagram over this link when it is not lost.
Micros slowest(const LinkSpec& link);
/// Link of a station after everything that happens to it.
struct Links {
  LinkSpec up, down;
};
Links healed_links(const Scenario& scenario, std::size_t station);
/// How long a datagram may take over this link, whatever happens to it in this scenario.
Micros slowest_ever(const Scenario& scenario, std::size_t station, bool up);
/// For how long the server may misjudge a clock after it stepped. A step that is shorter than a round trip looks like one way
/// that became shorter and another that became longer: no exchange of datagrams can tell the two apart, so it stays until what
/// was seen before is forgotten.
Micros misjudged_for(const Scenario& scenario, const Fault& fault);
/// From the end of a fault until a fresh patch is in use at the latest; see bench/simulated-worlds.md for the sum.
Micros recovery_time(const Scenario& scenario, std::size_t station);
/// When a station must feel the body again, everything being healed and every clock judged right.
Micros recovered_by(const Scenario& scenario, std::size_t station);

}  // namespace palpate
