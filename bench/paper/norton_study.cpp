#include "bench/paper/norton_study.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/fidelity/metrics.hpp"
#include "bench/paper/norton.hpp"
#include "common/base/minimum_jerk.hpp"

namespace palpate {
namespace {

constexpr double kTickS = 1e-3;
/// Scale of the motion: the mesh of the patches has large displacements, but is linear when they are this small; forces are
/// scaled back.
constexpr double kScale = 1e-4;

/// Depth 3 mm at 1.5 Hz, 0.3 mm at 9 Hz and 0.05 mm at 40 Hz, sideways 2 mm at 1.1 Hz; from rest within half a second.
PortMotion hand_motion(std::size_t ticks) {
  PortMotion m;
  Vector before = Vector::Zero(2);
  for (std::size_t n = 0; n < ticks; ++n) {
    const double t = static_cast<double>(n) * kTickS, w = 2 * std::numbers::pi * t, onset = minimum_jerk(t / 0.5);
    const double depth = 3 * std::sin(1.5 * w) + 0.3 * std::sin(9 * w) + 0.05 * std::sin(40 * w);
    const Vector d = kScale * 1e-3 * onset * Vector{{2 * std::sin(1.1 * w), -depth}};
    m.d.push_back(d);
    m.rate.push_back((d - before) / kTickS);
    before = d;
  }
  return m;
}

std::vector<Vec3> as_forces(const std::vector<Vector>& forces) {
  std::vector<Vec3> out;
  for (const Vector& f : forces) out.emplace_back(f[0] / kScale, f[1] / kScale, 0);
  return out;
}

std::vector<std::uint8_t> fine_coordinates(const Specimen& sheet, const SecondOrderSystem& system, int layers) {
  const auto nodes = sheet.near_port(layers);
  std::vector<std::uint8_t> fine;
  for (const std::uint32_t c : system.coordinates) fine.push_back(nodes[c / 3]);
  return fine;
}

double snr_db(const std::vector<Vec3>& shown, const std::vector<Vec3>& whole) { return compare(shown, whole, 250, 0).snr_db; }

}  // namespace

NortonStudy study_norton(const NortonStudyOptions& o, const std::vector<int>& frame_ticks) {
  const Specimen sheet = Specimen::sheet(kPaperNodes, {o.stiffness_n_m, o.damping_n_s_m, o.node_mass_kg});
  const SecondOrderSystem system = sheet.system();
  const auto fine = fine_coordinates(sheet, system, o.fine_layers);
  const PortMotion motion = hand_motion(static_cast<std::size_t>(std::lround(o.duration_s / kTickS)));
  const MeshRun run = step_whole(system, motion, kTickS);
  NortonStudy study;
  study.fine_states = 2 * static_cast<int>(std::count(fine.begin(), fine.end(), 1));
  study.whole_states = 2 * static_cast<int>(system.size());
  study.whole = as_forces(run.force);
  for (const int ticks : frame_ticks) {
    NortonRate r;
    r.rate_hz = static_cast<int>(std::lround(1 / (ticks * kTickS)));
    r.hold = as_forces(hold_frames(run, ticks));
    r.norton = as_forces(step_split(system, fine, ticks, motion, kTickS));
    r.port = as_forces(play_patches(sheet, system, run, motion, ticks, Scheme::port));
    r.stable = r.norton.size() == study.whole.size();
    r.norton.resize(study.whole.size(), r.norton.back());
    r.hold_db = snr_db(r.hold, study.whole);
    r.norton_db = snr_db(r.norton, study.whole);
    r.port_db = snr_db(r.port, study.whole);
    study.rates.push_back(std::move(r));
  }
  study.equal_rates_rel_rms = compare(as_forces(step_split(system, fine, 1, motion, kTickS)), study.whole, 0, 0).rel_rms;
  return study;
}

}  // namespace palpate
