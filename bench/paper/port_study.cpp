#include "bench/paper/port_study.hpp"

#include <algorithm>
#include <limits>

#include "bench/paper/local_models.hpp"
#include "bench/paper/truncation_map.hpp"
#include "bench/paper/two_layer.hpp"
#include "server/reduction/patch_build.hpp"

namespace palpate {
namespace {

class Study {
 public:
  Study(const Specimen& specimen, const BalancedReduction& balanced, const PortStudyOptions& options)
      : system_(specimen.system()),
        balanced_(balanced),
        frequencies_(log_frequencies(options.from_hz, options.to_hz, options.per_decade)) {
    study_.hankel = balanced.hankel();
    study_.proper_norm = proper_norm(balanced);
    PortModel full;
    full.name = "full";
    full.title = "whole body";
    full.states = 2 * system_.size();
    const TransferFunction transfer(system_);
    full.response = sample(transfer, frequencies_);
    full.error.assign(frequencies_.size(), 0);
    dc_ = transfer(0);
    study_.models.push_back(std::move(full));
  }

  const SecondOrderSystem& system() const { return system_; }

  void add(const std::string& name, const std::string& title, const SecondOrderSystem& model) {
    add(name, title, 2 * model.size(), TransferFunction(model), state_space(model));
  }
  void add(const std::string& name, const std::string& title, const StateSpace& model) {
    add(
        name, title, model.states(), [&model](Complex s) { return model.transfer(s); }, model);
  }
  PortStudy take() { return std::move(study_); }

 private:
  void add(const std::string& name, const std::string& title, Eigen::Index states, const Transfer& transfer,
           const StateSpace& space) {
    PortModel m;
    m.name = name;
    m.title = title;
    m.states = states;
    m.response = sample(transfer, frequencies_);
    m.error = relative_error(m.response, study_.full().response);
    const double dc = largest_singular_value(transfer(0) - dc_);
    m.dc_rel_error = dc / largest_singular_value(dc_);
    m.band_10_100_rel_error = worst_in_band(frequencies_, m.error, 10, 100);
    m.band_100_1000_rel_error = worst_in_band(frequencies_, m.error, 100, 1000);
    m.hinf_sampled_n_m = dc;
    for (std::size_t i = 0; i < frequencies_.size(); ++i)
      m.hinf_sampled_n_m = std::max(m.hinf_sampled_n_m, m.error[i] * largest_singular_value(study_.full().response.value[i]));
    m.hinf = error_norm(space);
    study_.models.push_back(std::move(m));
  }

  ReductionError error_norm(StateSpace model) const {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if ((model.d1 - system_.d_port).norm() > 1e-9 * system_.d_port.norm()) return {{kInfinity, kInfinity}, 0, kInfinity};
    model.d1 = system_.d_port;
    ReductionError error = reduction_error(balanced_, model);
    error.relative = error.peak.norm / study_.proper_norm.norm;
    return error;
  }

  const SecondOrderSystem system_;
  const BalancedReduction& balanced_;
  std::vector<double> frequencies_;
  ComplexMatrix dc_;
  PortStudy study_;
};

}  // namespace

const PortModel* PortStudy::find(const std::string& name) const {
  const auto at = std::find_if(models.begin(), models.end(), [&](const PortModel& m) { return m.name == name; });
  return at == models.end() ? nullptr : &*at;
}

PortStudy study_port(const Specimen& specimen, const BalancedReduction& balanced, const PortStudyOptions& options) {
  Study study(specimen, balanced, options);
  const SecondOrderSystem& system = study.system();
  for (const int order : options.orders)
    study.add("balanced-" + std::to_string(order), "balanced truncation", balanced.truncated(order));
  for (int layers = 1; layers <= options.rings; ++layers) {
    const SecondOrderSystem ring = specimen.ring(layers);
    study.add("ring-" + std::to_string(layers), std::to_string(layers) + (layers == 1 ? " layer free" : " layers free"), ring);
  }
  study.add("two-layer", "two layers, outer one scaled",
            two_layer_system(specimen.dynamics(), specimen.rest(), specimen.port_node()));
  study.add("condensed-1", "condensed onto 1 layer", condensed(specimen, system, 1));
  const auto ports = static_cast<int>(system.ports());
  study.add("port-3-moments", "port basis, s = 20/s, 3 moments", krylov_moments(specimen, system, 20, 3 * ports));
  study.add("port-4-shifts", "port basis, s = 20, 100, 300, 1000/s", krylov(system, {20, 100, 300, 1000}));
  if (options.imaginary_shifts) {
    const auto i = [](double omega) { return Complex(0, omega); };
    study.add("port-imaginary", "port basis, s = 20, 100i, 200i, 400i, 800i/s",
              krylov(system, {20, i(100), i(200), i(400), i(800)}));
  }
  study.add("port", "patch as sent", patch_model(specimen, system, kAttachOrder));
  return study.take();
}

}  // namespace palpate
