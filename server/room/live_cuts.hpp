// Cuts of blades, and tears. After its steps a body is parted as far as the fronts of their cuts have come (CutBody): its nodes
// keep positions and velocities, its cells their relaxed stress, and the traction that held the new copies together fades
// (Traction), so that no hand feels a step. With T the load of all forces on a node before, m its mass, and T_k, m_k those of
// what it became, that is
//
//     r_k = (m_k / m) T - T_k,      sum_k r_k = 0:      the copies begin with the acceleration that they had
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/body/needle_tissue.hpp"
#include "server/dynamics/stepper.hpp"
#include "server/room/tears.hpp"
#include "server/scene/cuts.hpp"

namespace palpate {

/// A body with its tools, which is cut; all must outlive the cuts. The steppers of `dynamics` are its owner's.
struct BodyInParts {
  Scene* scene;
  Skin* skin;
  std::unique_ptr<NeedleTissue>* tissue;
  std::optional<Dynamics>* dynamics;
  BodyState *state, *rest;
  std::vector<ToolPort>* ports;
};

class LiveCuts {
 public:
  static constexpr double kLookS = 0.0125, kFrameS = 0.05, kFastS = 0.2;
  /// The body is as its scene has it.
  explicit LiveCuts(const BodyInParts& of);
  /// Cuts where blades have cut, or tears (tears.hpp). Returns true if cells were parted: the nodes are others then.
  bool cut_on();
  /// Makes the body what its scene has, at rest; returns false if nothing was cut.
  bool make_whole();
  /// Returns the time after which cut_on() is due [s]: kLookS where a row has torn within kFastS, else kFrameS.
  double due_s() const { return of_.scene->tearing && of_.state->time_s - torn_s_ < kFastS ? kLookS : kFrameS; }
  /// The change of nodes and cells by the last cut_on() that returned true.
  const CutChange& parted() const { return parted_; }
  /// The body as its scene has it, and its rest.
  const LumpedBody& begun() const { return begun_; }
  const BodyState& rest_begun() const { return rest_; }
  /// Cuts since the body was that; null: none.
  const std::shared_ptr<const std::vector<CutStep>>& steps() const { return steps_; }
  /// Cuts the body of the scene, at rest, in these steps. Returns the change.
  CutChange repeat(const std::vector<CutStep>& steps);

 private:
  std::optional<CutChange> follow_blades();
  std::optional<CutChange> tear();
  void look_for_rows(const TearFront& first);
  double fade_s() const;
  void note_steps();
  void part(CutChange change);
  void renew(const LumpedBody& body);
  void carry_over(const BodyState& before, std::span<const double> share, BodyState& state) const;

  BodyInParts of_;
  LumpedBody begun_;
  CutBody cut_;
  BodyState rest_;
  std::vector<std::shared_ptr<const NeedlePath>> paths_;  // of each cut; null: the blade has left it
  std::vector<std::unique_ptr<TearRow>> rows_;            // that may tear
  std::vector<TearFront> fronts_;                         // whose rows are not found yet, the next one last
  std::vector<CutSettings> noted_;                        // each cut as it is in steps_
  double torn_s_;                                         // when it was parted last
  std::shared_ptr<const std::vector<CutStep>> steps_;
  CutChange parted_;
};

}  // namespace palpate
