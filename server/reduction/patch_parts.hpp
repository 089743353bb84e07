// Stages of build_patch() (patch_build.hpp), for its source files only: values that one passes to the next.
#pragma once

#include <optional>

#include "server/reduction/basis.hpp"
#include "server/reduction/other_tools.hpp"
#include "server/reduction/patch_build.hpp"
#include "server/reduction/pod_basis.hpp"

namespace palpate {

/// A load of all contacts of a tool with a body, as of one that moves without deforming: along an axis, the mean of B_j e_i, or
/// about one through the middle of the contacts, the mean of B_j (e_i x r_j) / L_i, with L_i the root mean square of |e_i x r_j|;
/// or, for `hyper`, of jaws that close, along the inward normals of their contacts; and P^-1 of it. Its work per unit is the mean
/// displacement of the contacts along it, `most_m` at most as a hand turns it.
struct ToolLoad {
  Vector load, response;
  double most_m = 0;
};
/// Those of the thread that a tool holds, and its stiffness, sum k y y^T (suture_loads.hpp).
struct SutureLoads {
  struct Part {
    Vector y;
    double stiffness_n_m = 0;
  };
  Vector force;  ///< empty: it holds none
  std::vector<Part> stiffness;
  std::vector<ToolLoad> spans;  ///< of a pull of 1 N in each span
};

/// The linearised body under a port, with the other tools on it.
struct LinearPort {
  FrameModel& frame;
  BodyFrame& body;
  SharedSystem& p;
  std::size_t which;
  const PatchRequest& request;
  Linearisation at;  ///< with the coordinates that P holds
  OtherTools others;
  Vector residual = {};     ///< F* of its coordinates, with the loads of other tools; zero for held ones
  SutureLoads suture = {};  ///< not in the residual

  const ToolPort& tool_port() const { return frame.ports()[which]; }
  const ToolAt& tool() const { return frame.tool(which); }
  const Port& port() const { return p.port(which); }
  bool hyper() const { return request.scheme == Scheme::hyper; }
  bool grasp() const { return tool_port().kind == ContactKind::attach; }
};

/// Contacts of the patch besides the port's.
inline PatchContacts contacts_of(const LinearPort& model) {
  const std::shared_ptr<const NeedlePath>& path = model.tool_port().needle.path;
  PatchContacts contacts{static_cast<int>(model.others.contacts.size()), model.frame.has_body(model.which),
                         model.others.shaft.empty() ? 0 : path->layers.count, model.frame.has_jaws(model.which)};
  contacts.laws = std::ranges::any_of(model.others.contacts, [&](const OtherTools::Contact& other) {
    return model.frame.ports()[other.tool].parameters != model.tool_port().parameters;
  });
  contacts.own = static_cast<int>(model.others.own);
  if (const auto& suture = model.tool_port().suture) contacts.bites = model.frame.state().sutures->threads[*suture].law.bites;
  return contacts;
}

/// The modes of a patch.
struct Reduced {
  Matrix v;                 ///< V, 3 n x r, so that V^T K V is diagonal
  Vector stiffness;         ///< of the modes, before PSD projection
  Matrix coordinates = {};  ///< of the snapshots, V^T M w, for `hyper`
  SnapshotSet snapshots = {};
};

/// port_responses.cpp: none of a tool with one contact; of a thread those of its spans. Those of a needle are followed by one
/// along its axis at each point of its path, where its tip may get.
std::vector<ToolLoad> wrenches(const LinearPort& model);
/// port_responses.cpp: returns the first Krylov directions, for `hyper` the snapshots of the port, and the slides of a touch.
KrylovStart krylov_start(const LinearPort& model);
SnapshotSet port_snapshots(const LinearPort& model, const KrylovStart& start);
/// Returns the motion of the tool's node with the tool, 3 n x 3, for a patch with terms; without columns for a touch.
Matrix prescribed_motion(const LinearPort& model);

/// port_patch.cpp: what a port adds to a patch whose modes are set, with its terms.
void add_grasp(const LinearPort& model, Reduced& reduced, BuiltPatch& made);
void add_touch(const LinearPort& model, Reduced& reduced, BuiltPatch& made);

/// Adds the terms of a patch, if there are any. `prescribed`: see above; `true_stiffness`: of modes and tool before PSD
/// projection, in the modes of the patch; `vertices`: of its surface.
void add_terms(const LinearPort& model, const Matrix& prescribed, const Matrix& true_stiffness, int vertices,
               const Reduced& reduced, BuiltPatch& made);

inline Mat3 symmetric(const Mat3& m) { return 0.5 * (m + m.transpose()); }

}  // namespace palpate
