// The column at the right: stations and their links, force and patch age over time, what the body costs.
#pragma once

#include <string>
#include <vector>

#include "client/view/history.hpp"

namespace palpate {

struct Foresight;
struct Pen;

struct PanelFigures {
  const RoomView* room = nullptr;
  bool holds = true;                     ///< otherwise it was said too long ago: figures are left out
  bool late_known = true;                ///< whether the ticks that came late are
  const History* forces = nullptr;       ///< [N]
  const History* patch_ages = nullptr;   ///< [ms]
  const Foresight* foresight = nullptr;  ///< of the viewer's own hand; none: not shown
  std::vector<std::string> stations;     ///< in the order of their colours, also of some that are gone
  Micros now{};                          ///< the plots' right end
};

/// Share of the picture's width that they cover, with their margin; 0 where the picture is too narrow for body and panels.
float panels_cover(float width, float scale);
/// Does nothing where the picture is too narrow for body and panels.
void draw_panels(const Pen& pen, const PanelFigures& figures);

}  // namespace palpate
