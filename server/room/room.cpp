#include "server/room/room.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "server/room/drawn_threads.hpp"
#include "server/room/frame_patches.hpp"
#include "server/room/nodal_fields.hpp"
#include "server/room/stepped_body.hpp"

namespace palpate {
namespace {

constexpr double kHomeHeightM = 0.020;  // above the top of the body: clear of it, and near

}  // namespace

struct Room::State {
  explicit State(const Scene& scene, const SteppedBody* like = nullptr)
      : body(scene, like), threads(body.scene().body), patches(body) {
    if (scene.is_cut_live()) surface.emplace(scene.body);
  }
  SteppedBody body;
  DrawnThreads threads;
  std::optional<LiveSurface> surface;  // of one that may be cut
  FramePatches patches;
};

Room::Room(const Scene& scene) : state_(std::make_unique<State>(scene)) {}
Room::Room(std::unique_ptr<State> state) : state_(std::move(state)) {}
Room Room::at_rest() const {
  Scene scene = state_->body.scene();
  scene.body = state_->body.begun();
  return Room(std::make_unique<State>(scene, &state_->body));
}
Room::~Room() = default;
Room::Room(Room&&) noexcept = default;
Room& Room::operator=(Room&&) noexcept = default;

Vec3 home_of(const Scene& scene) {
  const LumpedBody& body = scene.body;
  if (scene.tool.contact == ContactKind::attach) return body.nodes[scene.tool.node];
  Vec3 centre = Vec3::Zero();
  double top = -1e300;
  const std::span<const Vec3> own = std::span(body.nodes).first(own_nodes(body));
  for (const Vec3& x : own) {
    centre += x / static_cast<double>(own.size());
    top = std::max(top, x.z());
  }
  return {centre.x(), centre.y(), top + kHomeHeightM};
}

void Room::use_threads(ThreadPool& pool) { state_->body.use_threads(pool); }

std::optional<Room::Origin> Room::origin(StationId id) const {
  const SteppedBody& body = state_->body;
  const std::vector<std::size_t> ports = body.ports_of(id);
  if (ports.empty()) return std::nullopt;
  return Origin{body.state(), body.ports()[ports.front()], state_->patches.modes(id)};
}

const std::string& Room::integrator() const { return state_->body.integrator().reason; }

void Room::start(Micros body_time) {
  state_->body.start(body_time);
  state_->patches.clear();
}

bool Room::resume(const Vector& x, const Vector& v, const Eigen::MatrixXf& relaxed, const std::vector<CutStep>& cuts,
                  std::shared_ptr<const SutureState> threads) {
  SteppedBody& body = state_->body;
  if (const auto change = body.cut_again(cuts)) {
    state_->patches.renew();
    state_->surface->renew(body.scene().body, &*change);
  }
  return body.resume(x, v, relaxed, std::move(threads));
}

FrameResult Room::simulate(const FrameJob& job) {
  SteppedBody& body = state_->body;
  FrameResult result;
  const std::uint32_t epoch = body.epoch();
  const std::optional<AdvanceReport> report = body.step(job);
  if (body.epoch() != epoch) {
    state_->patches.renew();
    state_->surface->renew(body.scene().body, body.parted());
  }
  if (body.parted()) result.loose = body.parted()->loose;
  if (report) {
    state_->patches.drop_cached();
    result.steps = report->steps;
    result.cut_steps = report->cut_steps;
    result.newton_iterations = report->newton_iterations;
    result.failed = !report->converged;
    result.released = body.released();
  }
  result.sutures = body.suture_news();
  result.stamp = job.target;
  result.asleep = body.asleep();
  if (!state_->threads.empty()) state_->threads.advance(body.dynamics(), body.state(), body.thread_on_needle());
  if (job.shapes) {
    const std::vector<double> x = body.skin().place(body.state().x);
    for (std::uint32_t i = 0; i < body.scene().body.vertices(); ++i) result.positions.emplace_back(vertex(x, i));
    state_->threads.append(result.positions);
  }
  if (job.state) result.state = body.state();
  result.cuts = body.cuts();
  for (const ShapeChannel which : {ShapeChannel::tension, ShapeChannel::stress, ShapeChannel::strain, ShapeChannel::pressure})
    if (job.asks_for(which))
      result.fields[index_of(which)] = at_vertices(body.scene().body, nodal_field(body.dynamics(), body.state(), which));
  for (std::vector<float>& field : result.fields)
    if (!field.empty()) field.resize(field.size() + state_->threads.vertices(), 0.0F);
  if (!state_->surface) return result;
  result.surface = state_->surface->now();
  if (job.shapes) result.positions = state_->surface->by_number(result.positions, [](const Vec3& rest) { return rest; });
  for (std::vector<float>& field : result.fields)
    if (!field.empty()) field = state_->surface->by_number(field, [](const Vec3&) { return 0.0F; });
  return result;
}

void Room::build_patches(const FrameJob& job, FrameResult& result) {
  result.stations = state_->patches.build(job, result.failed);
  if (!job.asks_for(ShapeChannel::support) || result.positions.empty()) return;
  std::vector<float>& support = result.fields[index_of(ShapeChannel::support)];
  support.assign(result.positions.size(), 0.0F);
  for (const StationFrame& frame : result.stations)
    if (frame.patch) add_support(*frame.patch, result.positions, support);
}

void Room::listen(std::function<void(BuildPhase)> listener) { state_->patches.listen(std::move(listener)); }

FrameResult Room::run(const FrameJob& job) {
  FrameResult result = simulate(job);
  build_patches(job, result);
  return result;
}

}  // namespace palpate
