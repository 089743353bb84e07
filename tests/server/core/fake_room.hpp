// A room without a body: it answers jobs with patches of constant force, or linear ones with given terms, and records the jobs.
#pragma once

#include <vector>

#include "server/core/server_core.hpp"
#include "tests/common/wire/seeds.hpp"

namespace palpate {

inline RoomInfo test_facts(ContactKind contact = ContactKind::touch) {
  RoomInfo facts;
  facts.scene = "test";
  facts.contact = contact;
  facts.home = Vec3(0.01, 0.02, 0.03);
  facts.nodes = 400;
  for (std::uint32_t i = 0; i < facts.nodes; ++i) {
    facts.vertex_of.push_back(i);
    facts.mesh.vertices.emplace_back();
  }
  for (std::uint32_t i = 0; i + 2 < facts.nodes; ++i) facts.mesh.triangles.push_back({i, i + 1, i + 2});
  facts.mesh_hash = 77;
  return facts;
}

struct FakeRoom {
  static constexpr Micros kPatchAgeMost{1'000'000};
  bool in_reach = true;
  bool fail = false;
  bool asleep = false;
  bool renews = false;          ///< true: the patch that a station plays is renewed, for a second
  Micros valid_for{1'000'000};  ///< validity of its patches
  Scheme built = Scheme::hold;  ///< scheme of its patches, whatever is requested
  NonlinearTerms terms;         ///< terms of its patches
  Micros step_took{}, patches_took{};
  Vec3 force{0, 0, 1};  ///< on tools
  std::vector<StationId> released;
  bool keeps_off = false;  ///< true: every tool was released
  std::vector<FrameJob> jobs;

  FrameResult run(const FrameJob& job) {
    FrameResult result;
    result.failed = fail;
    result.asleep = asleep;
    result.steps = asleep ? 0 : 1;
    result.released = released;
    result.stamp = job.target;
    result.step_took = step_took;
    result.patches_took = patches_took;
    for (const auto& station : job.stations) {
      StationFrame frame{station.id, std::nullopt, {}, Vec3(1, 2, 3) * 1e-3, force, Vec3::Zero(), in_reach};
      if (in_reach && !fail && station.wants_patch)
        frame.patch = terms.variables > 0 ? patch_with_terms(job.target) : patch(job.target);
      if (frame.patch) frame.patch->scheme = built;
      if (frame.patch) frame.patch->valid_for = valid_for;
      if (frame.patch) frame.terms = terms;
      frame.released = keeps_off;
      const bool young = station.playing && job.target + station.horizon - *station.playing <= kPatchAgeMost;
      if (renews && young) frame.renewed_from = station.playing;
      result.stations.push_back(frame);
    }
    if (job.shapes) result.positions.assign(400, Vec3(0.1, 0, 0));
    jobs.push_back(job);
    return result;
  }

  static Patch patch(Micros stamp) {
    Patch p;
    p.stamp = stamp;
    p.constant = true;
    p.force = Vec3(0, 0, 1);
    p.valid_for = Micros{1'000'000};
    p.trust_radius_m = 1;
    return p;
  }

 private:
  Patch patch_with_terms(Micros stamp) const {
    Patch p = terms.grasp ? seeds::attach_patch(terms.variables - 3) : seeds::touch_patch(terms.variables, 12, 16);
    p.stamp = stamp;
    p.has_terms = true;
    return p;
  }
};

}  // namespace palpate
