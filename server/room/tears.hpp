// Tears: the cuts of a scene's body go on where the body gives as much energy as the new surface takes.
//
// A cut has up to three fronts: both ends of its path and its lower edge. Ahead of a front lies the next row of cells, those that
// the cut parts once it has gone straight on by a link. The energy that the body gives when they part, at x, with its tools held
// where they are, is the crack closure integral over that row:
//
//     G = 1 / (2 A) sum_k p_k . d_k,     p_k = F_k - (m_k / m) F,     K d = p
//
// F [N]: elastic forces on a node before, of mass m; F_k, m_k: on what it becomes; K: stiffness of the parted body at x, where
// nodes that a grasp holds are held, and a touch holds its nodes with its contact's stiffness; d [m]: the displacements by which
// the row opens; A [m^2]: area of the cut in the row at rest. p is the load that the row bears, with the sign that opens it. As d
// is that of the whole row after it has opened, and not the opening behind the front (virtual crack closure), the energy is that
// of this step of the lattice, whatever its spacing.
//
// The load of a parted row fades with a time tau (Traction), and takes what its opening grows meanwhile, too: with the opening
// growing at a steady rate, G + 3/4 tau dG/dt. Rows are looked at dt apart, so a row parts on average dt / 2 late. It parts where
//
//     G + (3/4 tau + 1/2 dt) dG/dt >= J,     dG/dt >= 0,
//
// so that a tear dissipates J A whatever its speed, while rows part more slowly than they are looked at; where nothing moves,
// where G >= J.
//
// A row under pressure does not part: the mean of the openings must not point inwards by more than kInwards of its length.
//
// What can go wrong: G is the mean of a whole front, so a long one that is pulled at one place tears late, and then all along.
// Nonlinear openings are taken as linear. Viscous stress and inertia are no part of G.
// Source: Rybicki and Kanninen, Eng. Fract. Mech. 9 (1977), for the closure integral on finite elements.
#pragma once

#include <memory>
#include <vector>

#include "server/dynamics/stepper.hpp"
#include "server/scene/cuts.hpp"

namespace palpate {

enum class CutEnd : std::uint8_t { first, last, deep };  ///< ends of the path, lower edge
struct TearFront {
  std::size_t cut = 0;
  CutEnd end = CutEnd::first;
};

/// The body after the next row ahead of a front has parted.
class TearRow {
 public:
  /// Returns null where the cut goes no further: it ends outside of the body, or would take a piece off.
  static std::unique_ptr<TearRow> ahead(const CutBody& now, const TearFront& front);

  const TearFront& front() const { return front_; }
  /// The body, cut so far, and the change to it.
  const CutBody& body() const { return body_; }
  const CutChange& change() const { return change_; }
  double area_m2() const { return area_m2_; }
  /// Returns G [J/m^2], 0 of a row under pressure. `now`: the body before, with `skin`, at `state`.
  double release_j_m2(const Dynamics& now, const Skin& skin, const BodyState& state, const std::vector<ToolPort>& ports);
  /// Looks at the row: returns the left side of the criterion above if it is at least J, else 0. It solves only where the load
  /// has changed. `fade_s`: tau.
  double enough_j_m2(double toughness_j_m2, double fade_s, const Dynamics& now, const Skin& skin, const BodyState& state,
                     const std::vector<ToolPort>& ports);

 private:
  TearRow(CutBody body, CutChange change, const TearFront& front);
  struct Corner {
    std::uint32_t a = 0, b = 0;  // nodes before
    double part = 0;             // of the way from a to b
  };
  struct Section {
    std::vector<Corner> corners;                                 // of a cell, in the cut
    std::vector<std::pair<std::uint32_t, std::uint32_t>> walls;  // nodes on the side of its normal and on the other
  };
  template <class Cell>
  void find_sections(const std::vector<Cell>& before, const std::vector<Cell>& now, const LumpedBody& body);
  double look(double time_s, double square);
  BodyState carried(const BodyState& state) const;
  Vector load(const Dynamics& now, const BodyState& state, const BodyState& parted) const;
  double solve(const Skin& skin, const Vector& x, const BodyState& parted, const std::vector<ToolPort>& ports, const Vector& p);

  CutBody body_;
  CutChange change_;
  TearFront front_;
  Dynamics dynamics_;
  std::vector<std::uint32_t> now_;  // nodes_now()
  std::vector<double> share_;       // of each cell, of what it was
  std::vector<Section> sections_;
  double area_m2_ = 0, reach_m_ = 0;
  Vector solved_, opening_;  // load of the last solve, and its d
  double per_square_n_ = 0;  // its energy over the square of that load
  std::optional<double> looked_s_;
  double between_s_ = 0;                         // dt
  std::vector<std::pair<double, double>> seen_;  // times and squares of loads
};

}  // namespace palpate
