// The parts of palpate-lab couplings: methods cited in the paper's introduction, each demonstrated.
#pragma once

#include "bench/lab/experiments.hpp"
#include "bench/output/output.hpp"
#include "bench/output/plot.hpp"
#include "bench/paper/braking_pulse.hpp"
#include "bench/paper/norton_study.hpp"

namespace palpate {

struct CouplingFlags {
  Device1d device;  ///< for all parts but `norton` and `proxy`
  double period_s = 1e-3;
  CouplingParameters coupling{600, 0.1, 0};                 ///< virtual-coupling
  double wall_n_m = 800;                                    ///< proxy, braking-pulse
  double speed_m_s = 0.2, push_n = 0.5, force_max_n = 8.5;  ///< braking-pulse
  NortonStudyOptions sheet;                                 ///< norton
  bool quick = false;
};

struct CouplingPart {
  Json summary;
  std::string table;  ///< for the terminal
  std::vector<Finding> findings;
  Figure picture;
  GridPanel key_panel;  ///< for the overview
};

CouplingPart show_virtual_coupling(const std::filesystem::path& out, const CouplingFlags& flags);
CouplingPart show_proxy(const std::filesystem::path& out, const CouplingFlags& flags);
CouplingPart show_braking_pulse(const std::filesystem::path& out, const CouplingFlags& flags);
CouplingPart show_norton(const std::filesystem::path& out, const CouplingFlags& flags);

}  // namespace palpate
