// A change of topology: the body of scenes/cuts/blade.json with finer cells, 1,600 nodes, into which a blade goes by a cell at a
// time; LiveCuts::cut_on() as in palpate-server, without new steppers and models of patches. `nodes`: of the body as it begins.
#include <benchmark/benchmark.h>

#include <memory>

#include "bench/micro/benchmarks.hpp"
#include "bench/micro/fixtures.hpp"
#include "bench/micro/timer.hpp"
#include "server/dynamics/needle_ports.hpp"
#include "server/room/live_cuts.hpp"

namespace palpate {
namespace {

constexpr double kSpacingM = 0.0087, kDeepestM = 0.05;

class Blade {
 public:
  Blade() {
    const Vec3 top(0, 0, 0.07);
    const SurfacePoint entry = skin_.nearest(0, skin_.rest(), top).point;
    ports_ = needle_ports(ToolPort{}, *tissue_);
    path_ = tissue_->path(entry, -Vec3::UnitZ(), Vec3::UnitY(), state_.x);
    begin();
  }
  std::size_t nodes() const { return scene_.body.nodes.size(); }
  /// Moves by a fifth of a cell; returns false at the end of its way.
  bool go_on() {
    front_m_ += 0.2 * kSpacingM;
    ports_.front().needle.tip = {true, front_m_, front_m_, 0};
    state_.time_s += 0.05;
    return front_m_ < kDeepestM;
  }
  bool cut_on() { return cuts_.cut_on(); }
  void make_whole() {
    for (ToolPort& port : ports_) port.needle.path.reset();
    cuts_.make_whole();
    begin();
  }

 private:
  void begin() {
    front_m_ = 0;
    ports_.front().needle.path = path_;
    ports_.front().touching = true;
    ports_.front().lambda = -Vec3::UnitZ();
  }

  Scene scene_ = blade_of(kSpacingM);
  Skin skin_{scene_.body, scene_.contact_radii()};
  std::unique_ptr<NeedleTissue> tissue_ = std::make_unique<NeedleTissue>(scene_, skin_);
  std::optional<Dynamics> dynamics_{std::in_place, scene_.body};
  BodyState rest_ = dynamics_->rest_state(), state_ = rest_;
  std::vector<ToolPort> ports_;
  std::shared_ptr<const NeedlePath> path_;
  double front_m_ = 0;
  LiveCuts cuts_{BodyInParts{&scene_, &skin_, &tissue_, &dynamics_, &state_, &rest_, &ports_}};
};

void changes(benchmark::State& state) {
  Blade blade;
  for (auto _ : state) {
    for (bool parted = false; !parted;) {
      if (!blade.go_on()) blade.make_whole();
      const ProcessorTimer timer;
      parted = blade.cut_on();
      state.SetIterationTime(timer.seconds());
    }
  }
  state.counters["nodes"] = static_cast<double>(blade.nodes());
}

}  // namespace

void add_cut_benchmarks() { benchmark::RegisterBenchmark("cut/blade", changes)->UseManualTime()->Unit(benchmark::kMillisecond); }

}  // namespace palpate
