// The column at the right: stations and their links, force and patch age over time, costs of the body, names of bodies and rigid
// parts.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "client/viewer/history.hpp"
#include "common/wire/body_mesh.hpp"

namespace palpate {

struct Foresight;
struct Pen;

struct PanelFigures {
  const RoomView* room = nullptr;
  bool holds = true;                     ///< false: the figures are out of date and omitted
  bool late_known = true;                ///< true: the number of late ticks is known
  const History* forces = nullptr;       ///< [N]
  const History* patch_ages = nullptr;   ///< [ms]
  const Foresight* foresight = nullptr;  ///< foresight of the viewer's own hand; null: not shown
  std::vector<std::string> stations;     ///< in the order of their colours, including some that are gone
  Micros now{};                          ///< right end of the plots
  std::span<const PartMesh> parts = {};  ///< rigid parts of the scene, named below
};

/// Returns the share of the picture's width that panels cover, with their margin; 0 where the picture is too narrow for both.
float panels_cover(float width, float scale);
/// Draws the panels; no effect where the picture is too narrow for body and panels.
void draw_panels(const Pen& pen, const PanelFigures& figures);

}  // namespace palpate
