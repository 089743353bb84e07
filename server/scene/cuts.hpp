// Cuts through a solid, given by its scene or made by a blade: what the edge of a blade sweeps through the body at rest.
//
// The edge, d long along the unit vector u, moves along the polyline p_1 .. p_n:
//
//     S = { p_i + r (p_(i+1) - p_i) + s d u :  0 <= r, s <= 1 }
//
// S cuts the links (edges of cells) that it crosses; a node within kOnSheet of a link's length of S counts as lying on the side
// to which (p_(i+1) - p_i) x u points. Cells whose corners a cut parts are doubled (cell_copies.hpp), and walls close the surface
// (cut_walls.hpp). A copy's share phi is that of the cell's 64 points (cell_points.hpp) that no sheet parts from its corners, at
// least kLeastShare. A cut thus ends between cells, up to one short of where the blade stopped. Pieces that nothing holds any
// more are left out.
//
// A body that is cut again keeps the shares of the copies that stay; those of a copy that is parted share its own. So with the
// positions, velocities and stresses of what each node and cell is a copy of, mass, momentum and energy are kept to rounding.
//
// Not modelled: walls that touch each other (they pass through one another), and tension before the cut.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "server/scene/cell_copies.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

class SceneText;

/// A parallelogram that the edge of a blade sweeps.
struct CutSheet {
  Vec3 corner, along, down, normal;
  Mat3 place;  ///< of a vector from `corner`, in shares of `along` and `down`
  Eigen::AlignedBox3d box;

  CutSheet(const Vec3& from, const Vec3& to, const Vec3& edge);
  /// Returns the share of the way from a to b at which it crosses it.
  std::optional<double> crossing(const Vec3& a, const Vec3& b) const;
};

/// A cut that began or went on: number, and what it is now. `parts`: the body was parted after it.
struct CutStep {
  std::size_t cut = 0;
  CutSettings to;
  bool parts = false;
};

/// A change of a body by parting: of each of its nodes and cells now, the one that it was before, or was a part of.
struct CutChange {
  std::vector<std::uint32_t> node_before, cell_before;
  std::size_t loose = 0;  ///< cells that were left out
};

/// Returns the change that two make together, one after the other.
CutChange both(const CutChange& first, const CutChange& second);
/// Returns for each node before the first that it is now, kNoNode for one that was left out.
std::vector<std::uint32_t> nodes_now(const CutChange& change, std::size_t before);

/// A finished body of hexahedra or tetrahedra that is cut.
class CutBody {
 public:
  explicit CutBody(LumpedBody uncut);
  const LumpedBody& uncut() const { return uncut_; }
  const LumpedBody& body() const { return body_; }
  /// Sets cut k, one more or one that has grown. Returns the number of links that it cuts besides those that are cut already.
  std::size_t set(std::size_t k, const CutSettings& cut);
  /// Parts the body where its links are cut. New nodes come after its own, and before the fixed ends of ligaments.
  CutChange part();
  /// Takes the steps by which another body was cut; this one has its bits then. Returns the change of the uncut body by all.
  CutChange repeat(const std::vector<CutStep>& steps);
  const std::vector<CutSettings>& cuts() const { return cuts_; }
  /// Present number of each node of the uncut body, kNoNode for those left out.
  const std::vector<std::uint32_t>& number() const { return number_; }

 private:
  template <class Cell>
  friend struct Cutter;
  struct Part {
    std::uint32_t cell = 0;  // of the uncut body
    std::uint8_t own = 0;    // a bit for each of the cell's corners
  };

  LumpedBody uncut_, body_;
  double density_kg_m3_ = 0;
  std::vector<CutSettings> cuts_;
  std::vector<std::vector<CutSheet>> sheets_;  // of each cut
  CutCells cut_;
  std::vector<Part> parts_;  // of each cell of body_
  std::vector<std::uint32_t> number_;
};

/// The cuts of a scene's body as it begins.
CutBody begun_cuts(const Scene& scene);

/// Cuts a body as its scene says, and says on stderr if pieces are left out. Throws InputError for a cut that crosses no link.
CutBody cut_body(LumpedBody body, const std::vector<CutSettings>& cuts, const SceneText& text);

}  // namespace palpate
