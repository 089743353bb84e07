// A needle and a blade that move at a steady speed into a block of 60 x 60 mm whose lower face is held, in frames of a room's
// body (server/room/stepped_body.hpp), against what their laws give for a body of any mesh. J is the toughness, d the needle's
// diameter, w the length of the blade's edge, c the front, W the work of the hand, U the energy of the body, f the friction of
// the shaft per length, A what is cut.
//
//   needle, puncture           largest force before the tip is inside: that which its tissue bears
//   needle, force              less friction: J d
//   needle, work per area      (W - f (c_2^2 - c_1^2) / 2) / A: J
//   needle, double insertion   (W_1 - W_2) / A: J, with W_2 of a second insertion along the same path (Azar and Hayward, 2008)
//   blade, force               its mean: J w
//   blade, work per area       (W - dU) / A: J
//
// `cells` are those over the 60 mm.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "bench/tissue/tissue_case.hpp"
#include "common/player/player.hpp"
#include "server/room/stepped_body.hpp"

namespace palpate {
namespace {

constexpr double kBlockM = 0.06, kTopM = 0.04, kSpeedMS = 0.02;
constexpr double kNeedleJ = 164, kDiameterM = 0.00127, kFrictionNM = 4, kPunctureN = 0.6;

/// A tissue and the edge of a blade in it.
struct BladeTissue {
  double young_pa, toughness_j_m2, edge_m;
};
constexpr BladeTissue kFirm{20000, 30, 0.04}, kLiver{8000, 206, 0.01};  // J of liver for blades: the middle of 187 to 225

Scene block(int cells, double young_pa, const std::string& tissue, const std::string& tool) {
  const int across = cells + 1, down = 1 + static_cast<int>(std::lround(cells * kTopM / kBlockM));
  return read_scene(
      fmt::format(
          R"({{"body": {{"lattice": {{"nodes": [{0}, {0}, {1}], "size_m": [{2}, {2}, {3}], "fixed_faces": ["z-"], "solid":
      {{"element": "hexahedron", "young_pa": {4}, "poisson": 0.45, "law": "neo-hookean", "damping_s": 0.01}}}}, "tissue": [{{{5}}}]}},
      "tool": {{"contact": "touch", "radius_m": 0.02, {6}}}}})",
          across, down, kBlockM, kTopM, young_pa, tissue, tool),
      "block");
}

Scene needle_block(int cells) {
  return block(cells, 8000,
               fmt::format(R"("toughness_j_m2": {}, "puncture_n": {}, "friction_n_m": {})", kNeedleJ, kPunctureN, kFrictionNM),
               fmt::format(R"("needle": {{"length_m": 0.036, "diameter_m": {}}})", kDiameterM));
}

Scene blade_block(int cells, const BladeTissue& tissue) {
  return block(cells, tissue.young_pa, fmt::format(R"("toughness_j_m2": {}, "puncture_n": 0.5)", tissue.toughness_j_m2),
               fmt::format(R"("blade": {{"length_m": 0.036, "width_m": {}}})", tissue.edge_m));
}

/// A tool that moves along z between the block's nodes, beginning 1 mm above it.
class Stab {
 public:
  explicit Stab(const Scene& scene, Micros frame = Micros{10'000}) : body_(scene), frame_(frame) { body_.start(now_); }

  /// Moves along z.
  void move_by(double way_m) {
    const double end_m = z_m_ + way_m;
    const double frame_m = kSpeedMS * seconds(frame_);
    while (std::abs(end_m - z_m_) > 1e-9) frame(std::copysign(std::min(std::abs(end_m - z_m_), frame_m), way_m));
  }
  const NeedleTip& tip() const { return body_.ports()[body_.ports_of(1).front()].needle.tip; }
  double force_n() const {
    double sum = 0;
    for (const std::size_t k : body_.ports_of(1))
      if (body_.ports()[k].touching) sum -= body_.ports()[k].lambda.z();
    return sum;
  }
  double work_j() const { return work_j_; }
  double energy_j() const { return body_.dynamics().energy(body_.state()); }
  std::size_t nodes() const { return body_.begun().nodes.size(); }

 private:
  void frame(double way_m) {
    FrameJob job;
    job.target = now_ + frame_;
    job.may_sleep = false;
    StationJob& hand = job.stations.emplace_back();
    hand.id = 1;
    const double part_m = way_m / static_cast<double>(frame_ / kTick);
    for (int k = 0; now_ + k * kTick <= job.target + kTick; ++k)
      hand.samples.push_back({now_ + kTick * k, Vec3(0.0312, 0.0291, z_m_ + k * part_m), turn_});
    const double before_n = body_.ports().empty() ? 0 : force_n();
    const auto report = body_.step(job);
    if (!report || !report->converged) throw std::runtime_error("a frame of a tool that cuts found no equilibrium");
    now_ = job.target;
    z_m_ += way_m;
    work_j_ -= 0.5 * (before_n + force_n()) * way_m;
  }

  SteppedBody body_;
  Micros frame_;
  const Rotation turn_ = Rotation(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()));
  Micros now_{7'000'000};
  double z_m_ = kTopM + 0.001, work_j_ = 0;
};

/// A needle on its way into the body, 10 mm deep; the rest of the way is measured.
constexpr double kBeginM = 0.010, kEndM = 0.024;

TissueSolution puncture(int cells) {
  Stab stab(needle_block(cells), Micros{1000});
  double most_n = 0;
  stab.move_by(-0.001);
  for (; !stab.tip().inside; stab.move_by(-0.00002)) most_n = std::max(most_n, stab.force_n());
  return {stab.nodes(), most_n};
}

TissueSolution needle_force(int cells) {
  Stab stab(needle_block(cells));
  stab.move_by(-kEndM);
  return {stab.nodes(), stab.force_n() - kFrictionNM * stab.tip().front_m};
}

TissueSolution needle_work(int cells, bool twice) {
  Stab stab(needle_block(cells));
  stab.move_by(-kBeginM);
  const double begin_m = stab.tip().front_m, begin_j = stab.work_j();
  stab.move_by(kBeginM - kEndM);
  const double end_m = stab.tip().front_m, area_m2 = kDiameterM * (end_m - begin_m), first_j = stab.work_j() - begin_j;
  if (!twice) return {stab.nodes(), (first_j - 0.5 * kFrictionNM * (end_m * end_m - begin_m * begin_m)) / area_m2};
  // Back, and a little farther, so that the shaft slides inwards again over all of the way.
  constexpr double kFartherM = 0.002;
  stab.move_by(kEndM - kBeginM + kFartherM);
  stab.move_by(-kFartherM);
  const double again_j = stab.work_j();
  stab.move_by(kBeginM - kEndM);
  return {stab.nodes(), (first_j - (stab.work_j() - again_j)) / area_m2};
}

TissueSolution blade(int cells, const BladeTissue& tissue, bool work) {
  Stab stab(blade_block(cells, tissue));
  stab.move_by(-0.006);
  double sum_n = 0;
  int frames = 0;
  const double begin_m = stab.tip().front_m, begin_j = stab.work_j() - stab.energy_j();
  for (; frames < 100; ++frames) {
    stab.move_by(-0.0002);
    sum_n += stab.force_n();
  }
  const double kept_j = stab.work_j() - stab.energy_j() - begin_j;
  return {stab.nodes(), work ? kept_j / (tissue.edge_m * (stab.tip().front_m - begin_m)) : sum_n / frames};
}

}  // namespace

std::vector<TissueCase> tool_cases() {
  const auto add = [](const char* family, const char* name, const char* unit, double reference, const char* by,
                      const auto& solve) {
    return TissueCase{family,      name,
                      unit,        reference,
                      by,          {TissueElement::hexahedron},
                      {6, 12, 24}, [solve](TissueElement, int cells) { return solve(cells); }};
  };
  return {
      add("needle", "needle, puncture", "N", kPunctureN, "its tissue", puncture),
      add("needle", "needle, force less friction", "N", kNeedleJ * kDiameterM, "J d", needle_force),
      add("needle", "needle, work per area", "J/m2", kNeedleJ, "J", [](int n) { return needle_work(n, false); }),
      add("needle", "needle, double insertion", "J/m2", kNeedleJ, "J", [](int n) { return needle_work(n, true); }),
      add("blade", "blade, force", "N", kFirm.toughness_j_m2 * kFirm.edge_m, "J w", [](int n) { return blade(n, kFirm, false); }),
      add("blade", "blade, work per area", "J/m2", kFirm.toughness_j_m2, "J", [](int n) { return blade(n, kFirm, true); }),
      add("blade", "blade in liver, force", "N", kLiver.toughness_j_m2 * kLiver.edge_m, "J w",
          [](int n) { return blade(n, kLiver, false); }),
      add("blade", "blade in liver, work per area", "J/m2", kLiver.toughness_j_m2, "J",
          [](int n) { return blade(n, kLiver, true); })};
}

}  // namespace palpate
