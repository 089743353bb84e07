// Cuts of blades. After its steps a body is parted as far as the fronts of their cuts have come (CutBody): its nodes keep
// positions and velocities, its cells their relaxed stress, and the traction that held the new copies together fades (Traction),
// so that no hand feels a step. With T the load of all forces on a node before, m its mass, and T_k, m_k those of what it became,
// that is
//
//     r_k = (m_k / m) T - T_k,      sum_k r_k = 0:      the copies begin with the acceleration that they had
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/body/needle_tissue.hpp"
#include "server/dynamics/stepper.hpp"
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
  /// The body as it is now is the uncut one.
  explicit LiveCuts(const BodyInParts& of);
  /// Cuts where blades have cut. Returns true if cells were parted: the nodes are others then.
  bool cut_on();
  /// Makes the body what it was before it was cut, at rest; returns false if nothing was cut.
  bool make_whole();
  /// The change of nodes and cells by the last cut_on() that returned true.
  const CutChange& parted() const { return parted_; }
  const LumpedBody& uncut() const { return cut_.uncut(); }
  const BodyState& rest_uncut() const { return rest_; }
  /// Cuts since the body was whole; null: none.
  const std::shared_ptr<const std::vector<CutStep>>& steps() const { return steps_; }
  /// Cuts the whole body, at rest, in these steps. Returns the change.
  CutChange repeat(const std::vector<CutStep>& steps);

 private:
  void note_steps();
  void part(CutChange change);
  void renew(const LumpedBody& body);
  void carry_over(const BodyState& before, std::span<const double> share, BodyState& state) const;

  BodyInParts of_;
  CutBody cut_;
  BodyState rest_;
  std::vector<std::shared_ptr<const NeedlePath>> paths_;  // of each cut; null: the blade has left it
  std::vector<CutSettings> made_, noted_;                 // each cut as it is now; as it is in steps_
  std::shared_ptr<const std::vector<CutStep>> steps_;
  CutChange parted_;
};

}  // namespace palpate
